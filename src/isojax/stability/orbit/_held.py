"""Whether dry friction holds a mass at rest under a drive that is too weak to move it."""

import math

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool

from ...models import Isolator, freeing_accelerations
from ._describing_function import rest_displacement
from ._event_path import first_sides
from ._sine import PeriodicDrive

_PHASES_OF_REST = 256
"""Instants of a drive period at which friction is asked: its peak is met within a ten-thousandth."""


def is_held(model: Isolator, drive: PeriodicDrive) -> Bool[Array, ""]:
    """Say whether dry friction holds the mass where it rests without a drive, over a whole drive period.

    Then it also rests anywhere beside, as far as friction reaches: no orbit is isolated there.

    Args:
        model: the isolator.
        drive: the drive that acts.

    Returns:
        Whether it does; never for a model without dry friction.
    """
    if not model.slides:
        return jnp.array(False)
    nothing = jnp.zeros(())
    state = (rest_displacement(model), *(nothing,) * (1 + model.internal_states))
    sides = tuple(first_sides(model, drive, state))

    def stays(phase: Array) -> Array:
        at = drive.at(drive.waves(phase))
        forward, backward = freeing_accelerations(model, state, at, sides)
        return (forward <= 0.0) & (backward >= 0.0)

    return jnp.all(jax.vmap(stays)(jnp.linspace(0.0, 2.0 * math.pi, _PHASES_OF_REST, endpoint=False)))
