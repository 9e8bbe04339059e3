"""A first guess of the mass: force over acceleration is the mass less the stiffness over w^2."""

import numpy as np
import scipy
from jaxtyping import Float

from .._campaign import TIME_DERIVATIVES, OutputQuantity

_EXCITED = 1e-3
"""Share of the largest power densities of drive and acceleration above which a line counts."""


def guess_mass(
    force: Float[np.ndarray, " time"],
    response: Float[np.ndarray, " time"],
    rate: float,
    quantity: OutputQuantity,
) -> float | None:
    """Gives the mass [kg] of `Re(F/A) = m - k/w^2`, fitted over the excited lines, or None.

    Args:
        force: [N], (time,).
        response: In SI, (time,).
        rate: Samples per second [Hz].
        quantity: What the response measures.

    Returns:
        The mass, or None where the fit gives none above 0. Of a nonlinear isolator it is a rough value.
    """
    segment = min(force.size, max(256, force.size // 8))
    options = {"fs": rate, "nperseg": segment, "window": "hann"}
    frequency, cross = scipy.signal.csd(response - np.mean(response), force - np.mean(force), **options)
    answer = scipy.signal.welch(response - np.mean(response), **options)[1]
    drive = scipy.signal.welch(force - np.mean(force), **options)[1]
    power = TIME_DERIVATIVES["acceleration"] - TIME_DERIVATIVES[quantity]
    moved = answer * (2.0 * np.pi * frequency) ** (2 * power)
    lines = (frequency > 0.0) & (drive > _EXCITED * np.max(drive)) & (moved > _EXCITED * np.max(moved))
    if np.count_nonzero(lines) < 3:
        return None
    angular = 2.0 * np.pi * frequency[lines]
    ratio = np.real(cross[lines] / answer[lines] / (1j * angular) ** power)
    coherence = np.abs(cross[lines]) ** 2 / (answer[lines] * drive[lines])
    weight = coherence * np.sqrt(moved[lines])
    columns = np.stack([np.ones_like(angular), -1.0 / angular**2], axis=1) * weight[:, None]
    mass, stiffness = np.linalg.lstsq(columns, ratio * weight, rcond=None)[0]
    return float(mass) if mass > 0.0 and stiffness > 0.0 and np.isfinite(mass) else None
