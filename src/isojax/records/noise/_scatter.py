"""What does not repeat in a record: the scatter about the harmonics of dwells, or from period to period."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import scipy
from jaxtyping import Bool, Float

from .._record import Dwell, Record
from ..spectrum import NoiseBand, Rest, dwell_rest, dwell_window, hum_lines
from ._colour import Colour, Piece, whitened_square

_SETTLED_QUANTILE = 0.25
"""Quantile of the dwells' scatters that is taken for noise: up to three quarters of them may be unsettled."""

_FEWEST_DWELLS = 4
"""Dwells without which the median is taken instead."""

_UNSETTLED = 1e-3
"""Chance that a settled dwell scatters so much that it is left out."""

_TRANSIENT = 1.2
"""The first period is left out where it raises the scatter of the others by this factor."""


class Scatter(NamedTuple):
    """A mean square of noise.

    Attributes:
        square: In the output's unit squared.
        freedom: Its degrees of freedom.
    """

    square: float
    freedom: float


def cycle_scatter(record: Record, band: NoiseBand) -> Scatter | None:
    """Gives the scatter about the harmonics of the last quarter of each dwell, at least four cycles; None if
    none is long.

    Up to 120 harmonics below 0.45 of the rate are removed, also beyond a filter's cut-off, where they can
    exceed the noise; the fundamental may drift linearly. Significant lines of the mains are removed as well:
    a model can explain them. Dwells that never settle, near a fold or in modulation, are left out: those
    whose scatter exceeds the level of the lower quartile by more than chance (1e-3, chi-square) allows.

    Args:
        record: The record.
        band: The band that the noise fills.
    """
    found = [_dwell_scatter(record, dwell, band) for dwell in record.dwells]
    return _settled_scatter([one for one in found if one is not None])


def _dwell_scatter(record: Record, dwell: Dwell, band: NoiseBand) -> Scatter | None:
    """Gives the scatter about the harmonics of a dwell's end; None if it is too short."""
    window = dwell_window(record, dwell)
    if window is None:
        return None
    lines = tuple(line.frequency for line in hum_lines(record))
    rest, frequencies, _ = dwell_rest(record, dwell, window, lines)
    taken = float(np.sum(band.power_gain(frequencies)))
    # Noise of a narrow band has fewer degrees of freedom than samples, and the harmonics use some of them.
    freedom = window * band.share - taken
    if freedom < taken:
        return None
    return Scatter(float(rest @ rest) * band.share / freedom, float(freedom))


def _settled_scatter(dwells: list[Scatter]) -> Scatter | None:
    """Gives the scatter of the dwells that have settled; None without dwells."""
    if not dwells:
        return None
    level, settled = _settled_level(*np.array(dwells).T)
    return Scatter(level, sum(one.freedom for one, kept in zip(dwells, settled, strict=True) if kept))


def _settled_level(
    squares: Float[np.ndarray, " dwell"], freedom: Float[np.ndarray, " dwell"]
) -> tuple[float, Bool[np.ndarray, " dwell"]]:
    """Gives the mean square of the dwells that have settled, and which ones have."""
    quantile = _SETTLED_QUANTILE if squares.size >= _FEWEST_DWELLS else 0.5
    level = np.quantile(squares * freedom / scipy.stats.chi2.ppf(quantile, freedom), quantile)
    limit = scipy.stats.chi2.isf(_UNSETTLED, freedom)
    for _ in range(3):
        settled = squares * freedom <= level * limit
        level = np.average(squares[settled], weights=freedom[settled]) if np.any(settled) else level
    return float(level), squares * freedom <= level * limit


def period_scatter(record: Record, band: NoiseBand) -> Scatter | None:
    """Gives the scatter from period to period; None without two periods.

    Only whole periods after the settle samples count. With three and more the first ones are left out as long
    as they scatter clearly more than the others (a transient).

    Args:
        record: The record.
        band: The band that the noise fills.
    """
    periods = _settled_periods(record)
    if not len(periods):
        return None
    return Scatter(_variance_of_periods(periods), (len(periods) - 1.0) * periods.shape[1] * band.share)


def _settled_periods(record: Record) -> Float[np.ndarray, "period time"]:
    """Gives the periods that count; none without two."""
    periods = record.periods
    if len(periods) < 2:
        return periods[:0]
    squares = [_variance_of_periods(periods[first:]) for first in range(max(1, len(periods) - 1))]
    chosen = len(squares) - 1
    for first in range(len(squares) - 1, -1, -1):
        chosen = first if squares[first] < _TRANSIENT * squares[chosen] else chosen
    return periods[chosen:]


def _variance_of_periods(periods: Float[np.ndarray, "period time"]) -> float:
    rest = periods - np.mean(periods, axis=0)
    return float(np.mean(rest**2)) * periods.shape[0] / (periods.shape[0] - 1)


def settled_pieces(record: Record, method: str, colour: Colour | None) -> list[Piece]:
    """Gives the windows of a record that hold noise alone.

    Which dwells have settled is judged by white innovations: the scatter of coloured noise itself varies
    more, and with the frequency of the dwell.

    Args:
        record: The record.
        method: "cycle_scatter" for dwells, "periods" for periods; others have none.
        colour: The law of the noise, as far as it is known.
    """
    if method != "cycle_scatter":
        return _noise_pieces(record, method)
    pieces = _noise_pieces(record, method)
    if not pieces:
        return []
    settled = _settled_level(*np.array([piece_scatter(piece, colour) for piece in pieces]).T)[1]
    return [piece for piece, kept in zip(pieces, settled, strict=True) if kept]


def innovation_scatter(pieces: list[Piece], colour: Colour) -> Scatter | None:
    """Gives the scatter of the innovations of coloured noise; None without windows.

    Args:
        pieces: Windows that hold noise alone.
        colour: The law of the noise.
    """
    return pooled_scatter([piece_scatter(piece, colour) for piece in pieces])


def pooled_scatter(scatters: Sequence[Scatter]) -> Scatter | None:
    """Gives the mean square over several; None without any."""
    freedom = sum(one.freedom for one in scatters)
    if not scatters:
        return None
    return Scatter(sum(one.square * one.freedom for one in scatters) / freedom, freedom)


def _noise_pieces(record: Record, method: str) -> list[Piece]:
    """Gives what the windows of a record leave without what repeats."""
    if method == "periods":
        rows = _settled_periods(record)
        return [
            Piece(Rest(row, np.zeros(0), np.zeros(row.size // 2 + 1)), 1.0 - 1.0 / len(rows))
            for row in rows - np.mean(rows, axis=0)
        ]
    dwells = record.dwells if method == "cycle_scatter" else ()
    return [piece for dwell in dwells if (piece := _dwell_piece(record, dwell))]


def _dwell_piece(record: Record, dwell: Dwell) -> Piece | None:
    """Gives what the end of a dwell leaves; None if it is too short."""
    window = dwell_window(record, dwell)
    if window is None:
        return None
    piece = Piece(dwell_rest(record, dwell, window, tuple(line.frequency for line in hum_lines(record))))
    return None if piece.freedom < piece.rest.taken.size else piece


def piece_scatter(piece: Piece, colour: Colour | None = None) -> Scatter:
    """Gives the scatter of a window's noise, or of its innovations where its law is known."""
    if colour is not None:
        return Scatter(*whitened_square(piece, colour))
    return Scatter(float(piece.rest.signal @ piece.rest.signal) / piece.freedom, piece.freedom)
