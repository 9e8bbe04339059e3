"""Linear frequency response of a record without dwells."""

import dataclasses

import numpy as np
from jaxtyping import Complex, Float
from scipy import signal

from ._circle_fit import CircleFit, fit_circle
from ._motion import Motion

_DRIVEN = 1e-3


@dataclasses.dataclass(frozen=True, eq=False)
class LinearResponse:
    """Best linear receptance of one record.

    Attributes:
        record: name of the record.
        frequency: lines [Hz].
        receptance: H1 estimate of displacement over force [m/N].
        coherence: share of the response that the drive explains linearly [1].
        circle: resonance and damping ratio, from the coherent lines; NaN where there is none.
    """

    record: str
    frequency: Float[np.ndarray, " frequency"]
    receptance: Complex[np.ndarray, " frequency"]
    coherence: Float[np.ndarray, " frequency"]
    circle: CircleFit


def linear_response(
    record: str,
    motion: Motion,
    force: Float[np.ndarray, " time"],
    rate: float,
    period: int | None = None,
    segments: int = 8,
    coherent: float = 0.8,
) -> LinearResponse:
    """Estimate the linear receptance of a record by Welch's method.

    H1 = S_FX/S_FF: noise in the response averages out of it, noise in the force does not. It is taken from
    the acceleration and divided by -omega^2, which keeps the drift of an integrated displacement out.

    Args:
        record: name of the record.
        motion: measured motion.
        force: measured force [N].
        rate: samples a second [Hz].
        period: samples a period of a periodic drive: one segment each, no window, hence no leakage; else
            None.
        segments: how many half-overlapping segments about fit into the record.
        coherent: lines with at least this coherence count for the resonance.

    Returns:
        Receptance, coherence, resonance.

    Source: P. D. Welch, IEEE Trans. Audio Electroacoust. 15 (1967) 70; Ewins, Modal Testing, 2nd ed., sec. 3.
    """
    if period is None:
        length = min(max(16, 2 * force.size // (segments + 1)), force.size)
        options = {"fs": rate, "nperseg": length}
    else:
        options = {"fs": rate, "nperseg": period, "noverlap": 0, "window": "boxcar"}
    frequency, cross = signal.csd(force, motion.acceleration, **options)
    _, drive = signal.welch(force, **options)
    _, response = signal.welch(motion.acceleration, **options)
    live = (frequency > 0) & (drive > _DRIVEN * np.max(drive))
    frequency, cross, drive, response = frequency[live], cross[live], drive[live], response[live]
    receptance = cross / drive / -((2 * np.pi * frequency) ** 2)
    tiny = np.finfo(float).tiny
    coherence = np.abs(cross) ** 2 / np.maximum(drive * response, tiny)
    good = coherence >= coherent
    circle = fit_circle(frequency[good], receptance[good])
    return LinearResponse(record, frequency, receptance, coherence, circle)
