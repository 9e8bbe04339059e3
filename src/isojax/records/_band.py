"""The band that a record excites, and the floor of its output's spectrum."""

from dataclasses import dataclass
from typing import cast
from weakref import WeakKeyDictionary

import numpy as np
import scipy.signal
from jaxtyping import Float
from scipy.fft import next_fast_len

from ._record import Record


@dataclass(frozen=True)
class Band:
    """Where a record's signal is.

    Attributes:
        lowest: Half of the lowest excited frequency [Hz], at least two per record.
        highest: Frequency above which the output is noise [Hz].
    """

    lowest: float
    highest: float


_KNOWN: WeakKeyDictionary[Record, Band] = WeakKeyDictionary()
"""Bands already worked out: a fit asks for each several times."""


def power_spectrum(
    signal: Float[np.ndarray, " time"], rate: float, averages: int = 8
) -> tuple[Float[np.ndarray, " frequency"], Float[np.ndarray, " frequency"]]:
    """Gives frequencies [Hz] and the one-sided power spectral density, averaged over half-overlapping Hann
    segments.

    The window is a four-term Blackman-Harris: its side lobes, below -92 dB, do not lift the floor.
    """
    wanted = max(64, 2 * signal.size // (averages + 1))
    segment = min(signal.size, cast(int, next_fast_len(wanted, real=True)))
    frequency, density = scipy.signal.welch(
        signal - np.mean(signal), rate, window="blackmanharris", nperseg=segment, detrend="linear"
    )
    return frequency, density


def spectral_floor(signal: Float[np.ndarray, " time"], rate: float, above: float, below: float) -> float:
    """Gives the median power density of a signal between two frequencies, corrected to a mean.

    Args:
        signal: Samples, (time,).
        rate: Samples per second [Hz].
        above: Lower end [Hz].
        below: Upper end [Hz].

    Returns:
        Power per Hz; NaN where fewer than 8 lines lie between.
    """
    averages = 15
    frequency, density = power_spectrum(signal, rate, averages)
    inside = (frequency > above) & (frequency < below)
    if np.count_nonzero(inside) < 8:
        return float("nan")
    # median of a chi-square over its mean, at the degrees of freedom of overlapping segments
    freedom = 2.0 * averages * 0.9
    return float(np.median(density[inside])) / (1.0 - 2.0 / (9.0 * freedom)) ** 3


def excited_band(record: Record) -> Band:
    """Gives the band in which a record's signal stands above its noise.

    Args:
        record: The record.

    Returns:
        The band.
    """
    if record not in _KNOWN:
        _KNOWN[record] = _find_band(record)
    return _KNOWN[record]


def _find_band(record: Record) -> Band:
    nyquist = 0.5 * record.rate
    slowest = 2.0 * record.rate / record.time.size
    frequency, output = power_spectrum(record.output, record.rate)
    floor = float(np.quantile(output[frequency > 0.0], 0.1))
    above = frequency[output > 30.0 * max(floor, 1e-300)]
    highest = min(1.25 * float(above[-1]) if above.size else nyquist, 0.8 * nyquist)
    if record.dwells:
        lowest = 0.5 * min(dwell.frequency for dwell in record.dwells)
    else:
        driven = record.output if not np.any(record.input) else record.input
        frequency, power = power_spectrum(driven, record.rate)
        share = np.cumsum(power) / np.sum(power)
        lowest = 0.5 * float(frequency[np.searchsorted(share, 1e-3)])
    lowest = min(max(lowest, slowest), 0.5 * nyquist)
    return Band(lowest, max(highest, 1.5 * lowest))
