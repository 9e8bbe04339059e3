"""How much the linear stiffness scatters from dwell to dwell, as repeats of a record show it."""

import itertools
from collections import defaultdict
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy import stats

from ...records import Record
from .._rules import Rules
from ..jacobian import STIFFNESS_SCALE_UNIT, Segment
from ._problem import Point

SAME_FREQUENCY = 1e-3
"""Relative difference up to which two dwells have one frequency."""

SAME_DRIVE_AND_RESPONSE = 0.1
"""Relative difference of rms from which two dwells are on different branches, or were driven differently."""

_Lane = tuple[int, Segment]


class _Pair(NamedTuple):
    """The same segments of two repeats: how far each one's stiffness seems to differ, and how surely."""

    differences: np.ndarray
    variances: np.ndarray


def segment_scatter(
    records: tuple[Record, ...], segments: tuple[Segment, ...], point: Point, inflation: float, rules: Rules
) -> float:
    """Give the standard deviation of the linear stiffness from segment to segment within a record.

    Two repeats of a record (equal level, direction, conditions and role) share every deterministic error of
    the model, transients included, segment by segment; what their difference keeps beyond a constant, which
    is the scatter from record to record, and beyond the noise, is scatter from segment to segment. Dwells
    that the repeats passed on different branches of the response say nothing.

    Args:
        records: the records.
        segments: pieces of them.
        point: equations of these segments.
        inflation: chi2/dof. Noise that is larger than was thought would pass for scatter, and so would a law
            that is missing, as far as the repeats differ in amplitude; scatter itself hardly raises it, each
            segment having many samples to its one stiffness.
        rules: what counts as scatter.

    Returns:
        Relative standard deviation; 0 where no repeat shows one.

    Source: DerSimonian & Laird 1986, Controlled Clinical Trials 7:177, eq. 8 (estimate by moments).
    """
    squares, freedom, weight = 0.0, 0, 0.0
    for pair in _pairs(records, segments, point):
        weights = 1.0 / (max(1.0, inflation) * pair.variances)
        mean = np.sum(weights * pair.differences) / weights.sum()
        squares += float(np.sum(weights * (pair.differences - mean) ** 2))
        freedom += pair.differences.size - 1
        weight += float(weights.sum() - np.sum(weights**2) / weights.sum())
    if freedom < 1 or not stats.chi2.sf(squares, freedom) < rules.significance:
        return 0.0
    # A difference holds the scatter of two segments.
    return float(np.sqrt(max(0.0, squares - freedom) / weight / 2.0)) * STIFFNESS_SCALE_UNIT


def _pairs(records: tuple[Record, ...], segments: tuple[Segment, ...], point: Point) -> list[_Pair]:
    """List pairs of repeats, no record in more than one."""
    groups = defaultdict(list)
    for place, record in enumerate(records):
        groups[record.level, record.direction, record.conditions, record.role, record.kind].append(place)
    held = defaultdict(list)
    for lane, segment in enumerate(segments):
        held[segment.record].append((lane, segment))
    pairs = []
    for group in groups.values():
        for one, other in itertools.pairwise(group):
            if group.index(one) % 2:
                continue
            lanes = np.array(_matched(records, held[one], held[other]), dtype=int).reshape(-1, 2)
            own = point.reduced.by_segment[lanes]
            information, score = own[..., -2, -2], own[..., -2, -1]
            seen = np.all(information > 0.0, axis=1)
            if np.count_nonzero(seen) > 1:
                found = score[seen] / information[seen] + point.nuisances.segments[lanes[seen]]
                variances = np.sum(1.0 / information[seen], axis=1)
                pairs.append(_Pair(found[:, 0] - found[:, 1], variances))
    return pairs


def _matched(records: tuple[Record, ...], own: list[_Lane], others: list[_Lane]) -> list[tuple[int, int]]:
    """List the segments of one record with those of its repeat that passed the same test, in their order."""
    pairs, left = [], list(others)
    for lane, segment in own:
        match = next((one for one in left if _is_the_same(records, segment, one[1])), None)
        if match is not None:
            pairs.append((lane, match[0]))
            left = left[left.index(match) + 1 :]
    return pairs


def _is_the_same(records: tuple[Record, ...], one: Segment, other: Segment) -> bool:
    """Say whether two segments passed the same test on the same branch.

    A dwell is the same at equal frequency and level, wherever in the record it lies; another window only
    where its drive is the same sample by sample.
    """
    first, second = records[one.record], records[other.record]
    frequencies = _frequency(first, one), _frequency(second, other)
    if frequencies[0] is None or frequencies[1] is None:
        if frequencies != (None, None) or (one.start, one.stop) != (other.start, other.stop):
            return False
        difference = (
            _rms(first.input - second.input, one) if first.input.size == second.input.size else np.inf
        )
        if not difference < SAME_DRIVE_AND_RESPONSE * _rms(first.input, one):
            return False
    elif abs(frequencies[0] - frequencies[1]) > SAME_FREQUENCY * frequencies[0]:
        return False
    sizes = [
        (_rms(record.input, segment), _rms(record.output, segment))
        for record, segment in ((first, one), (second, other))
    ]
    return all(abs(a - b) < SAME_DRIVE_AND_RESPONSE * max(a, b) for a, b in zip(*sizes, strict=True))


def _rms(signal: Float[np.ndarray, " time"], segment: Segment) -> float:
    return float(np.sqrt(np.mean(signal[segment.counted : segment.stop] ** 2)))


def _frequency(record: Record, segment: Segment) -> float | None:
    """Give the frequency of the dwell that a segment is, None where it is none."""
    return next((dwell.frequency for dwell in record.dwells if dwell.start == segment.start), None)
