"""Butterworth low-pass: applied without phase, and compensated where the test rig applied it."""

import numpy as np
import scipy
from jaxtyping import Float


def zero_phase_butterworth(
    signal: Float[np.ndarray, " time"], rate: float, order: int, cutoff_hz: float
) -> Float[np.ndarray, " time"]:
    """Gives a signal low-passed forwards and backwards, so that it keeps its phase.

    The gain is 1 / (1 + (f / cutoff)^(2 order)): the filter acts twice.

    Args:
        signal: Samples, (time,).
        rate: Samples per second [Hz].
        order: Order of the filter.
        cutoff_hz: Cut-off frequency [Hz], where the gain is 1/2.

    Returns:
        The filtered samples, (time,).

    Raises:
        ValueError: If the cut-off is not below half the rate, or the signal is too short for the filter.
    """
    if not 0.0 < cutoff_hz < 0.5 * rate:
        raise ValueError(
            f"Argument `cutoff_hz` must lie between 0 and half the rate, {0.5 * rate:g} Hz, but is "
            f"{cutoff_hz:g} Hz."
        )
    if order < 1:
        raise ValueError(f"Argument `order` must be at least 1, but is {order}.")
    sections = low_pass(order, cutoff_hz, rate)
    if signal.size < 4 * order + 8:
        raise ValueError(
            f"Argument `signal` must have at least {4 * order + 8} samples, but has {signal.size}."
        )
    settling = _settling(order, cutoff_hz, rate, signal.size)
    return scipy.signal.sosfiltfilt(sections, signal, padlen=settling)


def low_pass(order: int, cutoff_hz: float, rate: float) -> Float[np.ndarray, "section 6"]:
    """Gives the second-order sections of a digital Butterworth low-pass.

    Raises:
        ValueError: If rounding spoils it, as its poles crowd at 1 for a low cut-off: the gain must be 1 at 0
            and 1/sqrt(2) at the cut-off, and every pole lie within the unit circle.
    """
    sections = scipy.signal.butter(order, cutoff_hz, fs=rate, output="sos")
    with np.errstate(all="ignore"):
        _, gain = scipy.signal.sosfreqz(sections, np.array([0.0, cutoff_hz]), fs=rate)
    poles = np.abs(np.concatenate([np.roots(one[3:]) for one in sections]))
    if not np.all(poles < 1.0) or not np.all(np.abs(np.abs(gain) / [1.0, np.sqrt(0.5)] - 1.0) < _TRUE_GAIN):
        raise ValueError(
            f"Argument `cutoff_hz` must be above {cutoff_hz:g} Hz: a filter of order {order} at {rate:g} Hz "
            "with so low a cut-off cannot be computed."
        )
    return sections


_TRUE_GAIN = 1e-3
"""Relative error of a filter's gain that is accepted."""

LEAST_GAIN = 0.5
"""Gain of a filter below which it is compensated no further: compensation at most doubles the noise."""

FEWEST_UNSURE = 100
"""A filter with a cut-off near half the rate is short, but its inverse falls steeply there from 2 to 0."""


def unsure_samples(rate: float, order: int, cutoff_hz: float) -> int:
    """Gives the samples at either end of a record that depend on what lies beyond it.

    Further inside, the assumed continuation causes an error of at most 1e-3 of the signal with a cut-off up
    to 0.2 of the rate. With a cut-off close to half the rate it is at most 8e-3, near the cut-off.

    Args:
        rate: Samples per second [Hz].
        order: Order of the filter.
        cutoff_hz: Cut-off frequency [Hz].

    Returns:
        Four times order times rate over cut-off, and at least `FEWEST_UNSURE`.
    """
    return max(FEWEST_UNSURE, round(4.0 * order * rate / cutoff_hz))


def compensate_butterworth(
    signal: Float[np.ndarray, " time"], rate: float, order: int, cutoff_hz: float
) -> Float[np.ndarray, " time"]:
    """Gives a signal without the gain and the phase of a digital Butterworth low-pass that ran once.

    The receptance of a linear isolator does not change if force and response pass the same filter. A
    nonlinear one needs the force that acted, and harmonics of their true size.

    Args:
        signal: Samples, (time,).
        rate: Samples per second [Hz].
        order: Order of the filter.
        cutoff_hz: Cut-off frequency [Hz], where its power gain is 1/2.

    Returns:
        The samples before the filter, (time,), where its gain was above `LEAST_GAIN`; elsewhere only its
        phase is compensated. The first and last `unsure_samples` of them are not reliable.
    """
    sections = low_pass(order, cutoff_hz, rate)
    pad = _settling(order, cutoff_hz, rate, signal.size)
    longer = np.pad(signal, pad, mode="reflect", reflect_type="odd")
    # The transform assumes a periodic signal, so a bridge leads from its end back to its start.
    bridge = np.linspace(longer[-1], longer[0], 2 * pad + 2)[1:-1]
    whole = np.concatenate([longer, bridge])
    frequency = np.fft.rfftfreq(whole.size, 1.0 / rate)
    _, response = scipy.signal.sosfreqz(sections, frequency, fs=rate)
    inverse = np.conj(response) / np.maximum(np.abs(response) ** 2, LEAST_GAIN**2)
    return np.fft.irfft(np.fft.rfft(whole) * inverse, whole.size)[pad : pad + signal.size]


def _settling(order: int, cutoff_hz: float, rate: float, samples: int) -> int:
    """Gives the length of the filter's transient [samples], at most all but one of the signal."""
    return min(round(2.0 * order * rate / cutoff_hz), samples - 1)
