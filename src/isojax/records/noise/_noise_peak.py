"""A resonance peak in the scatter between cycles: the isolator responds to an unmeasured excitation."""

import functools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from ..._show import shown
from .._campaign import Campaign
from .._record import Record
from ..spectrum import MOST_HARMONICS, NoiseBand, harmonic_basis

_LINE_COUNT = 48
"""Frequencies, evenly spaced on a logarithmic scale, at which a peak is sought."""

_HIGHEST_LINE = 0.9
"""Share of the noise band up to which lines are sought and harmonics removed."""

_QUIET = 0.35
"""Share of the noise band above which the level of white noise is estimated."""

_OBSERVABLE = 0.3
"""Share of a line's power that the harmonics of the drive must leave, else the dwell does not count."""

_FEWEST_WINDOWS = 4
"""Dwells or periods without which no median is taken."""

_FEWEST_SHARE = 0.25
"""Share of all dwells or periods that must show a line."""

_CLEAR_HEIGHT = 3.0
"""Power density of a clear peak over the level of white noise."""

_CLEAR_ERRORS = 5.0
"""Standard errors of the median by which a clear peak exceeds that level."""

_FLANK = 0.5
"""A clear peak has at most this share of its density at half and at twice its frequency."""

_DECAYED = 0.5
"""A peak that falls below this share from the third to the last quarter of the dwells is a transient."""

_MEDIAN = float(np.log(2.0))
"""Median of a periodogram's line over its mean."""

_Lines = Float[np.ndarray, " line"]
_Window = tuple[Float[np.ndarray, " _"], float]
"""What was measured in a window, and the frequency whose harmonics do not count in it, or 0 [Hz]."""


@shown
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
    the drive a dwell does not count. A clear peak is three times the level at high frequency and five
    standard errors above it. It is twice the density at half its frequency and below, and at twice its
    frequency and above. It does not die out within the dwells.

    Args:
        campaign: The campaign.

    Returns:
        The peak, or None where there is no clear one or where dwells and periods are too few.

    Source: the scatter is coloured by the transmissibility of what shakes the isolator unseen; medians of
        periodograms, Percival & Walden 1993, sec. 6.
    """
    band = NoiseBand(campaign.rate, campaign.filter)
    late, early = ([*_windows(campaign, last)] for last in (True, False))
    if len(late) < _FEWEST_WINDOWS:
        return None
    longest = max(signal.size for signal, _ in late)
    lines = np.geomspace(campaign.rate / longest, _HIGHEST_LINE * band.highest, _LINE_COUNT)
    density, count = _spectrum(late, lines, band)
    quiet = lines > _QUIET * band.highest
    if not np.any(np.isfinite(density[quiet])):
        return None
    level = float(np.nanmedian(density[quiet]))
    known = np.where(quiet | (count < max(_FEWEST_WINDOWS, _FEWEST_SHARE * len(late))), np.nan, density)
    if level <= 0.0 or not np.any(np.isfinite(known)):
        return None
    top = int(np.nanargmax(known))
    height, frequency = float(known[top]) / level, float(lines[top])
    below, above = known[lines < 0.5 * frequency], density[lines > 2.0 * frequency]
    if not np.any(np.isfinite(below)) or height < 1.0 + max(
        _CLEAR_HEIGHT - 1.0, _CLEAR_ERRORS / (_MEDIAN * np.sqrt(count[top]))
    ):
        return None
    if max(float(np.nanmedian(side)) for side in (below, above)) > _FLANK * known[top]:
        return None
    if float(_spectrum(early, lines, band)[0][top]) * _DECAYED > known[top]:
        return None
    near = (lines > 0.5 * frequency) & (lines < 2.0 * frequency) & np.isfinite(known)
    excess = np.maximum(density[near] - level, 0.0)
    power = np.trapezoid(excess, lines[near]) / (0.5 * campaign.rate)
    return NoisePeak(frequency, height, float(np.sqrt(power)))


def _windows(campaign: Campaign, last: bool) -> Iterator[_Window]:
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
    count, periods = len(record.periods), record.periods[1:]
    if count < 3:
        return []
    rest = (periods - np.mean(periods, axis=0)) * np.sqrt((count - 1) / max(count - 2, 1))
    half = len(rest) // 2
    return list(rest[half:] if last else rest[:half])


def _spectrum(windows: list[_Window], lines: _Lines, band: NoiseBand) -> tuple[_Lines, _Lines]:
    """Gives the median power density at each line, as the mean square of equally strong white noise, and the
    number of windows that it comes from.
    """
    powers = np.full((len(windows), lines.size), np.nan)
    for row, (signal, frequency) in zip(powers, windows, strict=True):
        bases = _line_bases(signal.size, band.rate, frequency, band.highest, tuple(lines.tolist()))
        projected = np.einsum("lts,t->ls", bases, signal)
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
def _line_bases(
    size: int, rate: float, frequency: float, highest: float, lines: tuple[float, ...]
) -> Float[np.ndarray, "line time pair"]:
    """Gives two orthonormal signals a line, orthogonal to the harmonics of the drive; NaN where these leave
    too little of the line.
    """
    time = (np.arange(size) - 0.5 * (size - 1)) / rate
    design = np.ones((size, 1))
    if frequency:
        orders = min(MOST_HARMONICS, int(_HIGHEST_LINE * highest / frequency), max(1, size // 8))
        basis = harmonic_basis(time, frequency, orders)
        design = np.concatenate([basis, (time / time[-1])[:, None] * basis[:, :3]], axis=1)
    known, _ = np.linalg.qr(design)  # a short window may not separate all harmonics
    phase = 2.0 * np.pi * np.outer(time, lines)
    columns = np.concatenate([np.cos(phase), np.sin(phase)], axis=1)
    columns -= known @ (known.T @ columns)
    pairs = np.stack([columns[:, : len(lines)].T, columns[:, len(lines) :].T], axis=2)
    # All pairs at once by their 2 x 2 products: those that are used are far from parallel.
    powers, turns = np.linalg.eigh(np.swapaxes(pairs, 1, 2) @ pairs)
    seen = powers[:, 0] > _OBSERVABLE * 0.5 * size
    found = np.full_like(pairs, np.nan)
    found[seen] = pairs[seen] @ (turns[seen] / np.sqrt(powers[seen])[:, None, :])
    return found
