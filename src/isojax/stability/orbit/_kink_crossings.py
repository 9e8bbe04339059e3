"""Motion split where a law is not smooth, so that fixed steps keep their order."""

from typing import NamedTuple

import diffrax
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from ..._types import Lanes
from ...models import ROUNDED, ContinuedLaw, Integrator, Isolator, State
from ._sine import Sine


class Crossings(NamedTuple):
    """Where a motion passes kinks, in order of time.

    Attributes:
        phases: tau at each crossing [rad]; unused places hold the end of the motion.
        kinks: which of the model's kinks; -1 in unused places.
        sides: signs of all kinks before the first crossing, between two, and after the last; None where each
            state is to be taken on its own side.
        complete: whether every crossing found a place.
    """

    phases: Float[Array, " crossing"]
    kinks: Int[Array, " crossing"]
    sides: Float[Array, "piece kink"] | None
    complete: Bool[Array, ""]


def find_crossings(model: Isolator, path: State, end: float, places: int) -> Crossings:
    """Find where a sampled motion passes the kinks of a model.

    Args:
        model: the isolator.
        path: states at equidistant phases from 0 to `end`, time first.
        end: last phase [rad].
        places: crossings to make room for.

    Returns:
        The crossings, by linear interpolation between samples.
    """
    values = jnp.stack(model.kinks(path), axis=-1) if model.kinks(path) else jnp.zeros((path[0].size, 0))
    samples, kinks = values.shape
    signs = jnp.where(values >= 0.0, 1.0, -1.0)
    if not kinks:
        nothing = jnp.full(places, end), jnp.full(places, -1)
        return Crossings(*nothing, jnp.zeros((places + 1, 0)), jnp.array(True))
    crossed = signs[:-1] != signs[1:]
    before, kink = jnp.nonzero(crossed, size=places, fill_value=samples)
    used = before < samples
    row, column = jnp.minimum(before, samples - 2), jnp.where(used, kink, 0)
    left, right = values[row, column], values[row + 1, column]
    share = left / jnp.where(left == right, 1.0, left - right)
    phases = jnp.where(used, (row + share) * (end / (samples - 1)), end)
    order = jnp.argsort(phases)
    phases, kink = phases[order], jnp.where(used, column, -1)[order]
    turns = jnp.where(kink[:, None] == jnp.arange(kinks)[None], -1.0, 1.0)
    sides = jnp.concatenate([signs[:1], signs[:1] * jnp.cumprod(turns, axis=0)])
    return Crossings(phases, kink, sides, jnp.sum(crossed) <= places)


def _turned(angle: tuple[Lanes, Lanes], turn: tuple[Lanes, Lanes]) -> tuple[Lanes, Lanes]:
    """Give sine and cosine of the sum of two angles."""
    return angle[0] * turn[1] + angle[1] * turn[0], angle[1] * turn[1] - angle[0] * turn[0]


def advance_across_kinks(
    model: Isolator,
    integrator: Integrator,
    drive: Sine,
    state: State,
    crossings: Crossings,
    end: Lanes | float,
    steps: Int[Array, ""] | int,
) -> tuple[State, Float[Array, " crossing"]]:
    """Advance the state from phase 0 to `end`, each piece with the smooth law of its side.

    Args:
        model: the isolator.
        integrator: the solver.
        drive: the drive that acts.
        state: state at phase 0.
        crossings: where the pieces meet.
        end: phase at the end [rad].
        steps: steps a piece.

    Returns:
        The state at the end, and the value of the kink at each crossing, zero where the phase is right.
    """
    bounds = jnp.concatenate([jnp.zeros(1), crossings.phases, jnp.reshape(end, 1)])

    def piece(carry: State, along: tuple[Array, Array, Array | None]) -> tuple[State, Lanes]:
        start, stop, sides = along
        length = (stop - start) / steps
        step_time = length / drive.angular_frequency
        law = ROUNDED if sides is None else ContinuedLaw(tuple(sides))
        turn = jnp.sin(0.5 * length), jnp.cos(0.5 * length)

        def step(
            index: Array | int, here: tuple[State, tuple[Array, Array]]
        ) -> tuple[State, tuple[Array, Array]]:
            state, begin = here
            # Turned from stage to stage: a sine a stage and lane would cost as much as the law.
            middle = _turned(begin, turn)
            finish = _turned(middle, turn)
            stages = [drive.at(*angle) for angle in (begin, middle, finish)]

            def field(t: float, y: State, args: None) -> State:
                rates = model.rates(y, stages[round(2.0 * t)], law=law)
                return tuple(step_time * rate for rate in rates)

            term = diffrax.ODETerm(field)  # pyright: ignore[reportArgumentType]
            moved, *_ = integrator.solver.step(term, 0.0, 1.0, state, None, None, False)
            return moved, finish

        last, _ = jax.lax.fori_loop(0, steps, step, (carry, (jnp.sin(start), jnp.cos(start))))
        kinks = model.kinks(last)
        return last, jnp.stack(kinks) if kinks else jnp.zeros(0)

    final, values = jax.lax.scan(piece, state, (bounds[:-1], bounds[1:], crossings.sides))
    if not values.shape[1]:
        return final, jnp.zeros(crossings.phases.shape)
    # The last piece ends with the period, not with a kink.
    reached = jnp.take_along_axis(values[:-1], jnp.maximum(crossings.kinks, 0)[:, None], axis=1)[:, 0]
    return final, reached
