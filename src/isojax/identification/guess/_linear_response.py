"""Linear frequency response of a record without dwells."""

import dataclasses

import numpy as np
from jaxtyping import Complex, Float
from scipy import signal

from ..._show import shown
from ...records import Record, excited_band
from ._circle_fit import CircleFit, fit_circle
from ._motion import Motion

_DRIVEN = 1e-3
"""Power density of the drive, over its largest, below which a line is not driven: nor is one outside of the
excited band, where the means of segments leak into the first lines."""


@shown
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
    record: Record,
    motion: Motion,
    force: Float[np.ndarray, " time"],
    segments: int = 8,
    coherent: float = 0.8,
) -> LinearResponse:
    """Estimate the linear receptance of a record by Welch's method.

    H1 = S_FX/S_FF: noise in the response averages out, noise in the force does not. It comes from the
    acceleration, divided by -omega^2, which avoids the drift of an integrated displacement. Noise grows
    without bound where nothing is driven: there are no lines there.

    Args:
        record: the record; of a periodic drive each period is one segment without a window, hence without
            leakage.
        motion: its measured motion.
        force: its measured force [N].
        segments: how many half-overlapping segments about fit into another record.
        coherent: lines with at least this coherence count for the resonance.

    Returns:
        Receptance, coherence, resonance.

    Source: P. D. Welch, IEEE Trans. Audio Electroacoust. 15 (1967) 70; Ewins, Modal Testing, 2nd ed., sec. 3.
    """
    if record.period is None:
        length = min(max(16, 2 * force.size // (segments + 1)), force.size)
        options = {"fs": record.rate, "nperseg": length}
    else:
        options = {"fs": record.rate, "nperseg": record.period, "noverlap": 0, "window": "boxcar"}
    frequency, cross = signal.csd(force, motion.acceleration, **options)
    _, drive = signal.welch(force, **options)
    _, response = signal.welch(motion.acceleration, **options)
    band = excited_band(record)
    live = (frequency >= band.lowest) & (frequency <= band.highest) & (drive > _DRIVEN * np.max(drive))
    frequency, cross, drive, response = frequency[live], cross[live], drive[live], response[live]
    receptance = cross / drive / -((2 * np.pi * frequency) ** 2)
    tiny = np.finfo(float).tiny
    coherence = np.abs(cross) ** 2 / np.maximum(drive * response, tiny)
    good = coherence >= coherent
    circle = fit_circle(frequency[good], receptance[good])
    return LinearResponse(record.name, frequency, receptance, coherence, circle)
