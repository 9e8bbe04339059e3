"""The period map with the motion split at its kinks: what orbits and bifurcations are found with exactly."""

import math
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from ..._small_systems import solve
from ...models import Isolator, State
from ._event_path import follow_events
from ._kink_crossings import Crossings, advance_across_kinks
from ._shooting_method import ShootingMethod
from ._sine import PeriodicDrive

FEWEST_STEPS = 16
"""Steps a piece of the coarsest trial."""

_EVENTS_A_PERIOD, _MORE_EVENTS = 4, 2
"""Events of each kind in a period to make room for first; times as many where the drive holds harmonics."""

MOST_STEPS_A_PERIOD = 1 << 12
"""Steps a piece of a drive period at most, for a bifurcation."""


class Split(NamedTuple):
    """How a motion is split.

    Attributes:
        scale: size of each state.
        crossings: the kinks that it passes.
        kink_scale: size of the kink function of each crossing.
        steps: steps a piece.
        complete: whether every crossing found a place.
    """

    scale: Float[Array, " state"]
    crossings: Crossings
    kink_scale: Float[Array, " crossing"]
    steps: Int[Array, ""]
    complete: Bool[Array, ""]


def split_image(
    model: Isolator,
    method: ShootingMethod,
    drive: PeriodicDrive,
    split: Split,
    unknown: Float[Array, " unknown"],
) -> tuple[Float[Array, " state"], Float[Array, " crossing"]]:
    """Give the state after the turns of the method, and how far each kink is missed.

    Args:
        model: the isolator.
        method: how the orbit is closed.
        drive: the drive that acts.
        split: where the motion is split.
        unknown: scaled state at t = 0, then the phase of each crossing [rad].

    Returns:
        The state then over its scale, and the scaled kink functions at the crossings.
    """
    states = split.scale.shape[0]
    end = 2.0 * math.pi * method.turns
    sign = -1.0 if method.half else 1.0
    phases = unknown[states:]
    meeting = split.crossings._replace(phases=phases)
    begin = tuple(unknown[:states] * split.scale)
    moved, reached = advance_across_kinks(model, method.integrator, drive, begin, meeting, end, split.steps)
    missed = jnp.where(split.crossings.kinks >= 0, reached / split.kink_scale, phases - end)
    return sign * jnp.stack(moved) / split.scale, missed


def split_jacobian(
    model: Isolator,
    method: ShootingMethod,
    drive: PeriodicDrive,
    split: Split,
    unknown: Float[Array, " unknown"],
) -> tuple[Float[Array, "state state"], Float[Array, "crossing state"]]:
    """Give the derivative of the image by the state, the instants of the kinks following along.

    Args:
        model: the isolator.
        method: how the orbit is closed.
        drive: the drive that acts.
        split: where the motion is split.
        unknown: scaled state at t = 0, then the phase of each crossing.

    Returns:
        The matrix in scaled units, and the derivative of the phases by the state.
    """
    states = split.scale.shape[0]
    upper, lower = jax.jacfwd(lambda u: split_image(model, method, drive, split, u))(unknown)
    phases = -solve(lower[:, states:], lower[:, :states])
    return upper[:, :states] + upper[:, states:] @ phases, phases


def first_split(
    model: Isolator,
    method: ShootingMethod,
    drive: PeriodicDrive,
    state: Float[Array, " state"],
    places: int,
) -> tuple[Split, Float[Array, " unknown"]]:
    """Find where a motion is to be split, with the steps of the coarsest trial.

    Args:
        model: the isolator.
        method: how the orbit is closed.
        drive: the drive that acts.
        state: at t = 0, SI units.
        places: crossings to make room for.

    Returns:
        The split, and the scaled state with the phases of the crossings.
    """
    split = split_at_events(model, method, drive, tuple(state), places)
    return split, jnp.concatenate([state / split.scale, split.crossings.phases])


def split_at_events(
    model: Isolator, method: ShootingMethod, drive: PeriodicDrive, state: State, places: int
) -> Split:
    """Split a motion at its events, with the fewest steps.

    Args:
        model: the isolator.
        method: how the orbit is closed.
        drive: the drive that acts.
        state: at t = 0, SI units.
        places: crossings to make room for.

    Returns:
        The split.
    """
    steps, end = method.integrator.steps_a_period(model), 2.0 * math.pi * method.turns
    count = round(steps * method.turns)
    motion = follow_events(model, drive, state, end, count, places, count + 1)
    path, crossings = tuple(motion.path.T), motion.crossings
    scale = state_scale(path)
    sizes = _switch_scale(model, path, crossings, drive.angular_frequency**2 * scale[0])
    # A harmonic takes as many more as its period is shorter; what multipliers need says nothing of it.
    least = jnp.asarray(max(FEWEST_STEPS, method.periods * steps // (places + 1))) * drive.highest_order
    return Split(scale, crossings, sizes, least, crossings.complete)


def event_places(model: Isolator, turns: float) -> int:
    """Give how many events of a motion to make room for first.

    Args:
        model: the isolator.
        turns: drive periods that the motion lasts.

    Returns:
        Places.
    """
    rest = tuple(jnp.zeros(()) for _ in range(2 + model.internal_states))
    kinds = len(model.switches(rest)) + (2 if model.slides else 0)
    return math.ceil(_EVENTS_A_PERIOD * kinds * turns) * (_MORE_EVENTS if model.harmonics else 1)


def steps_wanted(
    least: Array | int,
    trials: Float[Array, "trial state state"],
    tolerance: float,
    *,
    doublings: int,
    most: int,
) -> Int[Array, ""]:
    """Give the steps a piece that multipliers need, from matrices with `least` steps and with twice as many.

    Args:
        least: steps of the first trial.
        trials: the derivative of the map with these steps and with twice as many.
        tolerance: error of the multipliers that the steps may leave.
        doublings: further doublings for safety.
        most: steps at most.

    Returns:
        Steps a piece.
    """
    apart = jnp.max(jnp.abs(trials[0] - trials[1]))
    # Fourth order: sixteen times less a doubling.
    needed = jnp.ceil(jnp.log2(apart / tolerance) / 4.0) + doublings
    wanted = least * 2.0 ** jnp.clip(jnp.where(jnp.isfinite(needed), needed, 0.0), 1.0, 20.0)
    return jnp.minimum(wanted, most).astype(int)


def state_scale(path: State) -> Float[Array, " state"]:
    """Give the size of each state along a motion, to measure its changes by.

    Args:
        path: states, time first.

    Returns:
        Largest magnitudes; one where a motion is not finite or is nothing.
    """
    sizes = jnp.stack([jnp.max(jnp.abs(along)) for along in path])
    return jnp.where(jnp.isfinite(sizes) & (sizes > 0.0), sizes, 1.0)


def _switch_scale(
    model: Isolator, path: State, crossings: Crossings, acceleration: Array
) -> Float[Array, " crossing"]:
    """Give the size of the switch of each crossing; of what frees a mass, that of acceleration."""
    switches = model.switches(path)
    if not switches:
        return jnp.ones(crossings.phases.shape)
    sizes = state_scale(switches)
    if model.slides:
        sizes = jnp.concatenate([sizes, jnp.stack([acceleration] * 2)])
    return sizes[jnp.maximum(crossings.kinks, 0)]
