"""The settled motion at fixed phases of the drive."""

import math
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..._given_numbers import given_count
from ..._quick_jit import quick_jit
from ..._results import RESULTS
from ..._show import shown
from ..._types import check_float64
from ...excitations import Harmonic
from ...models import Integrator, Isolator, State, advance, as_isolator
from ..orbit import AbstractStatePath, PeriodicDrive, integrator_for, recorded_sine, trajectory
from ._stroboscope import Watch, bounded_or_not, settle_down, start_states


@shown
class PoincareSection(AbstractStatePath):
    """Points of the settled motion at fixed phases of the drive.

    Attributes:
        phases: of the recorded drive, 0 where it passes zero upwards [rad].
        states: displacement [m], velocity [m/s], internal states; NaN where the motion left every bound.
        result: whether the motion stayed bounded.
    """

    phases: Float[Array, " phase"]
    states: Float[Array, "phase period state"]
    result: RESULTS


def poincare_section(
    model: Isolator,
    excitation: Harmonic,
    *,
    phases: Any = (0.0,),
    start: Any = None,
    settle: int = 200,
    periods: int = 1000,
    integrator: Integrator | None = None,
) -> PoincareSection:
    """Give the settled motion once a period, at each of some phases of the drive.

    Args:
        model: the isolator.
        excitation: the drive.
        phases: of the recorded drive, from 0 to below 2 pi [rad].
        start: state at t = 0; rest if omitted.
        settle: drive periods before the first point.
        periods: points at each phase.
        integrator: solver and steps.

    Returns:
        The points.

    Raises:
        ValueError: if a phase lies outside one turn, `start` has the wrong length, or a count is not
            positive.
        RuntimeError: if JAX is not in 64-bit mode.

    Source: Moon 1992, Chaotic and Fractal Dynamics, sec. 2.4.
    """
    model = as_isolator(model)
    check_float64()
    settle = given_count("settle", settle)
    periods = given_count("periods", periods)
    integrator = integrator_for(model, integrator)
    turns = np.asarray(phases, dtype=float)
    if turns.ndim != 1 or not turns.size:
        raise ValueError(f"Argument `phases` must be a list of numbers, but has shape {turns.shape}.")
    bad = np.flatnonzero(~((turns >= 0.0) & (turns < 2.0 * math.pi)))
    if bad.size:
        raise ValueError(f"Argument `phases` must lie in [0, 2 pi), but phases[{bad[0]}] = {turns[bad[0]]}.")
    state = start_states(model, "start", start)
    how = Watch(integrator, settle, periods)
    return _section(model, excitation, jnp.asarray(turns), state, how)


@quick_jit
def _section(
    model: Isolator, excitation: Harmonic, phases: Float[Array, " phase"], state: State, how: Watch
) -> PoincareSection:
    drive = recorded_sine(model, excitation.amplitude, excitation.frequency)
    integrator, steps = how.integrator, how.integrator.steps_a_period(model)
    place = phases * steps / (2.0 * math.pi)
    node = jnp.floor(place).astype(int)

    def body(here: State, _: None) -> tuple[State, State]:
        path = trajectory(model, integrator, drive, here)
        # The rest of the way to each phase is one step of its own length.
        begin = tuple(along[node] for along in path)
        share = (place - node) / steps
        moved = _short_step(model, integrator, drive, begin, 2.0 * math.pi * node / steps, share)
        return tuple(along[-1] for along in path), moved

    settled = settle_down(model, integrator, drive, state, how.settle)
    end, seen = jax.lax.scan(body, settled, length=how.periods)
    states = jnp.swapaxes(jnp.stack(seen, axis=-1), 0, 1)
    finite = jnp.all(jnp.isfinite(jnp.stack(end)))
    return PoincareSection(phases, jnp.where(finite, states, jnp.nan), bounded_or_not(finite))


def _short_step(
    model: Isolator,
    integrator: Integrator,
    drive: PeriodicDrive,
    state: State,
    phase: Float[Array, " phase"],
    share: Float[Array, " phase"],
) -> State:
    """Give the states a share of a period later, by one step."""
    angles = [phase + 2.0 * math.pi * share * part for part in (0.0, 0.5, 1.0)]
    stages = tuple(drive.at(drive.waves(angle)) for angle in angles)
    return advance(model, integrator.solver, "acceleration", share / drive.frequency, state, stages)
