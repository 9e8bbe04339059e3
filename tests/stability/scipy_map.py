"""The map over a whole or half drive period by SciPy, with variational equations written out by hand.

Laws and equations stand here anew; nothing of isojax is used.
"""

from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_ivp

Law = Callable[[float, float], tuple[float, float, float]]
"""Displacement and velocity to force, and its derivatives by both."""


def polynomial_law(
    k1: float = 0.0, k2: float = 0.0, k3: float = 0.0, c1: float = 0.0, c2: float = 0.0, c3: float = 0.0
) -> Law:
    """Give k1 x + k2 |x|x + k3 x^3 + c1 v + c2 |v|v + c3 v^3."""

    def law(x: float, v: float) -> tuple[float, float, float]:
        force = k1 * x + k2 * abs(x) * x + k3 * x**3 + c1 * v + c2 * abs(v) * v + c3 * v**3
        return force, k1 + 2 * k2 * abs(x) + 3 * k3 * x**2, c1 + 2 * c2 * abs(v) + 3 * c3 * v**2

    return law


def paper_y_law() -> Law:
    """Give the y model of the paper, eqs. (13) and (18)."""
    return polynomial_law(1.0805e6, -6.974e8, 2.51667e11, 1.027e4, -3.6880e5, 5.3753e6)


def van_der_pol_law(strength: float) -> Law:
    """Give x - strength (1 - x^2) v."""

    def law(x: float, v: float) -> tuple[float, float, float]:
        return x - strength * (1 - x * x) * v, 1 + 2 * strength * x * v, -strength * (1 - x * x)

    return law


def after(
    law: Law, mass: float, amplitude: float, frequency: float, y0: np.ndarray, turns: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Give the state after `turns` periods, its derivative by the one before, and the states on the way."""
    omega = 2 * np.pi * frequency

    def rates(t: float, y: np.ndarray) -> list[float]:
        force, by_x, by_v = law(y[0], y[1])
        push = (amplitude * np.sin(omega * t) - force) / mass
        columns = [y[4], y[5], -(by_x * y[2] + by_v * y[4]) / mass, -(by_x * y[3] + by_v * y[5]) / mass]
        return [y[1], push, *columns]

    begin = np.concatenate([np.asarray(y0, dtype=float), [1.0, 0.0, 0.0, 1.0]])
    size = np.array([np.abs(y0).max() / omega, np.abs(y0).max(), 1.0, 1.0 / omega, omega, 1.0])
    # Steps far shorter than a period, so that the kinks of |x| and |v| cost little.
    done = solve_ivp(
        rates,
        (0.0, turns / frequency),
        begin,
        method="DOP853",
        rtol=1e-12,
        atol=1e-13 * size,
        max_step=1.0 / (200 * frequency),
    )
    return done.y[:2, -1], done.y[2:, -1].reshape(2, 2), done.y[:2]


def eigenvalues(matrix: np.ndarray) -> np.ndarray:
    """Give the eigenvalues in falling modulus."""
    values = np.linalg.eigvals(matrix).astype(complex)
    return values[np.argsort(-np.abs(values))]
