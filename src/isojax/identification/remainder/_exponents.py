"""How what is left grows with amplitude and frequency: the exponents that tell one force law from another."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.linalg import block_diag
from scipy.optimize import least_squares

from ._dwell_remainder import DwellRemainder

_ORDERS = 5
"""Harmonics that count."""

_FEWEST = 9
"""Dwells without which nothing is fitted."""

_SHAPE = 0.05
"""Error of a harmonic, over all of the dwell's, because the motion is no pure sine and its shape changes."""

_STANDS_OUT = 25.0
"""Drop of chi2, per max(chi2/dof, 1) and beyond one a coefficient, from which on a power is told at all."""

_VISIBLE = 0.03
"""Share of a direction of a law that the fitted coefficients must leave."""

_UNCERTAIN = 1.0
"""Standard error of the exponent of the amplitude from which on nothing is said."""

_LIKE = 3.0
"""Standard errors within which a known law may be the one."""

_DAMPING = {
    "viscous damping": (2.0, 1.0),
    "damping |v|v": (3.0, 2.0),
    "damping v^3": (4.0, 3.0),
    "damping x^2 v": (4.0, 1.0),
    "damping |x| v": (3.0, 1.0),
    "dry friction": (1.0, 0.0),
    "structural damping (friction that grows with |x|)": (2.0, 0.0),
    "friction that grows with x^2": (3.0, 0.0),
}
_SPRINGS = {
    "a spring": (2.0, 0.0),
    "spring |x|x or x^2": (3.0, 0.0),
    "spring x^3": (4.0, 0.0),
    "spring x^5": (6.0, 0.0),
    "spring x |v|": (3.0, 1.0),
    "spring x v^2": (4.0, 2.0),
    "a force v^2": (3.0, 2.0),
    "inertia": (2.0, 2.0),
}
"""Exponents (p, q) by law; of a spring those of the energy that it stores."""


class Exponents(NamedTuple):
    """How the energy of the latent force in a cycle grows with amplitude and angular frequency: X^p w^q.

    Attributes:
        amplitude: p; the force itself grows as X^(p - 1).
        amplitude_error: standard error of p.
        frequency: q.
        frequency_error: standard error of q.
        explained: share of the latent harmonics that such a law makes up, what the fitted coefficients may
            take over set aside [1].
        damping: share of them that work against the velocity, or would over a cycle of the other sign; the
            rest is spring-like [1].
        like: known laws of that kind within three standard errors, nearest first.
    """

    amplitude: float
    amplitude_error: float
    frequency: float
    frequency_error: float
    explained: float
    damping: float
    like: tuple[str, ...]


class _Equations(NamedTuple):
    target: Float[np.ndarray, " row"]
    base: Float[np.ndarray, "row column"]
    size: Float[np.ndarray, " dwell"]
    speed: Float[np.ndarray, " dwell"]
    weight: Float[np.ndarray, "dwell order"]

    def law(self, exponents: Float[np.ndarray, " 2"]) -> Float[np.ndarray, "row direction"]:
        """Give the directions of a law: each part of each harmonic with a strength of its own."""
        growth = self.size ** (exponents[0] - 1.0) * self.speed ** exponents[1]
        blocks = [growth[:, None] * weight[:, None] for weight in (*self.weight.T,) * 2]
        columns = np.asarray(block_diag(*blocks))
        norms = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
        # A law that the coefficients take over whole leaves dust, which would fit anything.
        vectors, values, _ = np.linalg.svd(_without(columns / norms, self.base), full_matrices=False)
        return vectors[:, values > _VISIBLE]


def _without(
    columns: Float[np.ndarray, "row column"], base: Float[np.ndarray, "row direction"]
) -> Float[np.ndarray, "row column"]:
    return columns - base @ (base.T @ columns)


def _basis(columns: Float[np.ndarray, "row column"]) -> Float[np.ndarray, "row direction"]:
    """Give an orthonormal basis of columns."""
    norms = np.linalg.norm(columns, axis=0)
    scaled = columns[:, norms > 0.0] / norms[norms > 0.0]
    vectors, values, _ = np.linalg.svd(scaled, full_matrices=False)
    return vectors[:, values > 1e-6 * np.max(values, initial=0.0)]


