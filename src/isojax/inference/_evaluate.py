"""A function at many points: compiled once and mapped over chunks, so that memory stays bounded."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._progress import Counted, silent

_POINTS_AT_ONCE = 1024
"""Points at once: more run hardly faster, and a thousand orbits with their paths take some hundred MB."""


def evaluate(
    function: Callable[[Float[Array, " number"]], Any],
    points: Float[np.ndarray, "point number"],
    progress: Callable[[str], None] = silent,
) -> Any:
    """Evaluate a function at many points.

    Args:
        function: of some numbers; gives an array, or a pytree of arrays. Where `jax.vmap` cannot go through
            it, it is asked point by point.
        points: the numbers.
        progress: receives a line a chunk.

    Returns:
        What the function gives, as NumPy arrays, point first.
    """
    mapped, lanes = jax.jit(jax.vmap(function)), min(_POINTS_AT_ONCE, len(points))
    parts: list[Any] = []
    for begin in range(0, len(points), lanes):
        some = points[begin : begin + lanes]
        # One shape for all chunks: the last is filled up with its last point.
        filled = jnp.asarray(np.pad(some, ((0, lanes - len(some)), (0, 0)), mode="edge"))
        try:
            part = mapped(filled)
        except (jax.errors.JAXTypeError, ValueError):
            # A curve or a map refuses numbers that are traced; what else is wrong shows here as well.
            mapped = _one_by_one(function)
            part = mapped(filled)
        # As NumPy arrays, so that no chunk begins, and no line is said, before the one before is done.
        parts.append(jax.tree.map(np.asarray, part))
        done = begin + len(some)
        progress(Counted(f"{done} of {len(points)} samples", done / len(points)))
    return jax.tree.map(lambda *values: np.concatenate(values)[: len(points)], *parts)


def _one_by_one(function: Callable[[Array], Any]) -> Callable[[Array], Any]:
    """Give a function that asks another point by point and stacks what it gives."""

    def mapped(points: Float[Array, "point number"]) -> Any:
        given = [function(point) for point in points]
        return jax.tree.map(lambda *values: np.stack([np.asarray(value) for value in values]), *given)

    return mapped
