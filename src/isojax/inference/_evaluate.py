"""A function at many points: compiled once and mapped over chunks, so that memory stays bounded."""

from collections import Counter
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._given_numbers import NoNumbersError
from .._progress import Counted, silent

_POINTS_AT_ONCE = 1024
"""Points at once: more run hardly faster, and a thousand orbits with their paths take some hundred MB."""

NOT_FINITE = "the quantity is not finite"
"""Why a point failed where nothing else says so."""

_PROGRESS_LINES = 20
"""Lines of progress where points are evaluated one by one."""


def evaluate(
    function: Callable[[Float[Array, " number"]], Any],
    points: Float[np.ndarray, "point number"],
    progress: Callable[[str], None] = silent,
) -> tuple[Any, str]:
    """Evaluate a function at many points.

    Args:
        function: of some numbers; gives an array, or a pytree of arrays. Where `jax.vmap` cannot go through
            it, it is evaluated point by point.
        points: the numbers.
        progress: receives a line a chunk.

    Returns:
        What the function gives, as NumPy arrays, point first, real numbers NaN where it raised; and what it
        raised most often, "" where it never did.

    Raises:
        NoNumbersError: if the function gives no numbers, at once.
        Exception: what the function raised, if it raised at every point.
    """
    try:
        return _mapped(function, points, progress), ""
    except NoNumbersError:
        raise
    except (jax.errors.JAXTypeError, ValueError):
        # A curve or a map refuses numbers that are traced; what else is wrong shows here as well.
        return _one_by_one(function, points, progress)


def _mapped(
    function: Callable[[Array], Any],
    points: Float[np.ndarray, "point number"],
    progress: Callable[[str], None],
) -> Any:
    mapped, lanes = jax.jit(jax.vmap(function)), min(_POINTS_AT_ONCE, len(points))
    parts: list[Any] = []
    for begin in range(0, len(points), lanes):
        some = points[begin : begin + lanes]
        # One shape for all chunks: the last is filled up with its last point.
        filled = jnp.asarray(np.pad(some, ((0, lanes - len(some)), (0, 0)), mode="edge"))
        # As NumPy arrays, so that no chunk begins, and no line is said, before the one before is done.
        parts.append(jax.tree.map(np.asarray, mapped(filled)))
        _say(begin + len(some), len(points), progress)
    return jax.tree.map(lambda *values: np.concatenate(values)[: len(points)], *parts)


def _one_by_one(
    function: Callable[[Array], Any],
    points: Float[np.ndarray, "point number"],
    progress: Callable[[str], None],
) -> tuple[Any, str]:
    given: list[Any] = []
    problems: list[Exception] = []
    for done, point in enumerate(points, 1):
        try:
            given.append(jax.tree.map(np.asarray, function(jnp.asarray(point))))
        except NoNumbersError:
            raise
        except Exception as problem:  # what a fold is asked for where there is none may raise anything
            given.append(None)
            problems.append(problem)
        if done % max(len(points) // _PROGRESS_LINES, 1) == 0:
            _say(done, len(points), progress)
    known = next((one for one in given if one is not None), None)
    if known is None:
        raise problems[0]
    lost = jax.tree.map(
        lambda value: np.full_like(value, np.nan) if value.dtype.kind == "f" else value, known
    )
    filled = [lost if one is None else one for one in given]
    reasons = Counter(f"{type(one).__name__}: {one}" for one in problems)
    reason = max(reasons, key=reasons.__getitem__, default="")
    return jax.tree.map(lambda *values: np.stack(values), *filled), reason


def _say(done: int, count: int, progress: Callable[[str], None]) -> None:
    progress(Counted(f"{done} of {count} samples", done / count))
