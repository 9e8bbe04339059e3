"""How an orbit of a map is integrated over: with how many steps, and split at which kinks."""

import math
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from ..._types import Lanes
from ...models import Integrator, Isolator, State
from ..orbit import (
    Crossings,
    PeriodicDrive,
    Sine,
    advance_across_kinks,
    event_places,
    follow_events,
    with_overtones,
)


class Lane(NamedTuple):
    """What one orbit is found from: one number each, or one lane of numbers.

    Attributes:
        state: start.
        drive: the fundamental of the drive, tau counted from the start.
        phases: where the orbit passes kinks.
        response: half the peak-to-peak displacement [m].
    """

    state: State
    drive: Sine
    phases: State
    response: Lanes


def kinks_between(sides: Float[Array, "piece kink"]) -> Int[Array, " crossing"]:
    """Give which kink is passed between one piece and the next, from the signs of all kinks on each."""
    return jnp.argmax(sides[1:] != sides[:-1], axis=1) if sides.shape[1] else jnp.zeros(0, int)


def advance(
    model: Isolator,
    integrator: Integrator,
    drive: PeriodicDrive,
    state: State,
    end: Float[Array, ""] | float,
    steps: Array,
) -> State:
    """Give the state at a phase, by steps that are split where a law jumps, but not at kinks.

    Args:
        model: the isolator.
        integrator: the solver.
        drive: the drive that acts.
        state: at phase 0.
        end: the phase, no more than a turn [rad].
        steps: over all of it.

    Returns:
        The state there.
    """
    if model.splits:
        return follow_events(model, drive, state, end, steps, 2 * event_places(model, 1.0)).end
    nothing = Crossings(jnp.zeros(0), jnp.zeros(0, int), None, jnp.array(True))
    return advance_across_kinks(model, integrator, drive, state, nothing, end, steps)[0]


class MapMethod(eqx.Module):
    """How a period is integrated over.

    Attributes:
        integrator: the solver and the tolerances.
        half: whether the half-period map is used.
        sides: signs of the kinks on each piece; None where orbits are not split.
        steps: a period; a number on the device, so that one compiled step serves for all.
    """

    integrator: Integrator
    half: bool = eqx.field(static=True)
    sides: Float[Array, "piece kink"] | None
    steps: Int[Array, ""]

    @property
    def steps_over_map(self) -> Int[Array, ""]:
        """Steps over the whole or the half of a period."""
        return (self.steps + 1) // 2 if self.half else self.steps

    def finer(self, times: int) -> "MapMethod":
        """Give the same way with more steps.

        Args:
            times: how many times as many.

        Returns:
            The method.
        """
        return MapMethod(self.integrator, self.half, self.sides, self.steps * times)

    def for_any_steps(self) -> "MapMethod":
        """Give the same way with steps that only `steps` knows, so that it compiles alike for all of them."""
        integrator = self.integrator.with_steps(Integrator().steps_per_period)
        return MapMethod(integrator, self.half, self.sides, self.steps)

    def moved(self, model: Isolator, lane: Lane) -> State:
        """Give the state one period later, or minus the state half a period later.

        Args:
            model: the isolator.
            lane: one orbit.

        Returns:
            The state.
        """
        return self.moved_past(model, lane, None)[0]

    def moved_past(
        self, model: Isolator, lane: Lane, kinks: Int[Array, " crossing"] | None
    ) -> tuple[State, Float[Array, " crossing"]]:
        """Give the state as `moved` does, and the kink functions where the orbit is said to pass them.

        Args:
            model: the isolator.
            lane: one orbit.
            kinks: which kink it passes at each phase; None where their values are of no interest.

        Returns:
            The state, and the values, zero where the phases are right.
        """
        end, drive = math.pi if self.half else 2.0 * math.pi, with_overtones(model, lane.drive)
        if self.sides is None:
            after = advance(model, self.integrator, drive, lane.state, end, self.steps_over_map)
            return (tuple(-value for value in after) if self.half else after), jnp.zeros(0)
        phases = lane.phases
        pieces = len(phases) + 1
        parts = pieces * (2 if self.half else 1)
        steps = (self.steps + parts - 1) // parts
        crossings = Crossings(
            jnp.stack(phases) if phases else jnp.zeros(0),
            jnp.full(pieces - 1, -1) if kinks is None else kinks,
            self.sides,
            jnp.array(True),
        )
        after, reached = advance_across_kinks(
            model, self.integrator, drive, lane.state, crossings, end, steps
        )
        return (tuple(-value for value in after) if self.half else after), reached
