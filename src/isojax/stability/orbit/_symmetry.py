"""Whether a model answers half a period of its drive with minus the motion of the other half."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..._parameters import list_parameters, replace_parameters
from ..._quick_jit import quick_jit
from ...models import Instant, Isolator
from ._known_numbers import is_traced

_SIZES = np.logspace(-8.0, 3.0, 133)
"""Displacements at which oddness is tried [m], twelve a decade: a stop on one side acts at all past its gap;
what acts over less than the step between two of them shows along the motions that are found."""

_VELOCITY_OVER_DISPLACEMENT = 30.0
"""Of the states that are tried [1/s]."""

_ODD_TO = 1e-12
"""Sum of the rates on both sides, over their size, up to which they are each other's opposites."""


@quick_jit
def _both_sides(
    model: Isolator, states: Float[Array, "state trial"], drive: Float[Array, " trial"]
) -> tuple[Array, Array]:
    """Give the rates of states and their slopes by the coefficients, and those of their mirror images."""
    values = [jnp.asarray(entry.value, dtype=float) for entry in list_parameters(model)]

    def rates(numbers: list[Array], sign: float) -> Array:
        there = replace_parameters(model, numbers)
        return jnp.stack(there.rates(tuple(sign * states), Instant(sign * drive, sign * 0.3 * drive)))

    def both(numbers: list[Array]) -> tuple[Array, Array]:
        return rates(numbers, 1.0), rates(numbers, -1.0)

    slopes = jax.jacfwd(both)(values)
    pairs = [both(values), *zip(*slopes, strict=True)]
    return jnp.stack([forth for forth, _ in pairs]), jnp.stack([back for _, back in pairs])


def is_odd(model: Isolator, up_to: float | None = None) -> bool:
    """Say whether `z -> -z`, `F -> -F` leaves the equations as they are, whatever the coefficients.

    The drive, with the harmonics that elements add to a sine, must turn its sign after half a period.

    The second half matters where derivatives are taken: an even spring whose coefficient happens to be zero
    leaves the equations odd, but the derivative by it is not.

    Args:
        model: the isolator.
        up_to: largest displacement of motions, known or sought, up to which it is tried closely too [m].

    Returns:
        True if symmetric orbits may be sought with the half-period map; False for a model whose numbers are
        being traced, of which nothing can be said.
    """
    if is_traced(model):
        return False
    if any(float(one.order) % 2.0 != 1.0 for one in model.harmonics):
        # An even harmonic is the same half a period later; an odd one turns with the drive.
        return False
    random = np.random.default_rng(20)
    size = 2 + model.internal_states
    scale = np.array([1.0, _VELOCITY_OVER_DISPLACEMENT] + [1.0] * (size - 2))
    states = np.outer(scale, _SIZES) * random.standard_normal((size, _SIZES.size))
    # The displacements themselves leave no gap that a large random number could open.
    states[0] = _SIZES
    drive = random.standard_normal(_SIZES.size)
    return _turns(model, states, drive) and (up_to is None or is_odd_along(model, _closely(states, up_to)))


def is_odd_along(model: Isolator, states: Float[Array | np.ndarray, "state time"]) -> bool:
    """Say whether a model is odd at the states of a motion.

    Args:
        model: the isolator, of known numbers.
        states: along the motion; where they are not finite nothing is compared.

    Returns:
        Whether its rates at these are minus those at their mirror images, and so are their slopes.
    """
    # As many as are tried beforehand: what is compiled for these serves here as well.
    place = np.linspace(0, states.shape[1] - 1, _SIZES.size).astype(int)
    return _turns(model, np.asarray(states)[:, place], np.zeros(place.size))


def _closely(states: Float[np.ndarray, "state trial"], up_to: float) -> Float[np.ndarray, "state trial"]:
    """Give trials of equidistant displacements."""
    count = states.shape[1]
    there = np.linspace(up_to / count, up_to, count)
    return states / states[0] * there


def _turns(
    model: Isolator, states: Float[np.ndarray, "state trial"], drive: Float[np.ndarray, " trial"]
) -> bool:
    """Say whether rates and slopes change their sign with states and drive."""
    forth, back = map(np.asarray, _both_sides(model, jnp.asarray(states), jnp.asarray(drive)))
    defined = np.isfinite(forth) & np.isfinite(back)
    apart = np.abs(np.where(defined, forth + back, 0.0)) > _ODD_TO * np.abs(np.where(defined, forth, 0.0))
    return not np.any(apart | (np.isfinite(forth) != np.isfinite(back)))
