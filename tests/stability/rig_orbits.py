"""Periodic orbits of the simulated rig: event-exact steps of order eight, central differences, Newton.

The rig shares no code with the models. It ends a step at every kink, reversal, sticking and breaking away,
so that its map over a period is that of the sharp laws.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from isojax import rig
from isojax.rig._force_pieces import ForcePiece
from isojax.rig._motion_equation import EquationOfMotion
from isojax.rig._solver import PlantIntegrator

TOLERANCE = 1e-13
"""Local error of a step over the largest value of each state."""

NEWTON_STEPS = 12
"""Steps of Newton's method at most."""

CLOSED_TO = 1e-9
"""Change of the state, over its size, after which an orbit counts as closed."""

SHIFT = 2e-5
"""Differences of the states, over their sizes: the error of a central difference is of their square."""


class RigOrbit(NamedTuple):
    """A periodic orbit.

    Attributes:
        y0: state at t = 0; of the rig, so that internal states may have other units than the model's.
        multipliers: Floquet multipliers, in falling modulus.
        closed: whether Newton's method converged.
    """

    y0: np.ndarray
    multipliers: np.ndarray
    closed: bool


def after_a_period(plant: rig.Plant, amplitude: float, frequency: float, y0: np.ndarray) -> np.ndarray:
    """Give the state of a plant one drive period later.

    Args:
        plant: the plant; of its instruments, those that change the shape of the drive act.
        amplitude: F0 [N].
        frequency: f [Hz].
        y0: state at t = 0.

    Returns:
        The state.
    """
    start, size, state, coefficients, _, _ = _steps_of_a_period(plant, amplitude, frequency, y0)[-1]
    return np.asarray(state) + np.asarray(coefficients)[:, 0] * (1.0 / frequency - start) / size


def displacements_of_a_period(
    plant: rig.Plant, amplitude: float, frequency: float, y0: np.ndarray
) -> np.ndarray:
    """Give the displacement at the beginning of each step of a drive period; see `after_a_period`."""
    return np.array([step[2][0] for step in _steps_of_a_period(plant, amplitude, frequency, y0)])


def _steps_of_a_period(plant: rig.Plant, amplitude: float, frequency: float, y0: np.ndarray) -> list:
    period = 1.0 / frequency
    drive: Sequence[ForcePiece] = [
        rig.Tones(0.0, period, 0.0, (amplitude,), (2.0 * math.pi * frequency,), (0.0,))
    ]
    for instrument in plant.instruments:
        drive = instrument.acting(drive, frequency)
    integrator = PlantIntegrator(EquationOfMotion(plant), TOLERANCE)
    integrator._largest[:] = np.maximum(np.abs(y0), 1e-3 * np.abs(y0).max() * _units(y0, frequency))
    return integrator.run(drive, y0)._steps


def _units(y0: np.ndarray, frequency: float) -> np.ndarray:
    """Give the size of one unit of displacement in each state."""
    return np.array([1.0, 2.0 * math.pi * frequency, *np.ones(y0.size - 2)])


def rig_orbit(
    plant: rig.Plant, amplitude: float, frequency: float, start: np.ndarray, shift: float = SHIFT
) -> RigOrbit:
    """Close an orbit from a start.

    Args:
        plant: the plant.
        amplitude: F0 [N].
        frequency: f [Hz].
        start: state at t = 0, near the orbit.
        shift: differences of the states, over their sizes: less where events come and go within them.

    Returns:
        The orbit.
    """
    y0 = np.array(start, dtype=float)
    omega = 2.0 * math.pi * frequency
    displacement = math.hypot(y0[0], y0[1] / omega)
    sizes = np.array([displacement, displacement * omega, *np.maximum(np.abs(y0[2:]), 0.05 * displacement)])
    closed, matrix = False, np.full((y0.size, y0.size), np.nan)
    for _ in range(NEWTON_STEPS):
        end = after_a_period(plant, amplitude, frequency, y0)
        columns = []
        for place in range(y0.size):
            moved = shift * sizes[place] * np.eye(y0.size)[place]
            ends = [after_a_period(plant, amplitude, frequency, y0 + sign * moved) for sign in (1.0, -1.0)]
            columns.append((ends[0] - ends[1]) / (2.0 * shift * sizes[place]))
        matrix = np.stack(columns, axis=1)
        step = np.linalg.solve(np.eye(y0.size) - matrix, end - y0)
        y0 = y0 + step
        if np.max(np.abs(step) / sizes) < CLOSED_TO:
            closed = True
            break
    values = np.linalg.eigvals(matrix).astype(complex)
    return RigOrbit(y0, values[np.argsort(-np.abs(values), kind="stable")], closed)


def multiplier_error(ours: np.ndarray, theirs: np.ndarray, least_slope: float = 0.1) -> float:
    """Give the distance of multipliers from those of a reference, as the error of a map is defined.

    The characteristic polynomial over its slope; the slope counts as 0.1 at least, for where two multipliers
    all but coincide they separate like the square root of any error.

    Args:
        ours: multipliers.
        theirs: of the reference.
        least_slope: smallest slope.

    Returns:
        The largest error.
    """
    distance = np.sort(np.abs(np.asarray(ours)[:, None] - np.asarray(theirs)[None, :]), axis=1)
    others = np.prod(distance[:, 1:], axis=1)
    return float(np.max(distance[:, 0] * others / np.maximum(others, least_slope)))
