"""Functions that JAX compiles quickly where they are called outside any other compiled function."""

import functools
from collections.abc import Callable, Mapping
from typing import Any

import equinox as eqx
import jax
import numpy as np
from jax.core import Tracer

from ._compiling import quick_options


def quick_jit(function: Callable[..., Any], options: Mapping[str, Any] | None = None) -> Callable[..., Any]:
    """Give a function that is compiled on its first call, without XLA's fusion emitters.

    It is `eqx.filter_jit` with compiler options for this function alone, so that no flag of the process is
    set. XLA takes options only of what is compiled by itself: inside another compiled function this is plain
    `eqx.filter_jit`.

    Args:
        function: what is compiled.
        options: further options of the compiler.

    Returns:
        The compiled function.
    """
    inside = eqx.filter_jit(function)
    chosen: dict[str, Any] = {**quick_options(), **(options or {})}
    alone = eqx.filter_jit(function, compiler_options=chosen) if chosen else inside  # pyright: ignore[reportCallIssue]

    @functools.wraps(function)
    def called(*arguments: Any, **named: Any) -> Any:
        leaves = jax.tree.leaves((arguments, named))
        by_itself = not _is_being_compiled() and all(map(_is_known_or_forward, leaves))
        return (alone if by_itself else inside)(*arguments, **named)

    return called


def _is_being_compiled() -> bool:
    """Whether a caller is being traced in order to be compiled: then even numbers that are known are traced,
    which they are not where a caller is only differentiated or mapped.
    """
    return isinstance(jax.lax.neg(np.float32(1.0)), Tracer)


def _is_known_or_forward(leaf: Any) -> bool:
    """Whether a number is known, or is only mapped or differentiated forwards.

    Backwards, JAX keeps the function for later inside a compiled one.
    """
    if not isinstance(leaf, Tracer):
        return True
    kind = type(leaf).__name__
    held = {"JVPTracer": ("primal", "tangent"), "BatchTracer": ("val",)}.get(kind, ())
    return bool(held) and all(_is_known_or_forward(getattr(leaf, name, leaf)) for name in held)
