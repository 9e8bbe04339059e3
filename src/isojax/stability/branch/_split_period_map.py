"""The image of a state with the motion split at its kinks: what a bifurcation is located with."""

import math
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from ...models import Integrator
from ..orbit import Crossings, advance_in_pieces, find_crossings, state_scale, trajectory
from ._parameter_family import Setting

_FEWEST_STEPS, _MOST_STEPS = 16, 1 << 12
"""Steps a piece of the coarsest trial, and at most; of several drive periods so many times more."""


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
    setting: Setting, integrator: Integrator, turns: float, split: Split, unknown: Float[Array, " unknown"]
) -> tuple[Float[Array, " state"], Float[Array, " crossing"]]:
    """Give the state after `turns` periods, and how far each kink is missed.

    Args:
        setting: isolator and drive.
        integrator: the solver.
        turns: drive periods; 0.5 for minus the state after half of one.
        split: where the motion is split.
        unknown: scaled state at t = 0, then the phase of each crossing [rad].

    Returns:
        The state then over its scale, and the scaled kink functions at the crossings.
    """
    states = split.scale.shape[0]
    end = 2.0 * math.pi * turns
    sign = -1.0 if turns == 0.5 else 1.0
    phases = unknown[states:]
    meeting = split.crossings._replace(phases=phases)
    begin = tuple(unknown[:states] * split.scale)
    moved, reached = advance_in_pieces(
        setting.model, integrator, setting.drive, begin, meeting, end, split.steps
    )
    missed = jnp.where(split.crossings.kinks >= 0, reached / split.kink_scale, phases - end)
    return sign * jnp.stack(moved) / split.scale, missed


def split_jacobian(
    setting: Setting, integrator: Integrator, turns: float, split: Split, unknown: Float[Array, " unknown"]
) -> tuple[Float[Array, "state state"], Float[Array, "crossing state"]]:
    """Give the derivative of the image by the state, the instants of the kinks following along.

    Args:
        setting: isolator and drive.
        integrator: the solver.
        turns: drive periods.
        split: where the motion is split.
        unknown: scaled state at t = 0, then the phase of each crossing.

    Returns:
        The matrix in scaled units, and the derivative of the phases by the state.
    """
    states = split.scale.shape[0]
    upper, lower = jax.jacfwd(lambda u: split_image(setting, integrator, turns, split, u))(unknown)
    phases = -jnp.linalg.solve(lower[:, states:], lower[:, :states])
    return upper[:, :states] + upper[:, states:] @ phases, phases


def find_split(
    setting: Setting,
    integrator: Integrator,
    turns: float,
    state: Float[Array, " state"],
    places: int,
    tolerance: float,
) -> tuple[Split, Float[Array, " unknown"], Float[Array, "state state"], Float[Array, "crossing state"]]:
    """Find where a motion is to be split and in how many steps.

    Args:
        setting: isolator and drive.
        integrator: steps and solver.
        turns: drive periods.
        state: at t = 0, SI units.
        places: crossings to make room for.
        tolerance: error of the multipliers that the steps may leave.

    Returns:
        The split, the scaled state with the phases of the crossings, and roughly what `split_jacobian` gives.
    """
    model, drive = setting.model, setting.drive
    path = trajectory(model, integrator, drive, tuple(state), turns=turns)
    crossings = find_crossings(model, path, 2.0 * math.pi * turns, places)
    kinks = model.kinks(path)
    sizes = state_scale(kinks)[jnp.maximum(crossings.kinks, 0)] if kinks else jnp.ones(places)
    periods = math.ceil(turns)
    least = jnp.asarray(max(_FEWEST_STEPS, periods * integrator.steps_a_period(model) // (places + 1)))
    split = Split(state_scale(path), crossings, sizes, least, crossings.complete)
    unknown = jnp.concatenate([state / split.scale, crossings.phases])

    def jacobian(steps: Array) -> tuple[Array, Array]:
        return split_jacobian(setting, integrator, turns, split._replace(steps=steps), unknown)

    matrices, phases = jax.lax.map(jacobian, jnp.stack([least, 2 * least]))
    apart = jnp.max(jnp.abs(matrices[0] - matrices[1]))
    # Fourth order: sixteen times less a doubling.
    doublings = jnp.ceil(jnp.log2(apart / tolerance) / 4.0)
    wanted = least * 2.0 ** jnp.clip(jnp.where(jnp.isfinite(doublings), doublings, 0.0), 1.0, 20.0)
    split = split._replace(steps=jnp.minimum(wanted, periods * _MOST_STEPS).astype(int))
    return split, unknown, matrices[1], phases[1]
