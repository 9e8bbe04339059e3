"""Where the squared error of free runs lies that a model leaves: in motion, and in frequency."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from scipy.signal import periodogram

from ..._quantities import typeset_share
from ..fitting import Run

_STRETCHES = 30
"""Stretches of a record, whose motions are compared."""

_APART = 1.5
"""Ratio of relative errors from which the size of the motion matters."""


def remaining_words(runs: Sequence[Run]) -> str:
    """Say at which size of the motion the error is largest, and in which band half of it lies.

    Args:
        runs: free runs of the records that were fitted.

    Returns:
        A sentence; "" where there is no error, or a run diverged.
    """
    fitted = [run for run in runs if run.record.role == "fit" and np.any(run.residual)]
    if not fitted or not all(np.all(np.isfinite(run.residual)) for run in fitted):
        return ""
    low, high = _half_of(fitted)
    band = f"Half of the square of what is left lies from {low:.3g} to {high:.3g} Hz"
    sizes = np.concatenate(
        [_in_stretches(run.record.output - np.mean(run.record.output), run) for run in fitted]
    )
    errors = np.concatenate([_in_stretches(run.residual, run) for run in fitted])
    order = np.argsort(sizes)
    third = order.size // 3
    small, large = (
        float(np.sqrt(errors[part].sum() / max(sizes[part].sum(), 1e-300)))
        for part in (order[:third], order[-third:])
    )
    if max(small, large) < _APART * min(small, large):
        return f"{band}; it is as large a share of small motion as of large."
    return f"{band}; it is {typeset_share(small)} of small motion and {typeset_share(large)} of large."


def _in_stretches(signal: Float[np.ndarray, " time"], run: Run) -> Float[np.ndarray, " stretch"]:
    """Give the sum of squares in each stretch of a record, of samples that count."""
    counted = np.where(run.counted > 0.0, signal, 0.0)
    return np.array([np.sum(part**2) for part in np.array_split(counted, _STRETCHES)])


def _half_of(runs: Sequence[Run]) -> tuple[float, float]:
    """Give the shortest band that holds half of the squared error [Hz]."""
    spectra = [periodogram(run.residual - np.mean(run.residual), run.record.rate) for run in runs]
    frequency = np.concatenate([own for own, _ in spectra])
    power = np.concatenate(
        [own * run.record.output.size for (_, own), run in zip(spectra, runs, strict=True)]
    )
    order = np.argsort(frequency, kind="stable")
    frequency, power = frequency[order], power[order] / np.sum(power)
    share = np.cumsum(power)
    last = np.searchsorted(share, share - power + 0.5)
    first = np.flatnonzero(last < share.size)
    best = first[np.argmin(frequency[last[first]] - frequency[first])]
    return float(frequency[best]), float(frequency[last[best]])
