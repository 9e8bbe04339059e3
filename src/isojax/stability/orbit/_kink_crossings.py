"""Motion split where a law is not smooth, so that fixed steps keep their order."""

from typing import NamedTuple

import diffrax
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from ..._types import Lanes
from ...models import (
    ROUNDED,
    Instant,
    Integrator,
    Isolator,
    State,
    freeing_accelerations,
    law_beside,
    sliding_switch,
)
from ._sine import PeriodicDrive, Waves


class Crossings(NamedTuple):
    """Where a motion passes switches, in order of time.

    Attributes:
        phases: tau at each crossing [rad]; unused places hold the end of the motion.
        kinks: which of the model's switches; then, one and two beyond the last, that a mass which friction
            holds is freed forward or backward; -1 in unused places.
        sides: signs of all switches before the first crossing, between two, and after the last; None where
            each state is to be taken on its own side.
        complete: whether every crossing found a place.
    """

    phases: Float[Array, " crossing"]
    kinks: Int[Array, " crossing"]
    sides: Float[Array, "piece kink"] | None
    complete: Bool[Array, ""]


def _turned(phase: Waves, turn: Waves) -> Waves:
    """Give sine and cosine of the sums of angles."""
    return tuple(
        (sine * own[1] + cosine * own[0], cosine * own[1] - sine * own[0])
        for (sine, cosine), own in zip(phase, turn, strict=True)
    )


def advance_across_kinks(
    model: Isolator,
    integrator: Integrator,
    drive: PeriodicDrive,
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
        The state at the end, and the value of the switch at each crossing, zero where the phase is right.
    """
    bounds = jnp.concatenate([jnp.zeros(1), crossings.phases, jnp.reshape(end, 1)])
    sliding = sliding_switch(model)

    def piece(carry: State, along: tuple[Array, Array, Array | None]) -> tuple[State, Lanes]:
        start, stop, sides = along
        length = (stop - start) / steps
        step_time = length / drive.angular_frequency
        law = ROUNDED if sides is None else law_beside(model, tuple(sides))
        if sides is not None and sliding >= 0:
            # What is held has no velocity, nor a derivative of it.
            carry = (carry[0], jnp.where(sides[sliding] == 0.0, 0.0, carry[1]), *carry[2:])
        turn = drive.waves(0.5 * length)

        def step(index: Array | int, here: tuple[State, Waves]) -> tuple[State, Waves]:
            state, begin = here
            # Turned from stage to stage: a sine a stage and lane would cost as much as the law.
            middle = _turned(begin, turn)
            finish = _turned(middle, turn)
            stages = [drive.at(waves) for waves in (begin, middle, finish)]

            def field(t: float, y: State, args: None) -> State:
                rates = model.rates(y, stages[round(2.0 * t)], law=law)
                return tuple(step_time * rate for rate in rates)

            term = diffrax.ODETerm(field)  # pyright: ignore[reportArgumentType]
            moved, *_ = integrator.solver.step(term, 0.0, 1.0, state, None, None, False)
            return moved, finish

        # A place that no crossing uses is a piece of no length.
        count = jnp.where(stop > start, steps, 1)
        last, _ = jax.lax.fori_loop(0, count, step, (carry, drive.waves(start)))
        return last, _events(model, last, drive.at(drive.waves(stop)), sides)

    final, values = jax.lax.scan(piece, state, (bounds[:-1], bounds[1:], crossings.sides))
    if not values.shape[1]:
        return final, jnp.zeros(crossings.phases.shape)
    # The last piece ends with the period, not with a kink.
    reached = jnp.take_along_axis(values[:-1], jnp.maximum(crossings.kinks, 0)[:, None], axis=1)[:, 0]
    return final, reached


def _events(model: Isolator, state: State, at: Instant, sides: Array | None) -> Float[Array, " event"]:
    """Give the switches, then what says whether friction lets a mass at rest go."""
    if sides is None:
        return jnp.zeros(0)
    values = (*model.switches(state), *freeing_accelerations(model, state, at, tuple(sides)))
    return jnp.stack(values) if values else jnp.zeros(0)
