"""Array types shared by every floor, and the check that arrays are float64."""

from typing import TYPE_CHECKING, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

if TYPE_CHECKING:
    Scalar: TypeAlias = Array | float
else:
    Scalar = Float[Array, ""]
"""A number on the device: zero-dimensional, floating point. Constructors also take a plain number and convert
it, which is what the other branch declares to a type checker."""

Lanes: TypeAlias = Float[Array, "..."]
"""A state or signal value; any leading shape, so that one law serves one orbit or a batch of records."""

Internal: TypeAlias = tuple[Lanes, ...]
"""Internal states of an element, one array each (a tuple, not a stack: see CONTRIBUTING, "Why tuples")."""


def as_float64(value: object) -> Array:
    """Give `value` as a float64 array.

    Args:
        value: number or array; tracers and arbitrary pytree placeholders pass unchanged.

    Returns:
        The same value as float64 (float32 where 64-bit mode is off, which entry points refuse:
        `check_float64`).
    """
    if isinstance(value, int | float) or hasattr(value, "dtype"):
        return jnp.asarray(value, dtype=jnp.result_type(float))
    return value  # type: ignore[return-value]  # jax passes sentinels through pytrees


def on_device(values: np.ndarray) -> Array:
    """Give an array of NumPy to JAX as it is; `jnp.asarray` compiles a program for each shape."""
    return jax.device_put(values)


def check_float64() -> None:
    """Refuse to work in single precision.

    Raises:
        RuntimeError: if JAX's 64-bit mode is off. A stiffness of 1e6 beside a cubic coefficient of 1e11
            loses all meaning in float32, so no entry point goes on silently.
    """
    if not jax.config.jax_enable_x64:  # pyright: ignore[reportAttributeAccessIssue]
        raise RuntimeError(
            "isojax computes in float64, but JAX's 64-bit mode is off. Put these two lines first:\n"
            "    import jax\n"
            '    jax.config.update("jax_enable_x64", True)'
        )
