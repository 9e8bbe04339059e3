"""Whether a model answers half a period of its drive with minus the motion of the other half."""

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float

from ..._parameters import list_parameters, replace_parameters
from ..._quick_jit import quick_jit
from ...models import Instant, Isolator

_SIZES = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2)
"""Displacements at which oddness is tried [m]: an even term shows at one of them or nowhere that matters."""


@quick_jit
def _defects(
    model: Isolator, states: Float[Array, "state trial"], drive: Float[Array, " trial"]
) -> tuple[Array, Array]:
    values = [jnp.asarray(entry.value, dtype=float) for entry in list_parameters(model)]

    def rates(numbers: list[Array], sign: float) -> Array:
        there = replace_parameters(model, numbers)
        return jnp.stack(there.rates(tuple(sign * states), Instant(sign * drive, sign * 0.3 * drive)))

    def both(numbers: list[Array]) -> tuple[Array, Array]:
        forth = rates(numbers, 1.0)
        return forth + rates(numbers, -1.0), forth

    slopes = jax.jacfwd(both)(values)
    pairs = [both(values), *zip(*slopes, strict=True)]
    return jnp.stack([defect for defect, _ in pairs]), jnp.stack([size for _, size in pairs])


def is_odd(model: Isolator) -> bool:
    """Say whether `z -> -z`, `F -> -F` leaves the equations as they are, whatever the coefficients.

    The drive, with the harmonics that elements add to a sine, must turn its sign after half a period.

    The second half matters where derivatives are taken: an even spring whose coefficient happens to be zero
    leaves the equations odd, but the derivative by it is not.

    Args:
        model: the isolator.

    Returns:
        True if symmetric orbits may be sought with the half-period map; False for a model whose numbers are
        being traced, of which nothing can be said.
    """
    if any(isinstance(entry.value, Tracer) for entry in list_parameters(model)):
        return False
    if any(float(one.order) % 2.0 != 1.0 for one in model.harmonics):
        # An even harmonic is the same half a period later; an odd one turns with the drive.
        return False
    random = np.random.default_rng(20)
    size = 2 + model.internal_states
    typical = np.array([1.0, 30.0] + [1.0] * (size - 2))
    states = np.outer(typical, _SIZES) * random.standard_normal((size, len(_SIZES)))
    defects, sizes = _defects(model, jnp.asarray(states), jnp.asarray(random.standard_normal(len(_SIZES))))
    return bool(jnp.all(jnp.abs(defects) <= 1e-12 * jnp.abs(sizes)))
