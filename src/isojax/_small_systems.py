"""Small systems of linear equations, many at once, by Gaussian elimination in JAX itself.

`jnp.linalg.solve` calls LAPACK. JAX 0.10 shares a large batch of such calls among the threads that run the
compiled function, and waits for them on one of these threads: where as many batches as there are threads are
solved at once, each waits for ever. Systems of a few unknowns are also solved faster without LAPACK.
"""

from typing import Any

import jax
import jax.numpy as jnp
import lineax as lx
import optimistix as optx
from jaxtyping import Array, Inexact

_WRITTEN_OUT = 4
"""Unknowns up to which the elimination is written out instead of looped over."""


def solve(
    matrix: Inexact[Array, "unknown unknown"], right: Inexact[Array, "unknown ..."]
) -> Inexact[Array, "unknown ..."]:
    """Solve linear equations.

    Args:
        matrix: of the equations.
        right: right side, one or several columns.

    Returns:
        The solution; not finite where the matrix is singular.

    Source: Golub & Van Loan 2013, Matrix Computations, algorithms 3.4.1 and 3.1.2 (partial pivoting).
    """
    if not matrix.shape[0]:
        return right
    columns = right if right.ndim == 2 else right[:, None]

    def solved(matrix: Array, right: Array) -> Array:
        return _substituted(_eliminated(jnp.concatenate([matrix, right], axis=1))[0])

    # One more solution is its derivative, whatever was pivoted.
    solution = jax.lax.custom_linear_solve(
        lambda unknown: matrix @ unknown,
        columns,
        lambda _, right: solved(matrix, right),
        lambda _, right: solved(matrix.T, right),
    )
    return solution if right.ndim == 2 else solution[:, 0]


def determinant(matrix: Inexact[Array, "unknown unknown"]) -> Inexact[Array, ""]:
    """Give the determinant of a matrix.

    Args:
        matrix: the matrix.

    Returns:
        The determinant.
    """
    upper, sign = _eliminated(matrix)
    return sign * jnp.prod(jnp.diagonal(upper))


def _eliminated(wide: Inexact[Array, "unknown wide"]) -> tuple[Inexact[Array, "unknown wide"], Array]:
    """Give an upper triangle by elimination with partial pivoting, and the sign of its order of rows."""
    count = wide.shape[0]
    index = jnp.arange(count)

    def eliminate(place: Array | int, carry: tuple[Array, Array]) -> tuple[Array, Array]:
        rows, sign = carry
        size = jnp.where(index >= place, jnp.abs(rows[:, place]), -1.0)
        largest = jnp.argmax(size)
        here, there = (index == place)[:, None], (index == largest)[:, None]
        pivot = jnp.sum(jnp.where(there, rows, 0.0), axis=0)
        rows = jnp.where(here, pivot[None], jnp.where(there, rows[place][None], rows))
        share = jnp.where(index > place, rows[:, place] / pivot[place], 0.0)
        return rows - jnp.outer(share, pivot), jnp.where(largest == place, sign, -sign)

    return jax.lax.fori_loop(0, count, eliminate, (wide, jnp.ones(())), unroll=count <= _WRITTEN_OUT)


def _substituted(upper: Inexact[Array, "unknown wide"]) -> Inexact[Array, "unknown right"]:
    """Give the solution of an upper triangle with its right side."""
    count = upper.shape[0]
    triangle, right = upper[:, :count], upper[:, count:]

    def substitute(step: Array | int, solution: Array) -> Array:
        place = count - 1 - step
        rest = right[place] - triangle[place] @ solution
        return solution.at[place].set(rest / triangle[place, place])

    return jax.lax.fori_loop(0, count, substitute, jnp.zeros_like(right), unroll=count <= _WRITTEN_OUT)


class Elimination(lx.AbstractLinearSolver):
    """The same for the root finders of optimistix, of equations for one vector."""

    def init(self, operator: lx.AbstractLinearOperator, options: dict[str, Any]) -> Array:
        del options
        return operator.as_matrix()

    def compute(
        self, state: Array, vector: Array, options: dict[str, Any]
    ) -> tuple[Array, lx.RESULTS, dict[str, Any]]:
        del options
        return solve(state, vector), lx.RESULTS.successful, {}

    def transpose(self, state: Array, options: dict[str, Any]) -> tuple[Array, dict[str, Any]]:
        return state.T, options

    def conj(self, state: Array, options: dict[str, Any]) -> tuple[Array, dict[str, Any]]:
        return state, options

    def assume_full_rank(self) -> bool:
        return True


def newton(tolerance: float) -> optx.Newton:
    """Give Newton's method with this elimination.

    Args:
        tolerance: relative and absolute, of the last step.

    Returns:
        The root finder.
    """
    return optx.Newton(rtol=tolerance, atol=tolerance, linear_solver=Elimination())
