"""The period map, or its half, of a motion under dry friction, from its largest displacement.

There friction changes its direction, so that the motion has an event at its start and at its end. Where it
turns is asked for in place of its velocity at the end, which has a kink there, or is zero because friction
holds the mass.
"""

import math
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from ...models import Isolator, State, law_beside, sliding_switch
from ._event_path import first_sides, follow_events
from ._sine import PeriodicDrive
from ._split_period_map import event_places

_LAST_TURN = 0.75
"""Share of a motion after which its last turn is sought."""


class TurnedMotion(NamedTuple):
    """How a motion ends.

    Attributes:
        state: a period later, or minus the state half a period later.
        late: phase from there to where it turns, negative where it has turned before [rad].
        saltation: what the turn at its start, where there is none at its end, makes of a disturbance of the
            velocity, else 1; NaN where it rises from its start, which is no largest displacement.
    """

    state: State
    late: Float[Array, ""]
    saltation: Float[Array, ""]


def turning_map(
    model: Isolator, drive: PeriodicDrive, state: State, half: bool, steps: Int[Array, ""] | int
) -> TurnedMotion:
    """Follow a motion from its largest displacement until it is there again, or at minus it.

    Args:
        model: the isolator, with dry friction.
        drive: the drive that acts, tau counted from the start.
        state: at the start; its velocity is zero.
        half: whether for half a period.
        steps: at least.

    Returns:
        Its end.

    Source: Filippov 1988, sec. 15; Aizerman & Gantmakher 1958 (what a turn makes of a disturbance).
    """
    end, place = math.pi if half else 2.0 * math.pi, sliding_switch(model)
    motion = follow_events(model, drive, state, end, steps, event_places(model, 1.0))
    kinks, phases, sides = motion.crossings.kinks, motion.crossings.phases, motion.crossings.sides
    assert sides is not None
    turns = (kinks == place) & (phases > _LAST_TURN * end)
    last = law_beside(model, tuple(sides[-1]))
    slows = model.acceleration(motion.end, drive.at(drive.waves(jnp.asarray(end))), last)
    ahead = -motion.end[1] * drive.angular_frequency / jax.lax.stop_gradient(slows)
    late = jnp.where(jnp.any(turns), jnp.max(jnp.where(turns, phases, 0.0)) - end, ahead)
    # Before the start it rose. In time a turn multiplies a disturbance of the velocity by the ratio of the
    # accelerations after and before it.
    begin, at = first_sides(model, drive, state), drive.at(drive.waves(jnp.zeros(())))
    after, before = (
        model.acceleration(state, at, law_beside(model, tuple(own)))
        for own in (begin, begin.at[place].set(1.0))
    )
    saltation = jnp.where(jnp.any(turns), 1.0, after / before)
    moved = tuple(-value for value in motion.end) if half else motion.end
    return TurnedMotion(moved, late, jnp.where(begin[place] <= 0.0, saltation, jnp.nan))
