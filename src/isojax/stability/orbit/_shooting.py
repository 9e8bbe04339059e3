"""The equations of a periodic orbit: the motion closes, and the pieces meet at the kinks."""

import math
from typing import NamedTuple

import jax
import jax.numpy as jnp
import optimistix as optx
from jaxtyping import Array, Bool, Float, Int

from ..._types import Lanes
from ...models import Integrator, Isolator, State
from ._drive import Sine
from ._period_map import period_map, trajectory
from ._pieces import Crossings, advance_in_pieces, find_crossings

_FEWEST_STEPS, _MOST_STEPS = 16, 1 << 14
"""Steps a piece of the coarsest trial, and at most."""


class Closed(NamedTuple):
    """A closed motion.

    Attributes:
        state: at t = 0, SI units.
        matrix: derivative of the state after the turns (of minus it after half a turn) by the one before.
        error: largest change of `matrix`, in scaled units, where the steps are halved.
        mismatch: what is left open, over the size of the motion.
        found: whether the search converged.
        split: whether every kink was split at.
    """

    state: Float[Array, " state"]
    matrix: Float[Array, "state state"]
    error: Float[Array, ""]
    mismatch: Float[Array, ""]
    found: Bool[Array, ""]
    split: Bool[Array, ""]


def state_scale(path: State) -> Float[Array, " state"]:
    """Give the size of each state along a motion, to measure its changes by.

    Args:
        path: states, time first.

    Returns:
        Largest magnitudes; one where a motion is not finite or is nothing.
    """
    sizes = jnp.stack([jnp.max(jnp.abs(along)) for along in path])
    return jnp.where(jnp.isfinite(sizes) & (sizes > 0.0), sizes, 1.0)


def close_motion(
    model: Isolator,
    integrator: Integrator,
    solver: optx.AbstractRootFinder,
    drive: Sine,
    start: Float[Array, " state"],
    turns: float,
    places: int,
) -> Closed:
    """Find the motion that repeats after `turns` drive periods.

    Newton on the period map of fixed steps first; then, with the kinks that this motion passes, on the
    closing and the instants of the kinks together, with as many steps as the multipliers need. Derivatives of
    the result by model and drive follow from the implicit function theorem, not from the iterations.

    Args:
        model: the isolator.
        integrator: steps, solver of the equation of motion, tolerances.
        solver: root finder, of optimistix.
        drive: the drive that acts.
        start: state at t = 0 to start from.
        turns: drive periods; 0.5 where minus the state is to return after half a period.
        places: kinks a motion to make room for.

    Returns:
        The closed motion.
    """
    scale = jax.lax.stop_gradient(
        state_scale(trajectory(model, integrator, drive, tuple(start), turns=turns))
    )
    sign = -1.0 if turns == 0.5 else 1.0
    end = 2.0 * math.pi * turns

    def open_end(scaled: Array, args: tuple[Isolator, Sine]) -> Array:
        there, push = args
        moved = period_map(there, integrator, push, tuple(scaled * scale), turns=turns)
        return jnp.stack(moved) / scale - scaled

    frozen, held = jax.lax.stop_gradient((model, drive))
    begin = jax.lax.stop_gradient(start / scale)
    near = optx.root_find(open_end, solver, begin, (frozen, held), max_steps=50, throw=False).value
    path = trajectory(frozen, integrator, held, tuple(near * scale), turns=turns)
    crossings = find_crossings(frozen, path, end, places)
    kink_scale = _kink_scale(frozen, path, crossings)
    states = scale.size

    def apart(unknown: Array, args: tuple[Isolator, Sine, Int[Array, ""]]) -> Array:
        there, push, steps = args
        scaled, phases = unknown[:states], unknown[states:]
        meeting = crossings._replace(phases=phases)
        moved, reached = advance_in_pieces(
            there, integrator, push, tuple(scaled * scale), meeting, end, steps
        )
        shut = sign * jnp.stack(moved) / scale - scaled
        return jnp.concatenate([shut, jnp.where(crossings.kinks >= 0, reached / kink_scale, phases - end)])

    def matrices(
        unknown: Array,
        there: Isolator,
        push: Sine,
        steps: Int[Array, " trial"],
        polish: Bool[Array, " trial"],
    ) -> tuple[Array, tuple[Float[Array, "trial state state"], Float[Array, " trial"]]]:
        """Give the unknown, polished by a step of Newton where wanted, and before it the map's derivative
        and what is left open, for one count of steps after the other.
        """

        def body(unknown: Array, trial: tuple[Array, Array]) -> tuple[Array, tuple[Array, Array]]:
            count, wanted = trial

            def twice(unknown: Array) -> tuple[Array, Array]:
                left = apart(unknown, (there, push, count))
                return left, left

            jacobian, left = jax.jacfwd(twice, has_aux=True)(unknown)
            upper, lower = jacobian[:states], jacobian[states:]
            own = upper[:, :states] + jnp.eye(states)
            bent = upper[:, states:] @ jnp.linalg.solve(lower[:, states:], lower[:, :states])
            step = jnp.linalg.solve(jax.lax.stop_gradient(jacobian), left)
            return unknown - jnp.where(wanted, step, 0.0), (own - bent, jnp.max(jnp.abs(left)))

        # Looped over, so that the motion is compiled once for all of them.
        return jax.lax.scan(body, unknown, (steps, polish))

    least = max(_FEWEST_STEPS, integrator.steps_a_period(model) // (places + 1))
    first = jnp.concatenate([near, crossings.phases])
    _, (trials, _) = matrices(first, frozen, held, jnp.array([least, 2 * least]), jnp.zeros(2, bool))
    # Fourth order: sixteen times less a doubling.
    apart_by = jnp.max(jnp.abs(trials[0] - trials[1]))
    doublings = jnp.ceil(jnp.log2(apart_by / integrator.multiplier_tolerance) / 4.0) + 1.0
    wanted = least * 2.0 ** jnp.clip(jnp.where(jnp.isfinite(doublings), doublings, 0.0), 1.0, 20.0)
    steps = jax.lax.stop_gradient(jnp.minimum(wanted, _MOST_STEPS).astype(int))
    root = optx.root_find(apart, solver, first, (frozen, held, steps), max_steps=20, throw=False).value
    # The first two steps, with the live model and a frozen Jacobian, change nothing but derivatives, which
    # become those of the implicit function: each step puts one order right. optimistix's own implicit
    # derivative raises an error where the search failed, but a lane of a batch must not stop the others.
    counts = jnp.stack([steps, steps, steps, steps // 2])
    final, (transitions, left) = matrices(root, model, drive, counts, jnp.arange(4) < 2)
    transition, mismatch = transitions[2], left[2]
    error = jnp.max(jnp.abs(transition - transitions[3])) / 15.0
    found = jnp.isfinite(mismatch) & (mismatch < 1e3 * integrator.orbit_tolerance)
    return Closed(
        final[:states] * scale,
        scale[:, None] * transition / scale[None, :],
        jax.lax.stop_gradient(error),
        jax.lax.stop_gradient(mismatch),
        found,
        crossings.complete,
    )


def _kink_scale(model: Isolator, path: State, crossings: Crossings) -> Lanes:
    """Give the size of the kink function that belongs to each crossing."""
    kinks = model.kinks(path)
    if not kinks:
        return jnp.ones(crossings.phases.shape)
    return state_scale(kinks)[jnp.maximum(crossings.kinks, 0)]
