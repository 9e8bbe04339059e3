"""Shooting: the motion that repeats after its drive periods, with its pieces meeting at the kinks."""

import math
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import optimistix as optx
from jaxtyping import Array, Bool, Float, Int

from ..._small_systems import solve
from ...excitations import Harmonic
from ...models import Isolator, sliding_switch
from ._event_path import follow_events, same_events
from ._held import is_held
from ._jacobian import value_and_jacobian, with_matrix
from ._period_map import period_map, trajectory
from ._shooting_method import ShootingMethod
from ._sine import PeriodicDrive, recorded_sine
from ._split_period_map import Split, split_at_events, split_image, state_scale, steps_wanted

_MOST_STEPS_A_PIECE = 1 << 14
"""Steps a piece at most, for an orbit."""

_SPLITS_ANEW = 4
"""Times at most that a motion is split anew because the closed one has other events."""

_CHECKING_STEPS = 2
"""Times the steps with which the events of a closed motion are looked at."""


class ShootingSolution(NamedTuple):
    """A closed motion, without derivatives: see `closing`.

    Attributes:
        root: its scaled state, then the phases of its crossings.
        split: where it is split.
        state: at t = 0, SI units.
        matrix: derivative of the state after the turns (of minus it after half a turn) by the one before.
        error: largest change of `matrix`, in scaled units, where the steps are halved.
        found: whether the search converged.
        accurate: whether it has the events at which it is split, and as accurate multipliers as asked.
    """

    root: Float[Array, " unknown"]
    split: Split
    state: Float[Array, " state"]
    matrix: Float[Array, "state state"]
    error: Float[Array, ""]
    found: Bool[Array, ""]
    accurate: Bool[Array, ""]


class Accuracy(NamedTuple):
    """How accurate multipliers are to be.

    Attributes:
        goal: integration error down to which steps are refined.
        limit: beyond which they are not accurate enough.
    """

    goal: float
    limit: float


class _Round(NamedTuple):
    """A motion that is closed with the events of the one before."""

    state: Float[Array, " state"]
    root: Float[Array, " unknown"]
    split: Split
    transition: Float[Array, "state state"]
    error: Float[Array, ""]
    mismatch: Float[Array, ""]
    agrees: Bool[Array, ""]
    rounds: Int[Array, ""]


def _gap(
    unknown: Array, method: ShootingMethod, split: Split, model: Isolator, drive: PeriodicDrive
) -> Float[Array, " equation"]:
    """Give the residual of the closure condition for a scaled state and the phases of its crossings."""
    moved, missed = split_image(model, method, drive, split, unknown)
    return jnp.concatenate([moved - unknown[: moved.size], missed])


