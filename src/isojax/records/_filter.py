"""Zero-phase Butterworth low-pass."""

import numpy as np
import scipy.signal
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
    sections = scipy.signal.butter(order, cutoff_hz, fs=rate, output="sos")
    settling = round(2.0 * order * rate / cutoff_hz)
    if signal.size < 4 * order + 8:
        raise ValueError(
            f"Argument `signal` must have at least {4 * order + 8} samples, but has {signal.size}."
        )
    return scipy.signal.sosfiltfilt(sections, signal, padlen=min(settling, signal.size - 1))
