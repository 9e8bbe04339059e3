"""All displacements at which a mass rests without a drive."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..._quick_jit import quick_jit
from ...models import Instant, Isolator

_RESTS_TRIED = 2000
"""Displacements to either side between which a balance of the static forces is looked for."""

_NEAREST_REST = 1e-6
"""Smallest of them over the largest."""


def rest_displacements(model: Isolator, within: float) -> Float[np.ndarray, " rest"]:
    """Give the displacements at which the mass rests without a drive, stable or not.

    Args:
        model: the isolator.
        within: largest displacement of interest, to either side [m].

    Returns:
        The displacements, ascending [m]; two closer than a half per cent may be missed.
    """
    side = within * np.geomspace(_NEAREST_REST, 1.0, _RESTS_TRIED)
    places = np.concatenate([-side[::-1], side])
    push = np.asarray(_static_accelerations(model, jnp.asarray(places)))
    before = np.flatnonzero((push[:-1] > 0.0) != (push[1:] > 0.0))
    low, high = places[before], places[before + 1]
    # On a grid this close the force is all but straight.
    return low - push[before] * (high - low) / (push[before + 1] - push[before])


@quick_jit
def _static_accelerations(model: Isolator, places: Array) -> Array:
    def at(x: Array) -> Array:
        state = (x, *(0.0 * x,) * (1 + model.internal_states))
        return model.acceleration(state, Instant(jnp.zeros_like(x)))

    return jax.vmap(at)(places)
