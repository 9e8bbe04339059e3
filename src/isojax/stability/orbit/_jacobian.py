"""A function's value beside its derivative, computed once for both."""

from collections.abc import Callable
from typing import Any, TypeVar

import equinox as eqx
import jax
from jaxtyping import Array, Float

Value = TypeVar("Value")
Held = TypeVar("Held")


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


def with_matrix(function: Callable[[Array, Held], Array]) -> Callable[[Array, Held], Array]:
    """Give a function that is differentiated by its matrix, computed beside the value.

    JAX splits what a root finder linearises into a value and a linear map, each of which goes through the
    whole motion again, to run as well as to compile.

    Args:
        function: of an unknown, and of what is held fixed.

    Returns:
        The same function; its derivative, in either mode, is that by the unknown alone.
    """

    @eqx.filter_custom_jvp
    def valued(unknown: Array, held: Held) -> Array:
        return function(unknown, held)

    @valued.def_jvp
    def _(primals: tuple[Array, Held], tangents: tuple[Array, Any]) -> tuple[Array, Array]:
        (unknown, held), (moved, _) = primals, tangents
        value, matrix = value_and_jacobian(lambda at: function(at, held), unknown)
        return value, matrix @ moved

    return valued
