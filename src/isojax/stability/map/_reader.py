"""Orbits and multipliers read off the surface, without an integration a cell."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.sharding import NamedSharding
from jaxtyping import Array

from ._batched_newton import FOUND, Found, padded
from ._starts import Candidates, PlacedSurface, read_surface


class SurfaceReader(eqx.Module):
    """What reads the orbits of any list of candidates of a model of two states off the surface.

    Attributes:
        half: whether the surface holds the derivative of the half-period map.
        surface: the orbits over displacement and frequency, with the axes of the map.
        sharding: how a chunk is spread over devices.
    """

    half: bool = eqx.field(static=True)
    surface: PlacedSurface
    sharding: NamedSharding = eqx.field(static=True)

    @property
    def states(self) -> int:
        """Count of states of the model."""
        return 2

    def __call__(self, candidates: Candidates, size: int) -> Found:
        """Read the orbits of candidates.

        Args:
            candidates: at most `size` of them.
            size: lanes of the compiled step.

        Returns:
            Their orbits.
        """
        count = candidates.force.size
        where = jax.device_put([padded(values, size) for values in candidates[:3]], self.sharding)
        read = _read(self.surface, self.half, where)
        states, direction, phases, roots, radius, response = (np.asarray(part)[:count] for part in read)
        return Found(states, direction, phases, roots, radius, response, np.full(count, FOUND, np.int8))


# With XLA's fusion emitters: they take a fifth of a second to compile, and read in half the time.
@eqx.filter_jit
def _read(surface: PlacedSurface, half: bool, where: Any) -> tuple[Array, ...]:
    read = read_surface(surface, 2, *where)
    half_trace, determinant = read.invariants
    spread = half_trace * half_trace - determinant
    root = jnp.sqrt(jnp.abs(spread))
    real = jnp.where(spread > 0.0, jnp.where(half_trace < 0.0, -root, root), 0.0)
    imaginary = jnp.where(spread < 0.0, root, 0.0)
    first, second = (half_trace + real, imaginary), (half_trace - real, -imaginary)
    if half:
        first, second = ((x * x - y * y, 2.0 * x * y) for x, y in (first, second))
    phases = jnp.stack(read.phases, axis=-1) if read.phases else jnp.zeros((half_trace.size, 0))
    return (
        jnp.stack(read.states, axis=-1),
        jnp.stack(read.direction, axis=-1),
        phases,
        jnp.stack([jax.lax.complex(*first), jax.lax.complex(*second)], axis=-1),
        jnp.sqrt(first[0] ** 2 + first[1] ** 2),
        read.response,
    )
