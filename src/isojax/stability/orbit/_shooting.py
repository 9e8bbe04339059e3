"""Shooting: the motion that repeats after its drive periods, with its pieces meeting at the kinks."""

import math
from typing import NamedTuple

import jax
import jax.numpy as jnp
import optimistix as optx
from jaxtyping import Array, Bool, Float

from ...excitations import Harmonic
from ...models import Isolator
from ._jacobian import value_and_jacobian
from ._kink_crossings import find_crossings
from ._period_map import period_map, trajectory
from ._shooting_method import ShootingMethod
from ._sine import Sine, recorded_sine
from ._split_period_map import FEWEST_STEPS, Split, kink_scale, split_image, state_scale, steps_wanted

_MOST_STEPS_A_PIECE = 1 << 14
"""Steps a piece at most, for an orbit."""


class ShootingSolution(NamedTuple):
    """A closed motion, without derivatives: see `closing`.

    Attributes:
        root: its scaled state, then the phases of its crossings.
        split: where it is split.
        state: at t = 0, SI units.
        matrix: derivative of the state after the turns (of minus it after half a turn) by the one before.
        error: largest change of `matrix`, in scaled units, where the steps are halved.
        found: whether the search converged.
    """

    root: Float[Array, " unknown"]
    split: Split
    state: Float[Array, " state"]
    matrix: Float[Array, "state state"]
    error: Float[Array, ""]
    found: Bool[Array, ""]


def _gap(
    unknown: Array, method: ShootingMethod, split: Split, model: Isolator, drive: Sine
) -> Float[Array, " equation"]:
    """Give the residual of the closure condition for a scaled state and the phases of its crossings."""
    moved, missed = split_image(model, method, drive, split, unknown)
    return jnp.concatenate([moved - unknown[: moved.size], missed])


def _gap_and_transition(
    unknown: Array, method: ShootingMethod, split: Split, model: Isolator, drive: Sine
) -> tuple[Array, Array, Float[Array, "state state"]]:
    """Give the residual, its derivative, and that of the map, in scaled units."""
    states = split.scale.size
    left, jacobian = value_and_jacobian(lambda at: _gap(at, method, split, model, drive), unknown)
    upper, lower = jacobian[:states], jacobian[states:]
    bent = upper[:, states:] @ jnp.linalg.solve(lower[:, states:], lower[:, :states])
    return left, jacobian, upper[:, :states] + jnp.eye(states) - bent


def closing(
    root: Float[Array, " unknown"], live: tuple[Isolator, Harmonic], held: tuple[ShootingMethod, Split]
) -> tuple[Float[Array, " equation"], tuple[Float[Array, " state"], Float[Array, "state state"]]]:
    """Give what vanishes for a closed motion, and its state and matrix: the equations of their derivatives.

    Args:
        root: scaled state at t = 0, then the phases of the crossings.
        live: the isolator and the recorded drive.
        held: how the motion is closed, and where it is split.

    Returns:
        The gap at its end and at its kinks; `ShootingSolution.state` and `matrix`.
    """
    (model, excitation), (method, split) = live, held
    drive = recorded_sine(model, excitation.amplitude, excitation.frequency)
    left, _, matrix = _gap_and_transition(root, method, split, model, drive)
    scale = split.scale
    return left, (root[: scale.size] * scale, scale[:, None] * matrix / scale[None, :])


def shoot(
    model: Isolator,
    method: ShootingMethod,
    solver: optx.AbstractRootFinder,
    drive: Sine,
    start: Float[Array, " state"],
    places: int,
) -> ShootingSolution:
    """Find the motion that repeats after the drive periods of a method.

    Newton on the period map of fixed steps first; then, with the kinks that this motion passes, on the
    closing and the instants of the kinks together, with as many steps as the multipliers need.

    Args:
        model: the isolator.
        method: how the motion is closed; its integrator with steps, solver and tolerances.
        solver: root finder, of optimistix.
        drive: the drive that acts.
        start: state at t = 0 to start from.
        places: kinks a motion to make room for.

    Returns:
        The closed motion.
    """
    integrator, turns = method.integrator, method.turns
    scale = state_scale(trajectory(model, integrator, drive, tuple(start), turns=turns))

    def open_end(scaled: Array, args: None) -> Array:
        moved = period_map(model, integrator, drive, tuple(scaled * scale), turns=turns)
        return jnp.stack(moved) / scale - scaled

    near = optx.root_find(open_end, solver, start / scale, max_steps=50, throw=False).value
    path = trajectory(model, integrator, drive, tuple(near * scale), turns=turns)
    crossings = find_crossings(model, path, 2.0 * math.pi * turns, places)
    least = max(FEWEST_STEPS, integrator.steps_a_period(model) // (places + 1))
    sizes = kink_scale(model, path, crossings)
    split = Split(scale, crossings, sizes, jnp.asarray(least), crossings.complete)

    def matrices(unknown: Array, steps: Array, polish: Array) -> tuple[Array, tuple[Array, Array]]:
        """Give the unknown, polished by a step of Newton where wanted, and before it the map's derivative
        and the residual, for one count of steps after the other.
        """

        def body(unknown: Array, trial: tuple[Array, Array]) -> tuple[Array, tuple[Array, Array]]:
            count, wanted = trial
            finer = split._replace(steps=count)
            left, jacobian, transition = _gap_and_transition(unknown, method, finer, model, drive)
            step = jnp.linalg.solve(jacobian, left)
            return unknown - jnp.where(wanted, step, 0.0), (transition, jnp.max(jnp.abs(left)))

        # Looped over, so that the motion is compiled once for all of them.
        return jax.lax.scan(body, unknown, (steps, polish))

    first = jnp.concatenate([near, crossings.phases])
    _, (trials, _) = matrices(first, jnp.array([least, 2 * least]), jnp.zeros(2, bool))
    goal = integrator.multiplier_tolerance
    steps = steps_wanted(least, trials, goal, doublings=1, most=_MOST_STEPS_A_PIECE)
    split = split._replace(steps=steps)

    def gap(unknown: Array, args: None) -> Array:
        return _gap(unknown, method, split, model, drive)

    root = optx.root_find(gap, solver, first, max_steps=20, throw=False).value
    counts = jnp.stack([steps, steps, steps // 2])
    root, (transitions, left) = matrices(root, counts, jnp.arange(3) < 1)
    transition, mismatch = transitions[1], left[1]
    error = jnp.max(jnp.abs(transition - transitions[2])) / 15.0
    found = jnp.isfinite(mismatch) & (mismatch < integrator.residual_tolerance)
    state, matrix = root[: scale.size] * scale, scale[:, None] * transition / scale[None, :]
    return ShootingSolution(root, split, state, matrix, error, found)
