"""The laws beside the switches of a model, and whether dry friction holds its mass there."""

import jax.numpy as jnp
from jaxtyping import Array

from ._instant import Instant
from ._isolator import Isolator
from ._laws import ContinuedLaw, State, find_switches


def sliding_switch(model: Isolator) -> int:
    """Give which of the switches is the velocity, at whose zero dry friction may hold the mass; -1 if none.

    Args:
        model: the isolator.

    Returns:
        Its place among `Isolator.switches`.
    """
    rest = tuple(jnp.zeros(()) for _ in range(2 + model.internal_states))
    return find_switches(model.elements, rest).velocity if model.slides else -1


def law_beside(model: Isolator, sides: State) -> ContinuedLaw:
    """Give the laws of given sides of the switches, continued smoothly past them.

    Args:
        model: the isolator.
        sides: +1 or -1 a switch; 0 for the velocity where dry friction holds the mass.

    Returns:
        The law.
    """
    place = sliding_switch(model)
    return ContinuedLaw(sides, None if place < 0 else sides[place] == 0.0)


def freeing_accelerations(model: Isolator, state: State, at: Instant, sides: State) -> tuple[Array, ...]:
    """Give what says whether friction lets a mass at rest go.

    Args:
        model: the isolator.
        state: displacement, velocity and internal states.
        at: what acts at the instant.
        sides: of the switches.

    Returns:
        Acceleration against forward friction, which frees the mass where it is positive, and against backward
        friction, which frees it where it is negative; none of a model that does not slide.
    """
    place = sliding_switch(model)
    if place < 0:
        return ()
    one = jnp.ones_like(state[1])
    moving = ((*sides[:place], sign * one, *sides[place + 1 :]) for sign in (1.0, -1.0))
    return tuple(model.acceleration(state, at, ContinuedLaw(way)) for way in moving)
