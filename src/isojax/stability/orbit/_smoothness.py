"""Whether the laws of a model keep a continuous slope across their kinks."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..._quick_jit import quick_jit
from ...models import Instant, Isolator, law_beside

_STATES_TRIED = 8
"""States on each kink at which the slopes of both sides are compared."""

_SAME_SLOPE = 1e-9
"""Largest difference of the slopes, over the largest of them, that counts as rounding."""


@quick_jit
def _jumps(model: Isolator, states: Float[Array, "trial state"]) -> Float[Array, "trial kink"]:
    count = len(model.switches(tuple(states[0])))

    def kink(which: int, state: Array) -> Array:
        return model.switches(tuple(state))[which]

    def on(which: int, state: Array) -> Array:
        """Move a state onto a kink."""
        for _ in range(3):
            value, slope = jax.value_and_grad(lambda s: kink(which, s))(state)
            state = state - value * slope / jnp.sum(slope**2)
        return state

    def jump(which: int, state: Array) -> Array:
        there = on(which, state)
        signs = [jnp.where(value >= 0.0, 1.0, -1.0) for value in model.switches(tuple(there))]

        def slope(side: float) -> Array:
            law = law_beside(model, (*signs[:which], jnp.asarray(side), *signs[which + 1 :]))
            return jax.jacfwd(lambda s: jnp.stack(model.rates(tuple(s), Instant(0.0 * s[0]), law=law)))(there)

        upper, lower = slope(1.0), slope(-1.0)
        return jnp.max(jnp.abs(upper - lower) / (jnp.max(jnp.abs(upper)) + 1e-300))

    return jnp.stack([jax.vmap(lambda s, k=k: jump(k, s))(states) for k in range(count)], axis=-1)


def has_continuous_slopes(model: Isolator) -> bool:
    """Say whether the derivative of the equations by the state is continuous across every kink.

    It is of |x|x, whose second derivative alone jumps; it is not of a hysteresis that turns around, nor of
    dry friction, which itself jumps. Where it is, the instants of the kinks move nothing to first order in
    the multipliers.

    Args:
        model: the isolator, with concrete numbers.

    Returns:
        True if the slopes of both sides agree at a sample of states on each kink.
    """
    size = 2 + model.internal_states
    if model.slides:
        return False
    if not model.switches((jnp.zeros(()),) * size):
        return True
    random = np.random.default_rng(7)
    sizes = 10.0 ** random.uniform(-5.0, -3.0, (_STATES_TRIED, 1)) * np.array(
        [1.0, 30.0] + [1.0] * (size - 2)
    )
    states = jnp.asarray(sizes * random.standard_normal((_STATES_TRIED, size)))
    return bool(jnp.all(_jumps(model, states) < _SAME_SLOPE))
