"""Whether the noise differs from record to record, and the level by which each record then weighs."""

from collections.abc import Sequence

import numpy as np
import scipy

from ..._show import number
from .._record import Record
from ._scatter import Scatter

_FALSE_DIFFERENCE = 1e-3
"""Chance that records of equal noise are taken for different ones."""


def bartlett(scatters: Sequence[Scatter]) -> float:
    """Gives the p-value of the hypothesis that mean squares estimate one variance; 1 where one is zero.

    Args:
        scatters: Mean squares of normal noise, with their degrees of freedom.

    Source: Bartlett 1937, Proc. R. Soc. Lond. A 160:268; Snedecor & Cochran 1989, Statistical Methods, sec.
        13.10.
    """
    squares, freedom = np.array(scatters).reshape(-1, 2).T
    if squares.size < 2 or not np.all(squares > 0.0):
        return 1.0
    whole = float(np.sum(freedom))
    misfit = whole * np.log(np.sum(freedom * squares) / whole) - np.sum(freedom * np.log(squares))
    spread = 1.0 + (np.sum(1.0 / freedom) - 1.0 / whole) / (3.0 * (squares.size - 1))
    return float(scipy.stats.chi2.sf(misfit / spread, squares.size - 1))


def differ(scatters: Sequence[Scatter]) -> bool:
    """Says whether mean squares differ by more than chance allows."""
    return bartlett(scatters) < _FALSE_DIFFERENCE


def record_levels(
    sigma: float, scatters: Sequence[Scatter | None], counted: Sequence[bool]
) -> tuple[float, ...]:
    """Gives the rms noise by which each record weighs: its own where records differ, else the pooled one.

    Where those that count are alike, one of the others still weighs with its own noise if that differs from
    theirs.

    Args:
        sigma: The pooled rms.
        scatters: Of each record; None where it shows no noise by itself.
        counted: Whether it may change how the others weigh: a held-out record may not.
    """
    known = [one for one, counts in zip(scatters, counted, strict=True) if counts and one is not None]
    apart = differ(known)
    freedom = sum(one.freedom for one in known)
    common = [Scatter(sum(one.square * one.freedom for one in known) / freedom, freedom)] if known else []

    def own(one: Scatter | None, counts: bool) -> bool:
        return one is not None and (apart or (not counts and differ([*common, one])))

    return tuple(
        float(np.sqrt(one.square)) if one is not None and own(one, counts) else sigma
        for one, counts in zip(scatters, counted, strict=True)
    )


def words_of_levels(records: Sequence[Record], levels: Sequence[float]) -> str:
    """Gives by how much records differ in their noise, "" where they do not."""
    low, high = min(levels, default=0.0), max(levels, default=0.0)
    if low == high:
        return ""
    names = [records[levels.index(level)].name for level in (low, high)]
    return (
        f"the noise differs from record to record, from {number(low)} rms in {names[0]} to {number(high)} "
        f"rms in {names[1]}: each record weighs with its own"
    )
