"""Damping ratio from the Nyquist circle of the mobility: the alternative to half power in the paper."""

import dataclasses

import numpy as np
from jaxtyping import Complex, Float

from ..._show import shown


@shown
@dataclasses.dataclass(frozen=True)
class CircleFit:
    """Circle through the mobility of one resonance.

    Attributes:
        natural_frequency: undamped natural frequency [Hz]; NaN where no circle fits.
        damping_ratio: viscous damping ratio [1]; NaN where no circle fits.
        diameter: of the circle, 1/C_eq where the mode stands alone [m/(N s)].
        scatter: rms distance of the points from the circle, as a share of its radius.
        lines: how many lines were used.
    """

    natural_frequency: float
    damping_ratio: float
    diameter: float
    scatter: float
    lines: int


_FEWEST_POINTS = 4
"""Lines of large mobility without which no circle is fitted."""

_FEWEST_NEAR = 3
"""Lines near the resonance without which it has no damping ratio."""

_NEAR_RESONANCE = 2.5
"""Angle from the diameter up to which a line is near the resonance [rad]: beyond, noise dominates it."""

_NO_CIRCLE = CircleFit(float("nan"), float("nan"), float("nan"), float("nan"), 0)


def fit_circle(
    frequency: Float[np.ndarray, " frequency"],
    receptance: Complex[np.ndarray, " frequency"],
    share: float = 0.5,
) -> CircleFit:
    """Fit the Nyquist circle of the mobility `i omega X/F` of one resonance.

    A viscously damped mode draws a circle of diameter 1/c through the origin. With theta the angle from the
    diameter, `omega tan(theta/2) = (omega^2 - omega_r^2)/(2 zeta omega_r)`: a straight line against omega^2
    gives both unknowns.

    Args:
        frequency: lines, increasing [Hz].
        receptance: displacement over force [m/N].
        share: lines with at least this share of the largest mobility are used.

    Returns:
        The circle with its resonance; NaN with fewer than four lines or where the points lie on no circle.

    Source: D. J. Ewins, Modal Testing, 2nd ed., sec. 4.3 (circle-fit method); named before eq. (9) of the
    paper.
    """
    if frequency.size < _FEWEST_POINTS:
        return _NO_CIRCLE
    omega = 2 * np.pi * frequency
    mobility = 1j * omega * receptance
    chosen = np.abs(mobility) >= share * np.max(np.abs(mobility))
    if np.count_nonzero(chosen) < _FEWEST_POINTS:
        return _NO_CIRCLE
    omega, mobility = omega[chosen], mobility[chosen]
    unit = float(np.max(np.abs(mobility)))
    x, y = mobility.real / unit, mobility.imag / unit
    design = np.stack([x, y, np.ones_like(x)], axis=1)
    (a, b, c), *_ = np.linalg.lstsq(design, x**2 + y**2, rcond=None)
    centre, radius = complex(a, b) / 2, float(np.sqrt(max(c + (a * a + b * b) / 4, 0.0)))
    if radius == 0 or centre == 0:
        return _NO_CIRCLE
    spokes = (x + 1j * y) - centre
    theta = -np.angle(spokes / (centre / abs(centre)))
    near = np.abs(theta) < _NEAR_RESONANCE
    if np.count_nonzero(near) < _FEWEST_NEAR:
        return _NO_CIRCLE
    # The half tangent grows without bound away from resonance: its derivative there weights each line.
    weight = np.cos(theta[near] / 2) ** 2
    line = np.stack([omega[near] ** 2, np.ones(np.count_nonzero(near))], axis=1)
    scale = np.array([np.mean(line[:, 0]), 1.0])
    left = line / scale * weight[:, None]
    (slope, level), *_ = np.linalg.lstsq(left, omega[near] * np.tan(theta[near] / 2) * weight, rcond=None)
    slope = slope / scale[0]
    if not (slope > 0 and level < 0):
        return _NO_CIRCLE
    natural = float(np.sqrt(-level / slope))
    return CircleFit(
        natural_frequency=natural / (2 * np.pi),
        damping_ratio=float(1.0 / (2.0 * slope * natural)),
        diameter=2.0 * radius * unit,
        scatter=float(np.sqrt(np.mean((np.abs(spokes) / radius - 1.0) ** 2))),
        lines=int(np.count_nonzero(chosen)),
    )
