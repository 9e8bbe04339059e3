"""The period of a periodic excitation, from its samples alone."""

from typing import cast

import numpy as np
import scipy
from jaxtyping import Float

_SHORTEST_PERIOD = 16
"""Samples below which a repetition is a sine rather than a period."""

_REPEATS = 0.9
"""Correlation of a signal with itself, a period later, below which it is not periodic."""

_AS_GOOD = 1.5
"""A shorter lag counts where its correlation misses 1 by no more than so many times that of the best."""


def find_period(signal: Float[np.ndarray, " time"]) -> int | None:
    """Gives the samples of a period of a signal that repeats itself at least twice, or None.

    The correlation of the signal with itself is normalised at each lag by the power of the parts that
    overlap. The shortest lag that is as good as the best is the period.

    Args:
        signal: Samples, (time,).

    Returns:
        Samples in a period; at most half the signal.
    """
    centred = signal - np.mean(signal)
    size = centred.size
    if size < 2 * _SHORTEST_PERIOD or not np.any(centred):
        return None
    length = cast(int, scipy.fft.next_fast_len(2 * size, real=True))
    spectrum = np.abs(np.fft.rfft(centred, length)) ** 2
    lags = np.arange(size // 2 + 1)
    product = np.fft.irfft(spectrum, length)[: lags.size]
    power = np.concatenate([[0.0], np.cumsum(centred**2)])
    early, late = power[size - lags], power[size] - power[lags]
    correlation = product / np.sqrt(np.maximum(early * late, 1e-300))
    away = np.flatnonzero(correlation < 0.5)
    if not away.size:
        return None
    first = max(int(away[0]), _SHORTEST_PERIOD)
    if first >= lags.size:
        return None
    best = float(np.max(correlation[first:]))
    if best < _REPEATS:
        return None
    least = 1.0 - _AS_GOOD * (1.0 - best) - 1e-9
    good = first + np.flatnonzero(correlation[first:] >= least)
    run = good[: int(np.argmax(np.diff(good) > 1)) + 1] if np.any(np.diff(good) > 1) else good
    return int(run[np.argmax(correlation[run])])
