"""A resonance peak in the scatter from cycle to cycle: the isolator answers what nobody measured."""

import functools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import cast

import numpy as np
from jaxtyping import Float

from .._campaign import Campaign
from .._record import Record
from ..spectrum import NoiseBand, harmonic_basis

_LINES = 48
_ORDERS = 120
_QUIET = 0.35
"""Share of the noise band above which the level of white noise is read."""

_KEPT = 0.3
"""Share of a line that must stand beside the harmonics of the drive, else a dwell does not show it."""

_FEWEST = 4
_CLEAR = 3.0
_ERRORS = 5.0
_DECAYED = 0.5
"""A peak that falls to less between the third and the last quarter of the dwells is a transient."""

_MEDIAN = float(np.log(2.0))
"""Median of a periodogram's line over its mean."""

_Lines = Float[np.ndarray, " line"]
_Piece = tuple[Float[np.ndarray, " _"], float]
"""What was measured in a stretch, and the frequency whose harmonics do not count in it, or 0 [Hz]."""


@dataclass(frozen=True)
class NoisePeak:
    """A peak in the spectrum of what does not repeat from cycle to cycle.

    Attributes:
        frequency: Of the peak [Hz].
        height: Its power density over that of the noise at high frequency.
        rms: Of the motion in the peak, without the noise under it [SI unit of the output].
    """

    frequency: float
    height: float
    rms: float


def noise_peak(campaign: Campaign) -> NoisePeak | None:
    """Gives the resonance peak, if clear, of the scatter about harmonics of dwells or between periods.

    White noise has none. The power density at each frequency is the median over dwells; near a harmonic of
    the drive a dwell does not count. A clear peak stands three times above the level at high frequency and
    five standard errors above chance, twice above the densities at half and less and at twice and more of its
    frequency, and does not die out within the dwells.

    Args:
        campaign: The campaign.

    Returns:
        The peak, or None: there is no clear one, or too few dwells or periods to tell.

    Source: the scatter is coloured by the transmissibility of what shakes the isolator unseen; medians of
        periodograms, Percival & Walden 1993, sec. 6.
    """
    band = NoiseBand(campaign.rate, campaign.filter)
    late, early = ([*_pieces(campaign, last)] for last in (True, False))
    if len(late) < _FEWEST:
        return None
    longest = max(piece.size for piece, _ in late)
    lines = np.geomspace(campaign.rate / longest, 0.9 * band.highest, _LINES)
    density, count = _spectrum(late, lines, band)
    quiet = lines > _QUIET * band.highest
    if not np.any(np.isfinite(density[quiet])):
        return None
    level = float(np.nanmedian(density[quiet]))
    known = np.where(quiet | (count < max(_FEWEST, 0.25 * len(late))), np.nan, density)
    if level <= 0.0 or not np.any(np.isfinite(known)):
        return None
    top = int(np.nanargmax(known))
    height, frequency = float(known[top]) / level, float(lines[top])
    below, above = known[lines < 0.5 * frequency], density[lines > 2.0 * frequency]
    if not np.any(np.isfinite(below)) or height < 1.0 + max(
        _CLEAR - 1.0, _ERRORS / (_MEDIAN * np.sqrt(count[top]))
    ):
        return None
    if max(float(np.nanmedian(side)) for side in (below, above)) > 0.5 * known[top]:
        return None
    if float(_spectrum(early, lines, band)[0][top]) * _DECAYED > known[top]:
        return None
    near = (lines > 0.5 * frequency) & (lines < 2.0 * frequency) & np.isfinite(known)
    excess = np.maximum(density[near] - level, 0.0)
    power = np.trapezoid(excess, lines[near]) / (0.5 * campaign.rate)
    return NoisePeak(frequency, height, float(np.sqrt(power)))


def _pieces(campaign: Campaign, last: bool) -> Iterator[_Piece]:
    """Gives the last or third quarter of each dwell with its frequency, and how each period differs."""
    for record in campaign.records:
        for dwell in record.dwells:
            cycle = record.rate / dwell.frequency
            window = round(max(dwell.cycles / 4.0, 4.0) * cycle)
            stop = dwell.stop if last else dwell.stop - window
            if 2.2 * window < dwell.stop - dwell.start:
                yield record.output[stop - window : stop], dwell.frequency
        yield from ((period, 0.0) for period in _between_periods(record, last))


def _between_periods(record: Record, last: bool) -> list[Float[np.ndarray, " _"]]:
    """Gives the later or earlier half of the periods, less the mean of all but the first."""
    if record.period is None:
        return []
    count = (record.output.size - record.settle) // record.period
    periods = record.output[record.output.size - count * record.period :].reshape(count, record.period)[1:]
    if count < 3:
        return []
    rest = (periods - np.mean(periods, axis=0)) * np.sqrt((count - 1) / max(count - 2, 1))
    half = len(rest) // 2
    return list(rest[half:] if last else rest[:half])


def _spectrum(pieces: list[_Piece], lines: _Lines, band: NoiseBand) -> tuple[_Lines, _Lines]:
    """Gives the median power density at each line, as the mean square of white noise as strong, and of how
    many pieces.
    """
    powers = np.full((len(pieces), lines.size), np.nan)
    for row, (signal, frequency) in zip(powers, pieces, strict=True):
        columns = _columns(signal.size, band.rate, frequency, band.highest, tuple(lines.tolist()))
        projected = np.einsum("lts,t->ls", columns, signal)
        row[:] = 0.5 * np.sum(projected**2, axis=1)
    count = np.sum(np.isfinite(powers), axis=0)
    middle = np.array(
        [
            np.median(column[np.isfinite(column)]) if n else np.nan
            for column, n in zip(powers.T, count, strict=True)
        ]
    )
    return middle / (_MEDIAN * band.power_gain(lines)), count.astype(float)


@functools.lru_cache(maxsize=64)
def _columns(
    size: int, rate: float, frequency: float, highest: float, lines: tuple[float, ...]
) -> Float[np.ndarray, "line time pair"]:
    """Gives two orthonormal signals a line, at right angles to the harmonics of the drive; NaN where little
    is left of the line beside them.
    """
    time = (np.arange(size) - 0.5 * (size - 1)) / rate
    design = np.ones((size, 1))
    if frequency:
        orders = min(_ORDERS, int(0.9 * highest / frequency), max(1, size // 8))
        basis = harmonic_basis(time, frequency, orders)
        design = np.concatenate([basis, (time / time[-1])[:, None] * basis[:, :3]], axis=1)
    known, _ = np.linalg.qr(design)
    found = np.full((len(lines), size, 2), np.nan)
    for place, line in enumerate(lines):
        pair = np.stack([np.cos(2 * np.pi * line * time), np.sin(2 * np.pi * line * time)], axis=1)
        pair -= known @ (known.T @ pair)
        basis, sizes, _ = np.linalg.svd(pair, full_matrices=False)
        if cast(float, sizes[-1]) ** 2 > _KEPT * 0.5 * size:
            found[place] = basis
    return found
