"""Periodic orbits by SciPy, with no code of isojax: DOP853 between kinks, variational equations, Newton.

A law here is a function of the state and of the sides of its kinks, analytic on each side, so that a complex
step gives its derivatives to the last digit.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.integrate import solve_ivp

STEP = 1e-30
"""Imaginary step of the derivatives."""


@dataclass(frozen=True)
class Law:
    """Forces on the mass, as functions of the states `z = (x, v, internal...)` and the sides of the kinks.

    Attributes:
        force: f(z, sides) [N].
        internal: rates of the internal states, (z, sides) -> list.
        kinks: (z) -> list, whose signs are the sides.
        mass: [kg].
        delay: of the drive [s].
        offset: added to the drive [N].
        harmonics: of the drive: share, phase [rad] and order of each.
        states: count of states.
    """

    force: Callable
    kinks: Callable = lambda z: []
    internal: Callable = lambda z, sides: []
    mass: float = 800.0
    delay: float = 0.0
    offset: float = 0.0
    harmonics: tuple = ()
    states: int = 2

    def rates(self, t, z, sides, amplitude, frequency):
        """Time derivative of the states; columns of `z` are taken together."""
        turn = 2.0 * np.pi * frequency * (t - self.delay)
        drive = amplitude * np.sin(turn) + self.offset
        for share, phase, order in self.harmonics:
            drive = drive + share * amplitude * np.cos(order * (turn - 0.5 * np.pi) + phase)
        return np.stack([z[1], (drive - self.force(z, sides)) / self.mass, *self.internal(z, sides)])


def polynomial(k=(0.0, 0.0, 0.0), c=(0.0, 0.0, 0.0), mass=800.0, position=0.0, **other) -> Law:
    """`k1 x + k2 |x|x + k3 x^3 + c1 v + c2 |v|v + c3 v^3 + position x^2 v`."""

    def force(z, sides):
        x, v = z[:2]
        spring = k[0] * x + k[1] * sides[0] * x**2 + k[2] * x**3
        return spring + c[0] * v + c[1] * sides[1] * v**2 + c[2] * v**3 + position * x**2 * v

    return Law(force, kinks=lambda z: [z[0], z[1]], mass=mass, **other)


Y_DIRECTION = {"k": (1.0805e6, -6.974e8, 2.51667e11), "c": (1.027e4, -3.6880e5, 5.3753e6)}
Z_DIRECTION = {"k": (1.414e5, -4.126e5, -4.289e6), "c": (2638.0, -1393.0, 745.533)}
EQ_36 = {"k": Y_DIRECTION["k"], "c": (1.027e4, -3.6880e3, 0.0)}
"""The paper's eqs. (13), (18), (23), (28), (36), typed in anew."""


@dataclass(frozen=True)
class Reference:
    """A periodic orbit.

    Attributes:
        y0: state at t = 0.
        monodromy: derivative of the state after the period by that before.
        pieces: dense solutions and the times at which they meet.
    """

    y0: np.ndarray
    monodromy: np.ndarray
    pieces: list = field(repr=False)

    @property
    def multipliers(self) -> np.ndarray:
        """In falling modulus."""
        values = np.linalg.eigvals(self.monodromy)
        return values[np.argsort(-np.abs(values), kind="stable")]

    @property
    def spectral_radius(self) -> float:
        """Largest modulus."""
        return float(np.max(np.abs(self.multipliers)))

    @property
    def amplitude(self) -> float:
        """Half the peak-to-peak displacement: at every extreme a piece ends, since v is a kink of the law."""
        ends = np.array([piece.y[0, [0, -1]] for piece in self.pieces])
        return float(0.5 * (ends.max() - ends.min()))


def flow(law: Law, amplitude, frequency, y0, duration, tolerance=1e-12):
    """State after `duration`, its derivative by `y0`, and the pieces."""
    n = law.states
    omega = 2.0 * np.pi * frequency
    swing = max(np.hypot(y0[0], y0[1] / omega), 1e-12)
    sizes = np.maximum(np.abs(y0), [swing, omega * swing, *(n - 2) * [swing]])
    atol = tolerance * np.concatenate([sizes, np.ones(n * n)])
    eye = 1j * STEP * np.eye(n)

    def field_of(sides):
        def right(t, w):
            z, matrix = w[:n], w[n:].reshape(n, n)
            columns = law.rates(t, z[:, None] + eye, sides, amplitude, frequency)
            return np.concatenate([columns[:, 0].real, ((columns.imag / STEP) @ matrix).ravel()])

        return right

    t, w, pieces = 0.0, np.concatenate([y0, np.eye(n).ravel()]), []
    signs = np.where(np.asarray(law.kinks(y0)) >= 0.0, 1.0, -1.0)
    while t < duration:
        events = []
        for place, sign in enumerate(signs):

            def event(t, w, place=place, sign=sign):
                return sign * law.kinks(w[:n])[place]

            event.terminal, event.direction = True, -1.0
            events.append(event)
        piece = solve_ivp(
            field_of(signs), (t, duration), w, "DOP853", events=events, rtol=tolerance, atol=atol
        )
        assert piece.success, piece.message
        pieces.append(piece)
        t, w = piece.t[-1], piece.y[:, -1]
        if piece.status == 1:
            signs = signs.copy()
            for place, times in enumerate(piece.t_events):
                if times.size:
                    signs[place] *= -1.0
        else:
            break
    return w[:n], w[n:].reshape(n, n), pieces


def shoot(law: Law, amplitude, frequency, start, periods=1, iterations=30, tolerance=1e-12) -> Reference:
    """Newton's method on the period map, from `start`."""
    y0 = np.array(start, dtype=float)
    for _ in range(iterations):
        end, matrix, pieces = flow(law, amplitude, frequency, y0, periods / frequency, tolerance)
        step = np.linalg.solve(np.eye(law.states) - matrix, end - y0)
        size = np.maximum(np.abs(y0), 1e-2 * np.hypot(y0[0], y0[1] / (2 * np.pi * frequency)))
        if np.max(np.abs(step) / size) < 3e-11:
            return Reference(y0 + step, matrix, pieces)
        y0 = y0 + step
    raise AssertionError(f"the reference did not close: last step {step}")
