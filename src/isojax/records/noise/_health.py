"""Data health: dwells that never settled, blows too brief for the rate, differences of repeats, spikes."""

from dataclasses import dataclass

import numpy as np
import scipy

from ..._show import shown
from .._blow import blow_samples
from .._campaign import Campaign
from .._record import Dwell, Record
from ..spectrum import dwell_harmonics, harmonic_basis, without
from ._noise_peak import NoisePeak, noise_peak
from ._repeats import repeat_groups
from ._spike_counts import Spikes, spikes

_LAST_CYCLES = 6
"""Cycles at the end of a dwell that are compared with each other."""

_FREE_ORDERS = 3
"""Harmonics that may differ from cycle to cycle."""

_COMMON_ORDERS = 12
"""Highest harmonic that all these cycles have in common, where a cycle has 60 samples and more."""

_FALSE_REPORT = 1e-3
"""Chance, over all dwells tested, that a settled one is reported as unsettled."""

_FEW_SAMPLES = 4
"""Samples in a row below which the shape of a blow between them is unknown."""


@shown
@dataclass(frozen=True)
class UnsettledDwell:
    """A dwell whose last cycles still differ from one another by more than noise.

    Attributes:
        record: Name of the record.
        dwell: The dwell.
        p_value: Of the F-test that all its last cycles have the same harmonics.
        change: rms of the change between cycles over the rms of the output.
    """

    record: str
    dwell: Dwell
    p_value: float
    change: float


@shown
@dataclass(frozen=True)
class RepeatDifference:
    """How much two records at equal level and direction differ.

    Attributes:
        first: Name of a record.
        second: Name of its repeat.
        output: rms difference over the dwells of the first-harmonic output amplitude, relative.
        input: The same of the input.
    """

    first: str
    second: str
    output: float
    input: float


@shown
@dataclass(frozen=True)
class BriefBlow:
    """A blow so brief that its samples do not show its shape, nor the momentum that it gave.

    Attributes:
        record: Name of the record.
        samples: Samples in a row that stand above the noise.
    """

    record: str
    samples: int


@shown
@dataclass(frozen=True)
class DataHealth:
    """What the reader must know of the data before judging a model.

    Attributes:
        dwells: Number of dwells tested.
        unsettled: Those that never settled.
        repeats: Pairs of repeats.
        brief_blows: Records whose blow lasts fewer than four samples.
        noise_peak: Resonance peak in the scatter, or None; not sought where a floor is measured.
        spikes: Channels in which single samples stand alone.
    """

    dwells: int
    unsettled: tuple[UnsettledDwell, ...]
    repeats: tuple[RepeatDifference, ...]
    brief_blows: tuple[BriefBlow, ...] = ()
    noise_peak: NoisePeak | None = None
    spikes: tuple[Spikes, ...] = ()

    @property
    def repeatability(self) -> float:
        """Median relative difference of the output between repeats; NaN without repeats."""
        return float(np.median([pair.output for pair in self.repeats])) if self.repeats else float("nan")


def data_health(campaign: Campaign, smallest_change: float = 0.01) -> DataHealth:
    """Gives unsettled dwells, too brief blows, differences of repeats, a resonance in the scatter, spikes.

    A dwell is unsettled if the F-test on the scatter between its last six cycles is significant at 0.001 over
    all dwells, and if the change exceeds `smallest_change` of the output's rms.

    Args:
        campaign: The campaign.
        smallest_change: Relative change between cycles that matters.

    Returns:
        The summary.
    """
    tested = [
        UnsettledDwell(record.name, dwell, *result)
        for record in campaign.records
        for dwell in record.dwells
        if (result := cycle_change(record, dwell)) is not None
    ]
    limit = _FALSE_REPORT / max(len(tested), 1)
    unsettled = tuple(one for one in tested if one.p_value < limit and one.change > smallest_change)
    peak = noise_peak(campaign) if campaign.floor is None else None
    return DataHealth(
        len(tested),
        unsettled,
        _repeat_differences(campaign),
        brief_blows(campaign),
        peak,
        spikes(campaign),
    )


def brief_blows(campaign: Campaign) -> tuple[BriefBlow, ...]:
    """Gives the records whose blow lasts fewer than four samples, in the file as the reader found it.

    Args:
        campaign: The campaign.

    Returns:
        The records, in the campaign's order.
    """
    counted = [
        BriefBlow(record.name, blow_samples(record.raw_input))
        for record in campaign.records
        if record.kind == "impulse"
    ]
    return tuple(blow for blow in counted if blow.samples < _FEW_SAMPLES)


def cycle_change(record: Record, dwell: Dwell) -> tuple[float, float] | None:
    """Gives the p-value of the hypothesis that the last six cycles are equal, and the relative change between
    them; None for a dwell that is too short.
    """
    cycle = record.rate / dwell.frequency
    if dwell.cycles < _LAST_CYCLES + 1 or cycle < 2 * _FREE_ORDERS + 3:
        return None
    edges = dwell.stop - np.round(np.arange(_LAST_CYCLES, -1, -1) * cycle).astype(int)
    start = int(edges[0])
    signal = record.output[start : dwell.stop]
    time = (np.arange(start, dwell.stop) - start) / record.rate
    orders = max(_FREE_ORDERS, min(_COMMON_ORDERS, int(0.2 * cycle)))
    common = harmonic_basis(time, dwell.frequency, orders)
    shared = without(common, signal)
    own = shared.copy()
    few = harmonic_basis(time, dwell.frequency, _FREE_ORDERS)
    for first, last in zip(edges[:-1] - start, edges[1:] - start, strict=True):
        own[first:last] = without(few[first:last], shared[first:last])
    before, after = float(shared @ shared), float(own @ own)
    gained = (_LAST_CYCLES - 1) * few.shape[1]
    left = signal.size - common.shape[1] - gained
    size = float(np.sqrt(np.mean((signal - np.mean(signal)) ** 2)))
    if after <= 0.0 or left < 1 or size == 0.0:
        return None
    ratio = (before - after) / gained / (after / left)
    change = np.sqrt(max(before - after - gained * after / left, 0.0) / signal.size) / size
    return float(scipy.stats.f.sf(ratio, gained, left)), float(change)


def _repeat_differences(campaign: Campaign) -> tuple[RepeatDifference, ...]:
    order = {record.name: i for i, record in enumerate(campaign.records)}
    groups = repeat_groups(campaign.records)
    pairs = []
    for record in campaign.records:
        for other in groups[record.name]:
            if order[other.name] > order[record.name] and len(other.dwells) == len(record.dwells) > 0:
                drive, response = _relative_difference(record, other)
                pairs.append(RepeatDifference(record.name, other.name, response, drive))
    return tuple(pairs)


def _relative_difference(one: Record, other: Record) -> tuple[float, float]:
    pairs = [
        (dwell_harmonics(one, mine), dwell_harmonics(other, its))
        for mine, its in zip(one.dwells, other.dwells, strict=True)
    ]
    drives = np.array([[abs(a.input[1]), abs(b.input[1])] for a, b in pairs])
    responses = np.array([[abs(a.output[1]), abs(b.output[1])] for a, b in pairs])
    drive, response = (
        float(np.sqrt(np.mean((np.diff(both)[:, 0] / np.mean(both, axis=1)) ** 2)))
        for both in (drives, responses)
    )
    return drive, response
