"""Start from records without dwells: the force balance in time, summarised by its low-frequency lines."""

import numpy as np
from jaxtyping import Float
from scipy.signal.windows import tukey

from ...models import Isolator
from ._force_balance import BalanceFit, BalanceProjection, fit_balance
from ._motion import Motion

_DERIVATIVES = {"displacement": 2, "velocity": 1, "acceleration": 0}


def line_projection(
    size: int,
    rate: float,
    lowest: float,
    highest: float,
    derivatives: int,
    centre: float,
    margin: int = 0,
) -> BalanceProjection:
    """Give the projection on the Fourier lines of a band, which low-passes without a phase.

    A smooth window takes the ends of the record out, where derivatives and integrals are not to be trusted.
    Lines above `centre` are weighed down as the noise of a differentiated response rises.

    Args:
        size: samples of the record.
        rate: samples a second [Hz].
        lowest: lower end of the band [Hz]; zero keeps the mean.
        highest: upper end of the band [Hz].
        derivatives: how often the response was differentiated to give the acceleration.
        centre: centre of the band [Hz].
        margin: samples at each end to take out altogether.

    Returns:
        The projection.
    """
    window = np.pad(tukey(size - 2 * margin, 0.1), margin)
    frequency = np.fft.rfftfreq(size, 1.0 / rate)
    kept = (frequency >= lowest) & (frequency <= highest)
    weight = 1.0 / (1.0 + (frequency[kept] / centre) ** derivatives) / np.sqrt(size)

    def project(force: Float[np.ndarray, " time"]) -> Float[np.ndarray, " row"]:
        lines = np.fft.rfft(force * window)[kept] * weight
        return np.concatenate([lines.real, lines.imag])

    return project


def fit_restoring_force(
    model: Isolator,
    names: tuple[str, ...],
    motions: tuple[Motion, ...],
    centres: tuple[float, ...],
    rate: float,
    quantity: str,
    offset_free: bool = False,
    mass_free: bool = False,
) -> BalanceFit:
    """Fit the coefficients to the force balance in time, low-passed.

    Args:
        model: the structure; its present strengths do not matter.
        names: catalogue names of the elements to fit.
        motions: measured motion and drive of the records.
        centres: centre of the excited band of each [Hz].
        rate: samples a second [Hz].
        quantity: what the output measures.
        offset_free: whether an offset may take up the mean force, which then counts where a displacement was
            measured; else only what lies above the lowest excited frequency counts.
        mass_free: whether the mass is unknown too.

    Returns:
        The model found.

    Source: Masri & Caughey 1979; the same filter on force and on every column keeps the balance exact (A.
    Janot, P.-O. Vandanjon and M. Gautier, A generic instrumental variable approach for industrial robot
    identification, IEEE Trans. Control Syst. Technol. 22 (2014) 132).
    """
    keeps_mean = offset_free and quantity == "displacement"
    projections = tuple(
        line_projection(
            motion.drive.size,
            rate,
            0.0 if keeps_mean else motion.band.lowest,
            motion.band.highest,
            _DERIVATIVES[quantity],
            centre,
            motion.margin,
        )
        for motion, centre in zip(motions, centres, strict=True)
    )
    return fit_balance(model, names, motions, projections, mass_free)
