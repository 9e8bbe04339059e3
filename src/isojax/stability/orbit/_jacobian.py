"""A function's value beside its derivative, computed once for both."""

from collections.abc import Callable
from typing import TypeVar

import jax
from jaxtyping import Array, Float

Value = TypeVar("Value")


def value_and_jacobian(
    function: Callable[[Array], Value], at: Float[Array, " unknown"]
) -> tuple[Value, Value]:
    """Give a function and its derivative by forward mode, from one trace.

    Args:
        function: gives an array, or several by name.
        at: where.

    Returns:
        The value, and its derivative with the unknown as last axis.
    """

    def twice(unknown: Array) -> tuple[Value, Value]:
        value = function(unknown)
        return value, value

    slope, value = jax.jacfwd(twice, has_aux=True)(at)
    return value, slope
