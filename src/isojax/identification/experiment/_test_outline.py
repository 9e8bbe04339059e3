"""What a campaign did, in brief: levels, band, waveform, and how finely it has to be simulated."""

from typing import NamedTuple

import numpy as np

from ...records import Campaign, Record, power_spectrum
from ..diagnosis import Conditions, Waveform

MIDDLE_CYCLES = 10.0
"""Cycles of the middle frequency in a segment."""

SLOW_CYCLES = 4.0
"""Cycles of the lowest frequency in a segment."""

MOST_STEPS = 8000
"""Integration steps of a segment at most, unless that leaves fewer than `FEWEST_CYCLES`."""

FEWEST_CYCLES = 3.0

SAMPLES_A_CYCLE = 80.0
"""Samples a cycle of the highest frequency that a simulation takes at most; more say nothing new."""


class TestOutline(NamedTuple):
    """What a campaign did, in brief.

    Attributes:
        levels: rms of the drive [its SI unit], lowest to highest.
        lowest: lowest frequency driven [Hz].
        highest: highest frequency driven [Hz].
        waveform: stepped sine where it was driven with sines, else multisine.
        rate: samples a second of a simulation [Hz].
        samples: samples per segment.
        nominal: nominal level of a record over its rms; 1 where the campaign declares none.
        conditions: operating conditions of its records: the lowest, the middle and the highest; none where
            some record states none.
    """

    levels: tuple[float, ...]
    lowest: float
    highest: float
    waveform: Waveform
    rate: float
    samples: int
    nominal: float
    conditions: tuple[Conditions, ...] = ()


def find_test_outline(campaign: Campaign, substeps: int, every_sample: bool) -> TestOutline | None:
    """Find what a campaign did.

    Args:
        campaign: the measurements.
        substeps: integration steps a sample.
        every_sample: whether simulations must have the campaign's own rate.

    Returns:
        The plan; None where nothing drove the isolator on and on (a release, blows).
    """
    driven = [one for one in campaign.fit_records if not one.rings_down and np.std(one.input) > 0.0]
    if not driven:
        return None
    groups: dict[float, list[float]] = {}
    for record in driven:
        size = float(np.std(record.input))
        # Without nominal levels, records whose drives agree within a few per cent are of one.
        level = float(f"{size:.1e}") if record.level is None else record.level
        groups.setdefault(level, []).append(size)
    sizes = sorted(float(np.mean(group)) for group in groups.values())
    bands = np.array([_driven_band(record) for record in driven])
    lowest, highest = float(bands[:, 0].min()), float(bands[:, 1].max())
    fewer = 1 if every_sample else max(1, int(campaign.rate / (SAMPLES_A_CYCLE * highest)))
    rate = campaign.rate / fewer
    middle = 0.5 * (lowest + highest)
    longest = max(MOST_STEPS / substeps, FEWEST_CYCLES * rate / middle)
    samples = min(rate * max(MIDDLE_CYCLES / middle, SLOW_CYCLES / lowest), longest)
    sines = any(one.dwells or one.kind == "swept" for one in driven)
    levels = tuple(sizes[place] for place in _spread(len(sizes)))
    stated = sorted({record.conditions for record in driven})
    conditions = tuple(stated[place] for place in _spread(len(stated))) if all(stated) else ()
    ratios = [one.level / np.std(one.input) for one in driven if one.level is not None]
    nominal = float(np.mean(ratios)) if ratios else 1.0
    waveform: Waveform = "stepped sine" if sines else "multisine"
    return TestOutline(levels, lowest, highest, waveform, rate, int(np.ceil(samples)), nominal, conditions)


def _spread(count: int) -> list[int]:
    """Give the places of the first, the middle and the last of so many."""
    return sorted({0, count // 2, count - 1})


def _driven_band(record: Record) -> tuple[float, float]:
    """Give the band of a record's drive: of its dwells, else of all but a hundredth of its power."""
    if record.dwells:
        frequencies = [dwell.frequency for dwell in record.dwells]
        return min(frequencies), max(frequencies)
    frequency, power = power_spectrum(record.input - np.mean(record.input), record.rate)
    share = np.cumsum(power) / np.sum(power)
    low, high = np.searchsorted(share, [5e-3, 1.0 - 5e-3])
    return max(float(frequency[low]), float(frequency[1])), float(frequency[high])
