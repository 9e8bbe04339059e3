"""Periodic orbits of a polynomial isolator by SciPy: DOP853 between kinks, variational equations, roots."""

import math
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import root

TOLERANCE = 1e-12
"""Relative tolerance of DOP853; the absolute one is this share of the size of each state."""


@dataclass(frozen=True)
class Law:
    """`m x'' + k1 x + q x^2 + k2 |x|x + k3 x^3 + c1 v + c2 |v|v + c3 v^3 + p x^2 v = F0 sin(2 pi f t)`.

    Attributes:
        k: k1, k2, k3 [N/m, N/m^2, N/m^3].
        c: c1, c2, c3 [N s/m, N s^2/m^2, N s^3/m^3].
        position: p [N s/m^3].
        mass: m [kg].
        even: q [N/m^2].
    """

    k: tuple[float, float, float] = (0.0, 0.0, 0.0)
    c: tuple[float, float, float] = (0.0, 0.0, 0.0)
    position: float = 0.0
    mass: float = 1.0
    even: float = 0.0


def flow(
    law: Law, amplitude: float, frequency: float, y0: np.ndarray, turns: float
) -> tuple[np.ndarray, np.ndarray, float]:
    """Carry a state on over some drive periods.

    The motion is cut where displacement or velocity changes sign, if the law has a kink there.

    Args:
        law: the isolator.
        amplitude: F0 [N].
        frequency: f [Hz].
        y0: displacement [m] and velocity [m/s] at t = 0.
        turns: drive periods.

    Returns:
        The state at the end, its derivative by `y0`, and the largest modulus of the displacement at start,
        cuts and end (over the whole motion, where the law has a kink in the velocity).
    """
    (k1, k2, k3), (c1, c2, c3), p, mass, q = law.k, law.c, law.position, law.mass, law.even
    omega = 2.0 * math.pi * frequency
    sides = [1.0 if value >= 0.0 else -1.0 for value in y0]

    def rates(t: float, y: np.ndarray) -> tuple[float, ...]:
        x, v, a, b, c, d = y.tolist()
        kx, kv = k2 * sides[0], c2 * sides[1]
        force = x * (k1 + x * (q + kx + x * k3)) + v * (c1 + v * (kv + v * c3) + p * x * x)
        by_x = k1 + x * (2.0 * (q + kx) + 3.0 * k3 * x) + 2.0 * p * x * v
        by_v = c1 + v * (2.0 * kv + 3.0 * c3 * v) + p * x * x
        push = (amplitude * math.sin(omega * t) - force) / mass
        return v, push, c, d, -(by_x * a + by_v * c) / mass, -(by_x * b + by_v * d) / mass

    def crossing(place: int):
        def event(t: float, y: np.ndarray) -> float:
            return sides[place] * y[place]

        event.terminal, event.direction = True, -1.0  # type: ignore[attr-defined]
        return event

    watched = [place for place, strength in enumerate((k2, c2)) if strength]
    events = [crossing(place) for place in watched]
    swing = max(math.hypot(y0[0], y0[1] / omega), 1e-12)
    atol = TOLERANCE * np.array([swing, swing * omega, 1.0, 1.0 / omega, omega, 1.0])
    end, time, y = turns / frequency, 0.0, np.array([*y0, 1.0, 0.0, 0.0, 1.0])
    largest = abs(float(y0[0]))
    while True:
        piece = solve_ivp(rates, (time, end), y, "DOP853", events=events or None, rtol=TOLERANCE, atol=atol)
        if not piece.success:
            raise RuntimeError(piece.message)
        time, y = piece.t[-1], piece.y[:, -1]
        largest = max(largest, abs(float(y[0])))
        if piece.status != 1:
            return y[:2], y[2:].reshape(2, 2), largest
        for place, times in zip(watched, piece.t_events, strict=True):
            sides[place] *= -1.0 if times.size else 1.0


