"""The band that a record excites, and the floor of its output's spectrum."""

from dataclasses import dataclass
from typing import cast

import numpy as np
import scipy
from jaxtyping import Float

from ..._show import shown
from .._record import Record
from ._noise_band import NoiseBand

_AVERAGES = 15
"""Segments over which the spectrum of a floor is averaged; they overlap by half."""

_FEWEST_FLOOR_LINES = 8
"""Lines of a spectrum without which no floor is estimated."""

_NOISE_QUANTILE = 0.1
"""Quantile of the lines of an output's spectrum that is taken for its noise."""

_SIGNAL_TO_NOISE = 30.0
"""Power density over that noise above which a line belongs to the signal."""

_HEADROOM = 1.25
"""The band ends at this multiple of the highest such line ..."""

_HIGHEST_SIGNAL = 0.8
"""... but at this share of half the rate at most."""

_FIRST_POWER = 1e-3
"""Share of the drive's power that lies below its lowest excited frequency."""

_LAST_POWER = 1e-2
"""Share of it above the highest: a force channel has noise at every frequency."""


@shown
@dataclass(frozen=True)
class ExcitedBand:
    """The frequencies at which a record has a signal.

    Attributes:
        lowest: Half of the lowest excited frequency [Hz], at least two per record; of a motion that rings
            down a third of the frequency at which it rings, since a release or a blow excites all of them.
        highest: Frequency above which the output is noise [Hz].
    """

    lowest: float
    highest: float


def power_spectrum(
    signal: Float[np.ndarray, " time"], rate: float, averages: int = 8
) -> tuple[Float[np.ndarray, " frequency"], Float[np.ndarray, " frequency"]]:
    """Gives frequencies [Hz] and the one-sided power spectral density, averaged over half-overlapping Hann
    segments.

    The window is a four-term Blackman-Harris: its side lobes, below -92 dB, do not lift the floor.
    """
    wanted = max(64, 2 * signal.size // (averages + 1))
    segment = min(signal.size, cast(int, scipy.fft.next_fast_len(wanted, real=True)))
    frequency, density = scipy.signal.welch(
        signal - np.mean(signal), rate, window="blackmanharris", nperseg=segment, detrend="linear"
    )
    return frequency, density


def spectral_floor(
    signal: Float[np.ndarray, " time"], band: NoiseBand, *spans: tuple[float, float]
) -> tuple[float, float]:
    """Gives the power density of white noise that would leave the median floor of a signal's spectrum.

    The spectrum is divided by the gain of the filter that the noise has passed, and the median corrected to a
    mean by the chi-square distribution of averaged periodograms.

    Args:
        signal: Samples, (time,).
        band: The band that the noise fills.
        spans: Lower and upper ends [Hz]; the lines between any of them count.

    Returns:
        Power per Hz and its relative standard error; NaN with fewer than 8 lines.

    Source: Welch 1967 (degrees of freedom of overlapping segments).
    """
    frequency, density = power_spectrum(signal, band.rate, _AVERAGES)
    inside = np.any([(frequency > low) & (frequency < high) for low, high in spans], axis=0)
    lines = np.count_nonzero(inside)
    if lines < _FEWEST_FLOOR_LINES:
        return float("nan"), float("nan")
    freedom, alike = _freedom(signal.size, 2 * (frequency.size - 1))
    level = np.median(density[inside] / band.power_gain(frequency[inside]))
    error = np.sqrt(0.5 * np.pi * (2.0 / freedom) * alike / lines)
    return float(level * freedom / scipy.stats.chi2.ppf(0.5, freedom)), float(error)


def _freedom(size: int, segment: int) -> tuple[float, float]:
    """Gives the degrees of freedom of a line of the averaged spectrum, and how many lines are as good as one.

    Both follow from the window: segments that overlap by half share some noise, and so do neighbouring lines.
    """
    window = np.asarray(scipy.signal.get_window("blackmanharris", segment), dtype=np.float64)
    half = segment // 2
    count = max(1, (size - half) // (segment - half))
    power = float(np.sum(window**2))
    shared = float(np.sum(window[half:] * window[: segment - half])) / power
    freedom = 2.0 * count / (1.0 + 2.0 * shared**2 * (1.0 - 1.0 / count))
    return freedom, segment * float(np.sum(window**4)) / power**2


def ringing_frequency(signal: Float[np.ndarray, " time"], rate: float) -> float:
    """Gives the frequency of the strongest line of a signal's spectrum [Hz]."""
    frequency, power = power_spectrum(signal, rate)
    return float(frequency[1 + np.argmax(power[1:])])


def excited_band(record: Record) -> ExcitedBand:
    """Gives the band in which a record's signal stands above its noise.

    Args:
        record: The record.

    Returns:
        The band.
    """
    return record.once("excited band", lambda: _find_band(record))


def _find_band(record: Record) -> ExcitedBand:
    nyquist = 0.5 * record.rate
    slowest = 2.0 * record.rate / record.time.size
    frequency, output = power_spectrum(record.output, record.rate)
    floor = float(np.quantile(output[frequency > 0.0], _NOISE_QUANTILE))
    above = frequency[output > _SIGNAL_TO_NOISE * max(floor, 1e-300)]
    highest = min(_HEADROOM * float(above[-1]) if above.size else nyquist, _HIGHEST_SIGNAL * nyquist)
    first = driven_range(record)[0]
    lowest = first / 3.0 if record.rings_down else 0.5 * first
    lowest = min(max(lowest, slowest), 0.5 * nyquist)
    return ExcitedBand(lowest, max(highest, 1.5 * lowest))


def driven_range(record: Record) -> tuple[float, float]:
    """Gives the lowest and the highest frequency of a record's drive, or of a released mass's motion [Hz].

    Args:
        record: The record.

    Returns:
        Both; a thousandth of the drive's power lies below the first, a hundredth above the second.
    """
    return record.once("driven range", lambda: _find_range(record))


def _find_range(record: Record) -> tuple[float, float]:
    if record.dwells:
        excited = [dwell.frequency for dwell in record.dwells]
        return min(excited), max(excited)
    moving = record.output if not np.any(record.input) else record.input
    frequency, power = power_spectrum(moving, record.rate)
    share = np.cumsum(power) / np.sum(power)
    first, last = frequency[np.searchsorted(share, [_FIRST_POWER, 1.0 - _LAST_POWER])]
    # A release or a blow excites all frequencies from zero on.
    lowest = ringing_frequency(record.output, record.rate) if record.rings_down else first
    return float(lowest), float(last)
