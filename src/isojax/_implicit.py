"""Derivatives of what a search has found, by the implicit function theorem, for every mode of JAX.

A search loops until it converges, and JAX can differentiate no such loop backwards. Nor need it: the numbers
that were found depend on the parameters through the equations that they solve. These are differentiated
forwards at the solution, which gives one dense matrix, parameters last. They are few. To multiply by a matrix
is linear, so JAX transposes it: `jax.jacfwd` and `jax.grad` use the same numbers, at any order.
"""

from collections.abc import Callable
from typing import Any, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ._small_systems import solve

Values = TypeVar("Values")

Equations = Callable[[Array, Any, Any], tuple[Array, Values]]
"""From a root, the parameters and whatever is constant: the residual, and what is wanted of the solution."""


def frozen(tree: Values) -> Values:
    """Give the same numbers without derivatives.

    Args:
        tree: any pytree.

    Returns:
        The pytree, constant to JAX.
    """
    return jax.tree.map(
        lambda leaf: jax.lax.stop_gradient(leaf) if eqx.is_inexact_array(leaf) else leaf, tree
    )


def with_derivatives(
    values: Values, equations: Equations[Values], root: Float[Array, " unknown"], live: Any, held: Any
) -> Values:
    """Give values that a search has found their derivatives by the parameters.

    With `R(u, p) = 0` and values `q(u, p)`: `dq/dp = q_p - q_u R_u^-1 R_p`. Nothing is computed unless
    somebody differentiates. Backwards costs what forwards costs: one motion more a number of `live` by which
    one differentiates.

    Args:
        values: what was found; arrays.
        equations: gives residual and values from root, `live` and `held`, differentiable forwards. It closes
            over nothing that is traced.
        root: where the residual vanishes; of length zero where the values follow without a search.
        live: the parameters; any pytree.
        held: whatever else the equations need; constant to JAX.

    Returns:
        The same values.

    Source: Blondel et al. 2022, NeurIPS 35 (implicit differentiation as one linear solve at the solution).
    """
    return _attached(frozen(values), frozen(root), live, frozen(held), equations=equations)


@eqx.filter_custom_jvp
def _attached(values: Values, root: Array, live: Any, held: Any, *, equations: Equations[Values]) -> Values:
    return values


@_attached.def_jvp
def _along(primals: tuple, tangents: tuple, *, equations: Equations) -> tuple[Any, Any]:
    values, root, live, held = primals
    tree = jax.tree.structure(live)
    directions = tree.flatten_up_to(tangents[2])
    chosen = [place for place, direction in enumerate(directions) if direction is not None]
    # Values and slopes may be differentiated again, as functions of the same parameters.
    again = _attached(values, root, live, held, equations=equations)
    if not chosen:
        return again, jax.tree.map(lambda _: None, values)

    def slopes(root: Array, live: Any, held: Any) -> tuple[Array, Any]:
        leaves, count = jax.tree.leaves(live), root.size
        own = [leaves[place] for place in chosen]

        def along(unknown: Array) -> tuple[tuple[Array, Any], Array]:
            filled, start = list(leaves), count
            for place, leaf in zip(chosen, own, strict=True):
                filled[place] = unknown[start : start + leaf.size].reshape(leaf.shape)
                start += leaf.size
            residual, wanted = equations(unknown[:count], tree.unflatten(filled), held)
            return (residual, wanted), residual

        at = jnp.concatenate([root, *(leaf.ravel() for leaf in own)])
        (bent, wanted), residual = jax.jacfwd(along, has_aux=True)(at)
        if not count:
            return residual, wanted
        change = -solve(bent[:, :count], bent[:, count:])
        return residual, jax.tree.map(lambda part: part[..., count:] + part[..., :count] @ change, wanted)

    _, matrices = slopes(root, frozen(live), held)
    matrices = _attached(frozen(matrices), root, live, held, equations=slopes)
    direction = jnp.concatenate([directions[place].ravel() for place in chosen])
    return again, jax.tree.map(lambda matrix: matrix @ direction, matrices)
