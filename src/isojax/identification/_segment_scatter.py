"""How much the linear stiffness scatters from dwell to dwell, as repeats of a record show it."""

import itertools
from collections import defaultdict
from typing import NamedTuple

import numpy as np
from scipy import stats

from ..records import Record
from ._information import STIFFNESS_SCALE_UNIT
from ._problem import Point
from ._segments import Segment

SIGNIFICANCE = 0.01
"""Chance, were there no scatter, of differences as large as those that are taken for scatter."""

ALIKE = 0.1
"""Relative difference of rms from which two dwells lie on different branches, or were driven otherwise."""


class _Pair(NamedTuple):
    """The same segments of two repeats: how far each one's stiffness seems to differ, and how surely."""

    differences: np.ndarray
    variances: np.ndarray


def segment_scatter(records: tuple[Record, ...], segments: tuple[Segment, ...], point: Point) -> float:
    """Give the standard deviation of the linear stiffness from segment to segment within a record.

    Two repeats of a record (equal level, direction and role) share every deterministic error of the model,
    transients included, segment by segment; what their difference keeps beyond a constant, which is the
    scatter from record to record, and beyond the noise, is scatter from segment to segment. Dwells that the
    repeats passed on different branches of the response say nothing.

    Args:
        records: the records.
        segments: pieces of them.
        point: equations of these segments.

    Returns:
        Relative standard deviation; 0 where no repeat shows one.

    Source: DerSimonian & Laird 1986, Controlled Clinical Trials 7:177, eq. 8 (estimate by moments).
    """
    squares, freedom, weight = 0.0, 0, 0.0
    for pair in _pairs(records, segments, point):
        weights = 1.0 / pair.variances
        mean = np.sum(weights * pair.differences) / weights.sum()
        squares += float(np.sum(weights * (pair.differences - mean) ** 2))
        freedom += pair.differences.size - 1
        weight += float(weights.sum() - np.sum(weights**2) / weights.sum())
    if freedom < 1 or not stats.chi2.sf(squares, freedom) < SIGNIFICANCE:
        return 0.0
    # A difference holds the scatter of two segments.
    return float(np.sqrt(max(0.0, squares - freedom) / weight / 2.0)) * STIFFNESS_SCALE_UNIT


def _pairs(records: tuple[Record, ...], segments: tuple[Segment, ...], point: Point) -> list[_Pair]:
    """List pairs of repeats, no record in more than one."""
    groups = defaultdict(list)
    for place, record in enumerate(records):
        groups[record.level, record.direction, record.role, record.kind].append(place)
    held = defaultdict(list)
    for lane, segment in enumerate(segments):
        held[segment.record].append(lane)
    pairs = []
    for group in groups.values():
        for one, other in itertools.pairwise(group):
            if group.index(one) % 2:
                continue
            lanes = np.array(
                [
                    both
                    for both in zip(held[one], held[other], strict=False)
                    if _is_the_same(records, segments[both[0]], segments[both[1]])
                ],
                dtype=int,
            ).reshape(-1, 2)
            information, score = point.reduced.by_segment[lanes].transpose(2, 0, 1)
            seen = np.all(information > 0.0, axis=1)
            if np.count_nonzero(seen) > 1:
                found = score[seen] / information[seen]
                variances = np.sum(1.0 / information[seen], axis=1)
                pairs.append(_Pair(found[:, 0] - found[:, 1], variances))
    return pairs


def _is_the_same(records: tuple[Record, ...], one: Segment, other: Segment) -> bool:
    """Say whether two segments passed the same test on the same branch."""
    first, second = records[one.record], records[other.record]
    if (one.start, one.stop, one.counted) != (other.start, other.stop, other.counted):
        return False
    if _frequency(first, one) != _frequency(second, other):
        return False
    span = slice(one.start, one.stop)
    drives = first.input[span], second.input[span]
    sizes = [float(np.sqrt(np.mean(record.output[span] ** 2))) for record in (first, second)]
    drive = float(np.sqrt(np.mean(drives[0] ** 2)))
    return (
        abs(sizes[0] - sizes[1]) < ALIKE * max(sizes)
        and float(np.sqrt(np.mean((drives[0] - drives[1]) ** 2))) < ALIKE * drive
    )


def _frequency(record: Record, segment: Segment) -> float | None:
    """Give the frequency of the dwell that a segment is, None where it is none."""
    return next((dwell.frequency for dwell in record.dwells if dwell.start == segment.start), None)
