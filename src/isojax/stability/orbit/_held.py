"""Whether dry friction holds a mass at rest under a drive that is too weak to move it."""

import math

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool

from ...models import Isolator, freeing_accelerations
from ._describing_function import rest_displacement
from ._event_path import first_sides
from ._sine import PeriodicDrive

_BALANCED_WITHIN = 10
"""Steps of Newton's method to the place where friction holds the mass best."""

_PHASES_OF_REST = 256
"""Instants of a drive period at which friction is asked: its peak is met within a ten-thousandth."""


def is_held(model: Isolator, drive: PeriodicDrive, margin: float = 0.0) -> Bool[Array, ""]:
    """Say whether dry friction holds the mass over a whole drive period, where it holds it best.

    That is where the drive comes as near to freeing the mass forward as backward: where it rests without a
    drive, unless friction is weaker one way. Then the mass also rests anywhere beside, as far as friction
    reaches: no orbit is isolated there.

    Args:
        model: the isolator.
        drive: the drive that acts.
        margin: by how much the drive may exceed what frees the mass, as a share of its own amplitude.

    Returns:
        Whether it does; never for a model without dry friction.
    """
    if not model.slides:
        return jnp.array(False)
    nothing = jnp.zeros(())
    phases = jnp.linspace(0.0, 2.0 * math.pi, _PHASES_OF_REST, endpoint=False)

    def pushes(x: Array) -> tuple[Array, Array]:
        """Give the largest acceleration against forward friction, and the least against backward friction,
        without the margin.
        """
        state = (x, *(nothing,) * (1 + model.internal_states))
        sides = tuple(first_sides(model, drive, state))

        def at(phase: Array) -> tuple[Array, ...]:
            return freeing_accelerations(model, state, drive.at(drive.waves(phase)), sides)

        forward, backward = jax.vmap(at)(phases)
        allowed = 0.5 * margin * (jnp.max(forward) - jnp.min(forward))
        return jnp.max(forward) - allowed, jnp.min(backward) + allowed

    def improve(_: Array | int, x: Array) -> Array:
        excess, slope = jax.jvp(lambda there: sum(pushes(there), nothing), (x,), (jnp.ones(()),))
        moved = x - excess / jnp.where(slope == 0.0, 1.0, slope)
        return jnp.where(jnp.isfinite(moved) & (slope != 0.0), moved, x)

    place = jax.lax.fori_loop(0, _BALANCED_WITHIN, improve, rest_displacement(model))
    forward, backward = pushes(place)
    return (forward <= 0.0) & (backward >= 0.0)
