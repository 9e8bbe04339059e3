"""Shooting: the motion that repeats after its drive periods, with its pieces meeting at the kinks."""

import math
from typing import NamedTuple

import jax
import jax.numpy as jnp
import optimistix as optx
from jaxtyping import Array, Bool, Float, Int

from ...models import Isolator
from ._jacobian import value_and_jacobian
from ._kink_crossings import find_crossings
from ._period_map import period_map, trajectory
from ._shooting_method import ShootingMethod
from ._sine import Sine
from ._split_period_map import FEWEST_STEPS, Split, kink_scale, split_image, state_scale, steps_wanted

_MOST_STEPS_A_PIECE = 1 << 14
"""Steps a piece at most, for an orbit."""


class ShootingSolution(NamedTuple):
    """A closed motion.

    Attributes:
        state: at t = 0, SI units.
        matrix: derivative of the state after the turns (of minus it after half a turn) by the one before.
        error: largest change of `matrix`, in scaled units, where the steps are halved.
        mismatch: residual of the closure condition, over the size of the motion.
        found: whether the search converged.
        split: whether every kink was split at.
    """

    state: Float[Array, " state"]
    matrix: Float[Array, "state state"]
    error: Float[Array, ""]
    mismatch: Float[Array, ""]
    found: Bool[Array, ""]
    split: Bool[Array, ""]


class _Equations(NamedTuple):
    """What vanishes for a closed motion: the gap at its end, and the kinks where its pieces meet.

    Attributes:
        method: how the motion is closed.
        split: where it is split; its own steps are replaced by those that are asked for.
    """

    method: ShootingMethod
    split: Split

    def gap(self, unknown: Array, args: tuple[Isolator, Sine, Int[Array, ""]]) -> Array:
        """Give the residual of the closure condition for a scaled state and the phases of its crossings."""
        model, drive, steps = args
        split = self.split._replace(steps=steps)
        moved, missed = split_image(model, self.method, drive, split, unknown)
        return jnp.concatenate([moved - unknown[: moved.size], missed])

    def matrices(
        self,
        unknown: Array,
        model: Isolator,
        drive: Sine,
        steps: Int[Array, " trial"],
        polish: Bool[Array, " trial"],
    ) -> tuple[Array, tuple[Float[Array, "trial state state"], Float[Array, " trial"]]]:
        """Give the unknown, polished by a step of Newton where wanted, and before it the map's derivative
        and the residual, for one count of steps after the other.
        """
        states = self.split.scale.size

        def body(unknown: Array, trial: tuple[Array, Array]) -> tuple[Array, tuple[Array, Array]]:
            count, wanted = trial

            left, jacobian = value_and_jacobian(lambda at: self.gap(at, (model, drive, count)), unknown)
            upper, lower = jacobian[:states], jacobian[states:]
            own = upper[:, :states] + jnp.eye(states)
            bent = upper[:, states:] @ jnp.linalg.solve(lower[:, states:], lower[:, :states])
            step = jnp.linalg.solve(jax.lax.stop_gradient(jacobian), left)
            return unknown - jnp.where(wanted, step, 0.0), (own - bent, jnp.max(jnp.abs(left)))

        # Looped over, so that the motion is compiled once for all of them.
        return jax.lax.scan(body, unknown, (steps, polish))


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
    closing and the instants of the kinks together, with as many steps as the multipliers need. Derivatives of
    the result by model and drive follow from the implicit function theorem, not from the iterations.

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
    scale = jax.lax.stop_gradient(
        state_scale(trajectory(model, integrator, drive, tuple(start), turns=turns))
    )

    def open_end(scaled: Array, args: tuple[Isolator, Sine]) -> Array:
        there, push = args
        moved = period_map(there, integrator, push, tuple(scaled * scale), turns=turns)
        return jnp.stack(moved) / scale - scaled

    frozen, held = jax.lax.stop_gradient((model, drive))
    begin = jax.lax.stop_gradient(start / scale)
    near = optx.root_find(open_end, solver, begin, (frozen, held), max_steps=50, throw=False).value
    path = trajectory(frozen, integrator, held, tuple(near * scale), turns=turns)
    crossings = find_crossings(frozen, path, 2.0 * math.pi * turns, places)
    least = max(FEWEST_STEPS, integrator.steps_a_period(model) // (places + 1))
    sizes = kink_scale(frozen, path, crossings)
    equations = _Equations(method, Split(scale, crossings, sizes, jnp.asarray(least), crossings.complete))
    first = jnp.concatenate([near, crossings.phases])
    counts = jnp.array([least, 2 * least])
    _, (trials, _) = equations.matrices(first, frozen, held, counts, jnp.zeros(2, bool))
    goal = integrator.multiplier_tolerance
    steps = jax.lax.stop_gradient(steps_wanted(least, trials, goal, doublings=1, most=_MOST_STEPS_A_PIECE))
    args = (frozen, held, steps)
    root = optx.root_find(equations.gap, solver, first, args, max_steps=20, throw=False).value
    # The first two steps, with the live model and a frozen Jacobian, change nothing but derivatives, which
    # become those of the implicit function: each step puts one order right. optimistix's own implicit
    # derivative raises an error where the search failed, but a lane of a batch must not stop the others.
    counts = jnp.stack([steps, steps, steps, steps // 2])
    final, (transitions, left) = equations.matrices(root, model, drive, counts, jnp.arange(4) < 2)
    transition, mismatch = transitions[2], left[2]
    error = jnp.max(jnp.abs(transition - transitions[3])) / 15.0
    found = jnp.isfinite(mismatch) & (mismatch < integrator.residual_tolerance)
    return ShootingSolution(
        final[: scale.size] * scale,
        scale[:, None] * transition / scale[None, :],
        jax.lax.stop_gradient(error),
        jax.lax.stop_gradient(mismatch),
        found,
        crossings.complete,
    )