def _equations(dwells: list[DwellRemainder]) -> _Equations:
    """Lay out the harmonics of all dwells, part by part; one stiffness a record and the coefficients free."""
    size = [np.linalg.norm(one.harmonics[1:]) for one in dwells]
    error = np.array([one.error[1 : 1 + _ORDERS] for one in dwells])
    weight = 1.0 / np.hypot(error, _SHAPE * np.array(size)[:, None])

    def rows(values: np.ndarray) -> np.ndarray:
        # Dwell, harmonic -> all dwells of one part of one harmonic after the other.
        used = values[:, 1 : 1 + _ORDERS] * weight
        return np.concatenate([used.real.T.ravel(), used.imag.T.ravel()])

    target = rows(np.array([one.harmonics for one in dwells]))
    table = np.array([one.base_harmonics for one in dwells])
    columns = [rows(table[:, :, place]) for place in range(table.shape[2])]
    for name in sorted({one.record for one in dwells}):
        stiff = np.zeros((len(dwells), 1 + _ORDERS), dtype=complex)
        stiff[:, 1] = [one.amplitude if one.record == name else 0.0 for one in dwells]
        columns.append(rows(stiff))
    base = _basis(np.stack(columns, axis=1))
    size = np.array([one.amplitude for one in dwells])
    speed = np.array([one.frequency for one in dwells])
    left = _without(target[:, None], base)[:, 0]
    return _Equations(left, base, size / np.max(size), speed / np.mean(speed), weight)


def find_exponents(dwells: tuple[DwellRemainder, ...]) -> Exponents | None:
    """Find the powers of amplitude and frequency with which the latent force of the dwells grows.

    A law that is a power of x and of v makes harmonics of one shape, all of which grow as `X^(p-1) w^q`: the
    energy of the first as `X^p w^q`. All harmonics are fitted together, because the fitted coefficients take
    over most of the first; what they may have taken over is free beside the law.

    Args:
        dwells: what is left of them; only those of fitted records count.

    Returns:
        The exponents; None where there are too few dwells, no power stands out of the noise, or it is
        uncertain by more than one.

    Source: Golub & Pereyra 1973 (variable projection).
    """
    used = [one for one in dwells if one.role == "fit" and one.amplitude > 0.0]
    if len(used) < _FEWEST:
        return None
    given = _equations(used)

    def fitted(exponents: np.ndarray) -> np.ndarray:
        basis = given.law(exponents)
        return basis @ (basis.T @ given.target)

    def left(exponents: np.ndarray) -> np.ndarray:
        return given.target - fitted(exponents)

    grid = [np.array([p, q]) for p in np.arange(0.0, 6.1, 0.5) for q in np.arange(-2.0, 5.1, 0.5)]
    best = min(grid, key=lambda exponents: float(np.sum(left(exponents) ** 2)))
    found = least_squares(left, best, x_scale=0.1, bounds=([-2.0, -8.0], [9.0, 9.0]))
    whole, half = float(np.sum(given.target**2)), given.target.size // 2
    rows = 2 * np.count_nonzero(given.weight)
    freedom = max(1, rows - given.base.shape[1] - 2 * _ORDERS - 2)
    scatter = max(1.0, 2.0 * found.cost / freedom)
    if whole - 2.0 * found.cost < scatter * (_STANDS_OUT + 2 * _ORDERS):
        return None
    curvature = found.jac.T @ found.jac / scatter
    spread = np.sqrt(np.diag(np.linalg.pinv(curvature)))
    if spread[0] > _UNCERTAIN:
        return None
    made = fitted(found.x)
    damping = float(np.sum(made[half:] ** 2) / np.sum(made**2))
    distance = {
        name: float(np.sqrt((found.x - known) @ curvature @ (found.x - known)))
        for name, known in (_DAMPING if damping > 0.5 else _SPRINGS).items()
    }
    like = tuple(name for name in sorted(distance, key=lambda name: distance[name]) if distance[name] < _LIKE)
    beyond = max(whole - (rows - given.base.shape[1]), whole - 2.0 * found.cost)
    return Exponents(
        float(found.x[0]),
        float(spread[0]),
        float(found.x[1]),
        float(spread[1]),
        float((whole - 2.0 * found.cost) / beyond),
        damping,
        like,
    )
