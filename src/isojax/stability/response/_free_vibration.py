"""Natural frequency over amplitude without damping and drive, by quadrature of the potential."""

import math

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..._implicit import frozen, with_derivatives
from ..._quick_jit import quick_jit
from ...models import Instant, Isolator
from ..orbit import rest_displacement

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(48)
_PLACES, _SHARES = 0.5 * (_NODES + 1.0), 0.5 * _WEIGHTS
"""Gauss's nodes and weights on [0, 1]."""

_BISECTIONS = 60
"""Halvings of the interval in which the other turning point lies: as far as float64 goes."""

_MET = 1e-9
"""Largest difference of the potential between the turning points, as a share of it."""

_ALIKE = 1e-12
"""The same for a spring that pulls alike to both sides, whose other turning point is known."""

_PLACES_TRIED = 513
"""Places tried for the other turning point."""

_WIDEST = 8.0
"""Largest distance of the other turning point from rest, over the amplitude."""


@quick_jit
def natural_frequencies(model: Isolator, amplitudes: Float[Array, " point"]) -> Float[Array, " point"]:
    """Give the frequency of free, undamped vibration.

    `T = 2 int dx / sqrt(2 (U(A) - U(x)))` between the turning points, U the potential energy over the mass;
    each side of rest by itself, since laws of |x| have their kink there, with `x = A sin(phi)` against the
    singular end.

    Args:
        model: the isolator; of its elements what they do at zero velocity, internal states zero.
        amplitudes: largest displacement over rest [m].

    Returns:
        Frequency [Hz]; NaN where the spring does not hold the motion.

    Source: Nayfeh & Mook 1979, Nonlinear Oscillations, sec. 2.1.
    """
    rest = rest_displacement(model)
    still, at_rest = frozen((model, rest))

    def quarter(end: Array) -> Array:
        """Twice the time from rest to the turning point `rest + end`."""
        phi = 0.5 * math.pi * _PLACES
        gap = 2.0 * np.sin(0.5 * (0.5 * math.pi - phi)) ** 2
        places = rest + end * (1.0 - gap)
        left = jax.vmap(lambda near: _work(model, near, rest + end))(places)
        held = jnp.all(left > 0.0)
        speed = jnp.sqrt(2.0 * jnp.where(left > 0.0, left, 1.0))
        time = math.pi * jnp.sum(_SHARES * jnp.abs(end) * np.cos(phi) / speed)
        return jnp.where(held, time, jnp.nan)

    def one(amplitude: Array) -> Array:
        energy = _work(still, at_rest, at_rest + amplitude)

        def excess(depth: Array) -> Array:
            return _work(still, at_rest, at_rest - depth) - energy

        def halve(_: Array, ends: tuple[Array, Array]) -> tuple[Array, Array]:
            low, high = ends
            middle = 0.5 * (low + high)
            above = excess(middle) > 0.0
            return jnp.where(above, low, middle), jnp.where(above, middle, high)

        # The first place that the motion comes to: beyond the crest of a softening spring lie others.
        trials = amplitude * jnp.asarray(np.linspace(0.0, _WIDEST, _PLACES_TRIED))
        first = jnp.argmax(jax.vmap(excess)(trials) > 0.0)
        begin = (trials[jnp.maximum(first - 1, 0)], trials[first])
        low, high = jax.lax.fori_loop(0, _BISECTIONS, halve, begin)
        mirrored = jnp.abs(excess(amplitude)) <= _ALIKE * jnp.abs(energy)
        found = jnp.where(mirrored, amplitude, 0.5 * (low + high))
        found = found - excess(found) / -_pull(still, at_rest - found)
        depth = with_derivatives(found, _excess, found[None], (model, rest, amplitude), None)
        met = jnp.abs(excess(found)) <= _MET * jnp.abs(energy)
        return jnp.where(met, 1.0 / (quarter(amplitude) + quarter(-depth)), jnp.nan)

    return jax.vmap(one)(amplitudes)


def _pull(model: Isolator, x: Float[Array, "..."]) -> Float[Array, "..."]:
    """Give minus the acceleration at rest at a place."""
    still = (x, jnp.zeros_like(x), *(jnp.zeros_like(x),) * model.internal_states)
    return -model.acceleration(still, Instant(jnp.zeros_like(x)))


def _work(model: Isolator, near: Float[Array, ""], far: Float[Array, ""]) -> Float[Array, ""]:
    """Give the potential at `far` over that at `near`, without the cancellation of taking both."""
    return (far - near) * jnp.sum(_SHARES * _pull(model, near + (far - near) * _PLACES))


def _excess(
    depth: Float[Array, "1"], live: tuple[Isolator, Float[Array, ""], Float[Array, ""]], held: None
) -> tuple[Float[Array, "1"], Float[Array, ""]]:
    """Give the potential at the other turning point over that at the amplitude, and its place."""
    model, rest, amplitude = live
    left = _work(model, rest, rest - depth[0]) - _work(model, rest, rest + amplitude)
    return left[None], depth[0]