def _gap_and_transition(
    unknown: Array, method: ShootingMethod, split: Split, model: Isolator, drive: PeriodicDrive
) -> tuple[Array, Array, Float[Array, "state state"]]:
    """Give the residual, its derivative, and that of the map, in scaled units."""
    states = split.scale.size
    left, jacobian = value_and_jacobian(lambda at: _gap(at, method, split, model, drive), unknown)
    upper, lower = jacobian[:states], jacobian[states:]
    bent = upper[:, states:] @ solve(lower[:, states:], lower[:, :states])
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
    drive: PeriodicDrive,
    start: Float[Array, " state"],
    places: int,
    accuracy: Accuracy | None = None,
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
        accuracy: of the multipliers; that of single orbits if omitted.

    Returns:
        The closed motion.
    """
    if accuracy is None:
        accuracy = Accuracy(method.integrator.multiplier_tolerance, method.integrator.orbit_error)
    integrator, turns = method.integrator, method.turns
    scale = state_scale(trajectory(model, integrator, drive, tuple(start), turns=turns))

    @with_matrix
    def open_end(scaled: Array, held: tuple[Isolator, PeriodicDrive, Array]) -> Array:
        model, drive, scale = held
        moved = period_map(model, integrator, drive, tuple(scaled * scale), turns=turns)
        return jnp.stack(moved) / scale - scaled

    held = model, drive, scale
    near = optx.root_find(open_end, solver, start / scale, held, max_steps=50, throw=False).value

    def again(own: _Round) -> Array:
        return ~own.agrees & jnp.all(jnp.isfinite(own.state)) & (own.rounds < _SPLITS_ANEW)

    def body(own: _Round) -> _Round:
        return _closed(model, method, solver, drive, own.state, places, own.rounds, accuracy.goal)

    # What is carried into the first round, but for the state, is read by nothing.
    begun = near * scale, jnp.asarray(0)
    shapes = jax.eval_shape(
        lambda state, count: _closed(model, method, solver, drive, state, places, count, accuracy.goal),
        *begun,
    )
    blank = jax.tree.map(lambda one: jnp.zeros(one.shape, one.dtype), shapes)
    first = blank._replace(state=begun[0], agrees=jnp.array(False), rounds=begun[1])
    last = jax.lax.while_loop(again, body, first)
    matrix = last.split.scale[:, None] * last.transition / last.split.scale[None, :]
    accurate = last.agrees & (last.error <= accuracy.limit)
    # Where the search ran away no round was begun.
    found = jnp.all(jnp.isfinite(last.state)) & (last.mismatch < integrator.residual_tolerance)
    if model.slides:
        # Held throughout, the mass may rest anywhere within the friction: that is no orbit of its own. On
        # the way to rest it may still creep to the first event.
        assert last.split.crossings.sides is not None
        found = found & jnp.any(last.split.crossings.sides[1:, sliding_switch(model)] != 0.0)
        # Nor is what closes by laws continued past their sides, beside a mass at rest.
        found = found & (accurate | ~is_held(model, drive))
    return ShootingSolution(last.root, last.split, last.state, matrix, last.error, found, accurate)


@eqx.filter_jit  # JAX keeps its trace, which the shapes and the loop both ask for
def _closed(
    model: Isolator,
    method: ShootingMethod,
    solver: optx.AbstractRootFinder,
    drive: PeriodicDrive,
    near: Float[Array, " state"],
    places: int,
    rounds: Int[Array, ""],
    goal: float,
) -> _Round:
    """Close a motion with the events of one next to it, and see whether it has these events itself."""
    integrator = method.integrator
    split = split_at_events(model, method, drive, tuple(near), places)
    scale, least = split.scale, split.steps

    def trials(unknown: Array, steps: Array, polish: Array) -> tuple[Array, tuple[Array, Array]]:
        """Give the unknown, polished by a step of Newton where wanted, and before it the map's derivative
        and the residual, for one count of steps after the other.
        """

        def body(unknown: Array, trial: tuple[Array, Array]) -> tuple[Array, tuple[Array, Array]]:
            steps, wanted = trial
            finer = split._replace(steps=steps)
            left, jacobian, transition = _gap_and_transition(unknown, method, finer, model, drive)
            step = solve(jacobian, left)
            return unknown - jnp.where(wanted, step, 0.0), (transition, jnp.max(jnp.abs(left)))

        return jax.lax.scan(body, unknown, (steps, polish))

    @with_matrix
    def gap(unknown: Array, held: tuple[Split, Isolator, PeriodicDrive]) -> Array:
        return _gap(unknown, method, *held)

    def closed(unknown: Array, steps: Array) -> Array:
        held = split._replace(steps=steps), model, drive
        return optx.root_find(gap, solver, unknown, held, max_steps=20, throw=False).value

    def twice(at: tuple[Array, Array], last: Array) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
        """Find the steps that the multipliers need; then close the motion with them, and see how it is."""
        unknown, steps = at
        unknown = jax.lax.cond(last, closed, lambda unknown, _: unknown, unknown, steps)
        counts = jnp.where(last, jnp.stack([steps, steps, steps // 2]), least * jnp.array([1, 2, 1]))
        unknown, (matrices, left) = trials(unknown, counts, last & (jnp.arange(3) < 1))
        needed = steps_wanted(least, matrices, goal, doublings=1, most=_MOST_STEPS_A_PIECE)
        return (unknown, jnp.where(last, steps, needed)), (matrices, left)

    # Looped over, so that the motion is compiled once for all of them.
    first = jnp.concatenate([near / scale, split.crossings.phases])
    (root, steps), (matrices, left) = jax.lax.scan(twice, (first, least), jnp.array([False, True]))
    split = split._replace(steps=steps)
    transitions, left = matrices[-1], left[-1]
    error = jnp.max(jnp.abs(transitions[1] - transitions[2])) / 15.0
    state, end = root[: scale.size] * scale, 2.0 * math.pi * method.turns
    fine = round(_CHECKING_STEPS * integrator.steps_a_period(model) * method.turns)
    own = follow_events(model, drive, tuple(state), end, fine, places).crossings
    agrees = same_events(own, split.crossings._replace(phases=root[scale.size :]), end)
    return _Round(state, root, split, transitions[1], error, left[1], agrees, rounds + 1)
