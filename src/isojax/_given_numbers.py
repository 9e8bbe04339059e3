"""Numbers that a caller, or a function of the caller, gave; or a message that says which are none."""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float, Inexact

from ._show import brief
from ._types import as_float64

_SHORT = 60
"""Letters up to which a message shows an argument as it was written."""


class NoNumbersError(ValueError):
    """A function of the caller gave no numbers: it will not at other points either."""


def refuse_not_positive(name: str, value: Any) -> None:
    """Refuse a number, or any of several, that is zero or below; a traced one passes unseen.

    Args:
        name: of the argument.
        value: what was given.

    Raises:
        ValueError: if it is.
    """
    if eqx.is_array_like(value) and not isinstance(value, Tracer) and not np.all(np.asarray(value) > 0):
        raise ValueError(f"Argument `{name}` must be positive, but is {value}.")


def given_count(name: str, value: Any, least: int = 1) -> int:
    """Give a whole number that a caller gave; 1e4 is one.

    Args:
        name: of the argument.
        value: what was given.
        least: smallest that is allowed.

    Returns:
        The number.

    Raises:
        ValueError: if it is none, or too small.
    """
    known = _real(value)
    if known is None or known.ndim or not np.isfinite(known) or known != np.round(known):
        raise ValueError(f"Argument `{name}` must be a whole number, but is {_found(value)}.")
    if known < least:
        wanted = "a positive count" if least == 1 else f"at least {least}"
        raise ValueError(f"Argument `{name}` must be {wanted}, but is {_found(value)}.")
    return int(value)


def given_number(
    name: str, value: Any, wanted: str = "be a finite number", accepts: Callable[[float], Any] = np.isfinite
) -> float:
    """Give a number that a caller gave and that the work on the host needs.

    Args:
        name: of the argument.
        value: what was given.
        wanted: what it must do, in words.
        accepts: whether a number does.

    Returns:
        The number.

    Raises:
        ValueError: if it is no number, or not a wanted one.
    """
    known = _real(value)
    if known is None or known.ndim or not accepts(float(known)):
        raise ValueError(f"Argument `{name}` must {wanted}, but is {_found(value)}.")
    return float(known)


def given_chance(name: str, value: Any, least: float = 0.0) -> float:
    """Give a chance that a caller gave, such as the confidence of an interval.

    Args:
        name: of the argument.
        value: what was given.
        least: above which it must lie; below 1 it must anyway.

    Returns:
        The chance.

    Raises:
        ValueError: if it is none.
    """
    return given_number(name, value, f"lie between {least:g} and 1", lambda one: least < one < 1.0)


def given_numbers(
    name: str, values: Any, wanted: str, accepts: Callable[[float], Any]
) -> Float[np.ndarray, "..."]:
    """Give the numbers that a caller gave, one or several.

    Args:
        name: of the argument.
        values: what was given.
        wanted: what they must do, in words.
        accepts: whether a number does.

    Returns:
        The numbers, at least one, in their own shape.

    Raises:
        ValueError: if these are no such numbers.
    """
    known = _real(values)
    if known is None or not known.size or not all(map(accepts, known.ravel().tolist())):
        raise ValueError(f"Argument `{name}` must {wanted}, but is {_found(values)}.")
    return known


def given_scalar(name: str, value: Any) -> Array:
    """Give one number that a caller gave and that JAX may be tracing.

    Args:
        name: of the argument.
        value: what was given; it may be NaN, which an answer then is as well.

    Returns:
        The number as float64.

    Raises:
        ValueError: if it is no real number, or several.
    """
    known = value if isinstance(value, Tracer) else _real(value)
    if known is None or known.dtype.kind not in "iuf":
        raise ValueError(f"Argument `{name}` must be one real number, but is {_found(value)}.")
    if known.ndim:
        raise ValueError(
            f"Argument `{name}` must be one real number, but has shape {known.shape}: `jax.vmap` goes over "
            "several."
        )
    return as_float64(known)


def asked_numbers(name: str, function: Callable[..., Any], *arguments: Any) -> Float[Array, "..."]:
    """Give the real numbers that a function of the caller gives, which JAX may be tracing.

    Args:
        name: of the argument that is the function.
        function: what was given.
        *arguments: of the function.

    Returns:
        The numbers; a yes or no is 1 or 0.

    Raises:
        ValueError: if it is no function, gives no real numbers, or leaves JAX on the way.
    """
    return as_numbers(name, asked(name, function, *arguments))


def asked(name: str, function: Callable[..., Any], *arguments: Any) -> Any:
    """Give what a function of the caller gives, whatever that is.

    Args:
        name: of the argument that is the function.
        function: what was given.
        *arguments: of the function.

    Returns:
        It.

    Raises:
        ValueError: if it is no function, or leaves JAX on the way.
    """
    if not callable(function):
        raise ValueError(
            f"Argument `{name}` must be a function of an isolator, such as lambda model: model['k1'], but is "
            f"{_found(function)}."
        )
    try:
        return function(*arguments)
    except jax.errors.JAXTypeError as problem:
        raise ValueError(
            f"Argument `{name}` must be differentiable by `jax.jacfwd`, but makes a traced number a plain "
            "one, as `float`, `if` and NumPy do. Use `jax.numpy` throughout."
        ) from problem


def as_numbers(name: str, given: Any, real: bool = True) -> Inexact[Array, "..."]:
    """Give what a function of the caller gave as numbers, which JAX may be tracing.

    Args:
        name: of the argument that is the function.
        given: what it gave.
        real: whether complex numbers are refused.

    Returns:
        The numbers; a yes or no is 1 or 0.

    Raises:
        NoNumbersError: if these are none, or complex though they must be real.
    """
    try:
        numbers = 1.0 * jnp.asarray(given)
    except jax.errors.JAXTypeError:
        raise
    except (TypeError, ValueError):
        raise NoNumbersError(
            f"Argument `{name}` must give a number or an array, as of jnp.stack([...]), but gave one of type "
            f"{type(given).__name__}."
        ) from None
    if real and jnp.iscomplexobj(numbers):
        raise NoNumbersError(
            f"Argument `{name}` must give real numbers, but gave complex ones. Give "
            "their moduli, as of `jnp.abs`, or their real and imaginary parts."
        )
    return numbers


def _real(value: Any) -> Float[np.ndarray, "..."] | None:
    """Give the real numbers that a value holds, in its own shape; None where it holds anything else."""
    try:
        known = np.asarray(value)
    except Exception:  # a ragged list, what JAX traces, whatever an object has against it
        return None
    return known.astype(float) if known.dtype.kind in "iuf" else None


def _found(value: Any) -> str:
    """Say what was given, as it was written where that is short."""
    plain = isinstance(value, str | bool | int | float | list | tuple | dict | None)
    return repr(value) if plain and len(repr(value)) <= _SHORT else brief(value)