def eigenvalues(matrix: np.ndarray) -> np.ndarray:
    """Give the eigenvalues in falling modulus.

    Args:
        matrix: square.

    Returns:
        Complex numbers.
    """
    values = np.linalg.eigvals(matrix).astype(complex)
    return values[np.argsort(-np.abs(values), kind="stable")]


def symmetric_orbit(law: Law, amplitude: float, frequency: float, start: np.ndarray) -> tuple[float, float]:
    """Find an orbit whose second half is minus the first, by Newton's method.

    Args:
        law: the isolator.
        amplitude: F0 [N].
        frequency: f [Hz].
        start: state at t = 0 to begin at.

    Returns:
        Largest modulus of the multipliers over the whole period, and amplitude [m].

    Raises:
        RuntimeError: if it does not close.
    """
    y0 = np.array(start, dtype=float)
    for _ in range(20):
        end, matrix, size = flow(law, amplitude, frequency, y0, 0.5)
        step = np.linalg.solve(matrix + np.eye(2), -(end + y0))
        y0 = y0 + step
        if np.max(np.abs(step) / [size, size * 2.0 * math.pi * frequency]) < 1e-11:
            _, matrix, size = flow(law, amplitude, frequency, y0, 0.5)
            return float(np.abs(eigenvalues(matrix)[0]) ** 2), size
    raise RuntimeError(f"the orbit at {amplitude} N, {frequency} Hz did not close")


def bifurcation(
    law: Law, frequency: float, start: np.ndarray, amplitude: float, turns: float, critical: float | None
) -> float:
    """Find the drive at which a periodic orbit bifurcates, by a root of three equations.

    The orbit closes (over half a period: onto minus itself), and the map's derivative has the multiplier
    `critical` (`det(M - critical I) = 0`) or, where that is None, a pair of product one (`det M = 1`).

    Args:
        law: the isolator.
        frequency: f [Hz].
        start: state at t = 0 to begin at.
        amplitude: F0 to begin at [N].
        turns: drive periods of the map; 0.5 for minus the state after half a period.
        critical: the multiplier.

    Returns:
        F0 [N].

    Raises:
        RuntimeError: if no root is found.
    """
    sign = -1.0 if turns == 0.5 else 1.0
    swing = math.hypot(start[0], start[1] / (2.0 * math.pi * frequency))
    scale = np.array([swing, swing * 2.0 * math.pi * frequency, amplitude])

    def equations(unknown: np.ndarray) -> np.ndarray:
        x, v, force = unknown * scale
        end, matrix, _ = flow(law, force, frequency, np.array([x, v]), turns)
        image = sign * matrix
        left = np.linalg.det(image) - 1.0 if critical is None else np.linalg.det(image - critical * np.eye(2))
        return np.array([*((sign * end - [x, v]) / scale[:2]), left])

    found = root(equations, np.array([*start, amplitude]) / scale, tol=1e-13, options={"eps": 1e-7})
    if np.max(np.abs(equations(found.x))) > 1e-8:
        raise RuntimeError(f"no bifurcation near {amplitude} N, {frequency} Hz: {found.message}")
    return float(found.x[2] * amplitude)


def largest_exponent(law: Law, amplitude: float, frequency: float, start: np.ndarray, periods: int) -> float:
    """Give the largest Lyapunov exponent, a disturbance brought back to size one after each period.

    Args:
        law: the isolator.
        amplitude: F0 [N].
        frequency: f [Hz].
        start: state at t = 0.
        periods: drive periods of the mean, after 50 that are left out.

    Returns:
        [1/s].
    """
    y, tangent, total = np.array(start, dtype=float), np.array([1.0, 0.0]), 0.0
    for period in range(50 + periods):
        y, matrix, _ = flow(law, amplitude, frequency, y, 1.0)
        tangent = matrix @ tangent
        size = float(np.hypot(*tangent))
        tangent /= size
        total += math.log(size) * (period >= 50)
    return total / periods * frequency
