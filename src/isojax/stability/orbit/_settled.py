"""Where a motion from rest is after many drive periods: a start for orbits that no balance leads to."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from ...models import Integrator, Isolator
from ._describing_function import rest_displacement
from ._period_map import period_map
from ._sine import recorded_sine

_SETTLED_AFTER = 200.0
"""Drive periods a motion is given: with a quality factor of a hundred it is then at its orbit to 0.2 %."""


def settled(
    model: Isolator, integrator: Integrator, amplitude: Float[Array, ""], frequency: Float[Array, ""]
) -> Float[Array, " state"]:
    """Give the state at t = 0 of a drive that has acted from rest for long.

    Args:
        model: the isolator.
        integrator: steps a period.
        amplitude: of the drive [N, or m/s^2 for base excitation].
        frequency: [Hz].

    Returns:
        The state; not finite if the motion ran away.
    """
    still = jnp.zeros(())
    start = (rest_displacement(model), *(still,) * (1 + model.internal_states))
    drive = recorded_sine(model, amplitude, frequency)
    return jnp.stack(period_map(model, integrator, drive, start, turns=_SETTLED_AFTER))
