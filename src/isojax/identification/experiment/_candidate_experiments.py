"""Candidate experiments: what the test rig of a campaign could also do.

All of them have records of equal length, so that one compiled simulation serves them all.
"""

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from ...models import Quantity
from ...records import Campaign, Record, power_spectrum
from ..diagnosis import AGAIN, Experiment

DWELLS = 6
"""Segments of a record, each simulated from a state of its own."""

MOST_LEVELS = 3

MIDDLE_CYCLES = 10.0
"""Cycles of the middle frequency in a segment."""

SLOW_CYCLES = 4.0
"""Cycles of the lowest frequency in a segment."""

MOST_STEPS = 8000
"""Integration steps of a segment at most, unless that leaves fewer than `FEWEST_CYCLES`."""

FEWEST_CYCLES = 3.0

SAMPLES_A_CYCLE = 80.0
"""Samples a cycle of the highest frequency that a simulation takes at most; more say nothing new."""

HIGHEST = 0.4
"""Highest frequency that is driven, as a share of the sampling rate."""

EXTRA_MASS = 0.1
"""Share of the isolated mass that is bolted on."""


class TestOutline(NamedTuple):
    """What a campaign did, in brief.

    Attributes:
        levels: rms of the drive [its SI unit], lowest to highest.
        lowest: lowest frequency driven [Hz].
        highest: highest frequency driven [Hz].
        stepped: whether it was driven with sines.
        rate: samples a second of a simulation [Hz].
        samples: samples per segment.
    """

    levels: tuple[float, ...]
    lowest: float
    highest: float
    stepped: bool
    rate: float
    samples: int


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
    chosen = sorted({0, len(sizes) // 2, len(sizes) - 1}) if len(sizes) > 1 else [0]
    bands = np.array([_driven_band(record) for record in driven])
    lowest, highest = float(bands[:, 0].min()), float(bands[:, 1].max())
    fewer = 1 if every_sample else max(1, int(campaign.rate / (SAMPLES_A_CYCLE * highest)))
    rate = campaign.rate / fewer
    middle = 0.5 * (lowest + highest)
    longest = max(MOST_STEPS / substeps, FEWEST_CYCLES * rate / middle)
    samples = min(rate * max(MIDDLE_CYCLES / middle, SLOW_CYCLES / lowest), longest)
    stepped = any(one.dwells or one.kind == "swept" for one in driven)
    levels = tuple(sizes[place] for place in chosen)[:MOST_LEVELS]
    return TestOutline(levels, lowest, highest, stepped, rate, int(np.ceil(samples)))


def _driven_band(record: Record) -> tuple[float, float]:
    """Give the band of a record's drive: of its dwells, else of all but a hundredth of its power."""
    if record.dwells:
        frequencies = [dwell.frequency for dwell in record.dwells]
        return min(frequencies), max(frequencies)
    frequency, power = power_spectrum(record.input - np.mean(record.input), record.rate)
    share = np.cumsum(power) / np.sum(power)
    low, high = np.searchsorted(share, [5e-3, 1.0 - 5e-3])
    return max(float(frequency[low]), float(frequency[1])), float(frequency[high])


def drive_of(
    outline: TestOutline, levels: tuple[float, ...], lowest: float, highest: float, stepped: bool
) -> Float[np.ndarray, "record time"]:
    """Give the drive of a test: one record a level, of `DWELLS` segments.

    Args:
        outline: sampling rate and length of a segment.
        levels: rms of each record [SI unit of the drive].
        lowest: lowest frequency [Hz].
        highest: highest frequency [Hz].
        stepped: sines, a whole number of cycles in each segment, up in one record and down in the next; else
            random-phase multisines whose period is the record.

    Returns:
        The drive; its end meets its start.
    """
    samples, total = outline.samples, DWELLS * outline.samples
    rows = []
    for row, level in enumerate(levels):
        if stepped:
            cycles = np.maximum(1, np.round(np.linspace(lowest, highest, DWELLS) * samples / outline.rate))
            turned = cycles if row % 2 == 0 else cycles[::-1]
            phase = 2.0 * np.pi * turned[:, None] * np.arange(samples) / samples
            rows.append(np.sqrt(2.0) * level * np.sin(phase).ravel())
            continue
        orders = np.arange(total // 2)
        inside = (
            (orders >= lowest * total / outline.rate)
            & (orders <= highest * total / outline.rate)
            & (orders > 0)
        )
        spectrum = np.zeros(total // 2 + 1, dtype=complex)
        phases = np.random.default_rng(row).uniform(0.0, 2.0 * np.pi, orders.size)
        spectrum[orders[inside]] = np.exp(1j * phases[inside])
        signal = np.fft.irfft(spectrum, total)
        rows.append(level * signal / np.std(signal))
    return np.stack(rows)


def repeated_campaign(campaign: Campaign, outline: TestOutline) -> Experiment:
    """Give the test that the campaign was."""
    drive = drive_of(outline, outline.levels, outline.lowest, outline.highest, outline.stepped)
    return Experiment(
        AGAIN, "repeat the same test", drive, outline.rate, campaign.output.quantity, outline.stepped
    )


def candidate_experiments(campaign: Campaign, outline: TestOutline, load: float) -> tuple[Experiment, ...]:
    """Give the tests that could be made, the yardstick first.

    Args:
        campaign: the measurements.
        outline: what they did.
        load: static force that shifts the rest position by the amplitude of the motion [N].

    Returns:
        The experiments.
    """
    again = repeated_campaign(campaign, outline)
    levels, low, high = outline.levels, outline.lowest, outline.highest
    unit = "m/s^2" if campaign.input.quantity == "base_acceleration" else "N"

    def driven(name: str, words: str, *how: Any, lacking: str = "") -> Experiment:
        return again._replace(
            name=name, words=words, drive=drive_of(outline, *how), stepped=how[-1], lacking=lacking
        )

    below, above = levels[0] / 3.0, 1.5 * levels[-1]
    limit = HIGHEST * outline.rate
    upper = min(2.0 * high, limit)
    narrow = "" if upper > 1.2 * high else "the sampling rate leaves no room above the band"
    middle = levels[len(levels) // 2]
    span = f"from {low:.3g} to {high:.3g} Hz"
    other = "a random-phase multisine" if outline.stepped else "a stepped sine"
    mass = EXTRA_MASS * campaign.mass
    quantity: Quantity = "displacement"
    return (
        again,
        driven(
            "lower_level",
            f"repeat the test at a third of the lowest level ({below:.3g} {unit} rms)",
            (below,) * len(levels),
            low,
            high,
            outline.stepped,
        ),
        driven(
            "higher_level",
            f"repeat the test at 1.5 times the top level ({above:.3g} {unit} rms)",
            (above,) * len(levels),
            low,
            high,
            outline.stepped,
        ),
        driven(
            "band_up",
            f"extend the band up to {upper:.3g} Hz",
            levels,
            low,
            upper,
            outline.stepped,
            lacking=narrow,
        ),
        driven(
            "band_down",
            f"extend the band down to {0.5 * low:.3g} Hz",
            levels,
            0.5 * low,
            high,
            outline.stepped,
        ),
        again._replace(
            name="extra_mass",
            words=f"bolt a known {mass:.3g} kg onto the isolator and repeat the test",
            extra_mass=mass,
        ),
        again._replace(
            name="static_load",
            words=f"put a known static load of {load:.3g} N on the isolator and repeat the test",
            load=load,
            lacking="" if load > 0.0 else "no spring would hold a static load",
        ),
        driven(
            "other_waveform",
            f"drive {other} {span} at the middle level ({middle:.3g} {unit} rms)",
            (middle,) * len(levels),
            low,
            high,
            not outline.stepped,
        ),
        again._replace(
            name="dc_sensor",
            words="measure the displacement, mean included, with a DC-capable sensor in place of the present "
            "one and repeat the test",
            quantity=quantity,
            lacking="the campaign has such a sensor" if campaign.output.quantity == quantity else "",
        ),
    )
