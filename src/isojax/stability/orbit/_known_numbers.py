"""Refusing what hides its numbers, where the shape of an answer depends on them."""

import jax
from jax.core import Tracer

from ..._implicit import frozen


def is_traced(values: object) -> bool:
    """Say whether JAX traces or differentiates a number of a pytree.

    Args:
        values: the pytree.

    Returns:
        Whether it does any.
    """
    return any(isinstance(leaf, Tracer) for leaf in jax.tree.leaves(values))


def refuse_traced(*values: object) -> None:
    """Refuse to work under a transformation that hides the numbers.

    Args:
        *values: pytrees whose numbers must be known.

    Raises:
        ValueError: if a number is known to no one yet, as under `jax.jit` or `jax.vmap`.
    """
    if is_traced(frozen(values)):
        raise ValueError(
            "Argument `model` must hold known numbers, because how many points a curve has depends on them, "
            "but it is being traced. Call outside jax.jit and jax.vmap (jax.jacfwd and jax.grad work); under "
            "them, `isojax.find_again` finds a known orbit, bifurcation, resonance, "
            "transmissibility or map again."
        )


def refuse_transformed(values: object, instead: str, name: str = "model") -> None:
    """Refuse numbers that JAX traces or differentiates, where an answer is put together on the host.

    Args:
        values: pytree whose numbers must be plain ones.
        instead: what to use, a sentence.
        name: of the argument.

    Raises:
        ValueError: if JAX transforms the function that this is called from.
    """
    if is_traced(values):
        raise ValueError(
            f"Argument `{name}` must hold plain numbers, because this answer is put together on the host, "
            f"but JAX is tracing or differentiating it. {instead}"
        )
