"""What vanishes of a map's derivative where an orbit bifurcates: polynomials of its entries."""

from collections.abc import Callable
from typing import Literal

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from ..._implicit import frozen
from ..._small_systems import solve

BifurcationKind = Literal["fold", "period_doubling", "neimark_sacker", "symmetry_breaking"]

CRITICAL: dict[str, float] = {"fold": 1.0, "period_doubling": -1.0, "symmetry_breaking": -1.0}
"""The real multiplier that turns critical, of the half-period map for a broken symmetry."""

_SHIFT = 1e-3
"""Shift of the scaled state for second and third derivatives: their error is about a millionth."""


def criticality(kind: BifurcationKind, matrix: Float[Array, "state state"]) -> Float[Array, ""]:
    """Give what changes sign where a multiplier or a pair of them is critical.

    `det(M - mu I)` for a real one, and the product of `mu_i mu_j - 1` over all pairs, which is `det(C - I)`
    with the second compound C of M, for a pair of product one: on the unit circle, or real and one the
    inverse of the other, which bifurcates nothing.

    Args:
        kind: of the bifurcation.
        matrix: derivative of the map.

    Returns:
        The polynomial.

    Source: Kuznetsov 2004, Elements of Applied Bifurcation Theory, sec. 10.2; the compound is his bialternate
    product.
    """
    if kind == "neimark_sacker":
        compound = second_compound(matrix)
        return _determinant(compound - jnp.eye(compound.shape[0]))
    return _determinant(matrix - CRITICAL[kind] * jnp.eye(matrix.shape[0]))


def critical_values(
    matrix: Float[Array, "state state"], tangent: Float[Array, " unknown"]
) -> Float[Array, " test"]:
    """Give what changes sign where a branch bifurcates.

    The parameter's part of the tangent (fold), and the polynomials of `criticality` for a doubling, or a
    broken symmetry on the half-period map, and for a pair.

    Args:
        matrix: derivative of the map.
        tangent: along the branch, the parameter last.

    Returns:
        The three values.
    """
    others = [criticality(kind, matrix) for kind in ("period_doubling", "neimark_sacker")]
    return jnp.stack([tangent[-1], *others])


def second_compound(matrix: Float[Array, "state state"]) -> Float[Array, "pair pair"]:
    """Give the minors of order two: the matrix whose eigenvalues are the products of pairs of multipliers."""
    first, second = np.triu_indices(matrix.shape[0], 1)
    upper, lower = matrix[first], matrix[second]
    return upper[:, first] * lower[:, second] - upper[:, second] * lower[:, first]


def pair_cosine(matrix: Float[Array, "state state"]) -> Float[Array, ""]:
    """Give half the sum of the two multipliers whose product is nearest to one.

    Where the product is one it is the cosine of their angle for a pair on the unit circle, and beyond one in
    modulus for two real multipliers. Of the second compound C it is `w S v / (2 w v)`, with the null vectors
    of `C - I` and the matrix S whose eigenvalues are the sums of pairs: smooth where the pair itself meets.

    Args:
        matrix: derivative of the map.

    Returns:
        The cosine.
    """
    size = matrix.shape[0]
    if size == 2:
        return 0.5 * jnp.trace(matrix)
    first, second = np.triu_indices(size, 1)
    unit = jnp.eye(size)
    sums = sum(
        one[first][:, first] * other[second][:, second] - one[first][:, second] * other[second][:, first]
        for one, other in ((matrix, unit), (unit, matrix))
    )
    compound = second_compound(matrix) - jnp.eye(first.size)
    right, left = null_direction(compound), null_direction(compound.T)
    return 0.5 * jnp.dot(left, sums @ right) / jnp.dot(left, right)


def null_direction(matrix: Array) -> Array:
    """Give the unit vector that a nearly singular matrix takes to nothing, with its derivatives.

    From the matrix bordered by its own singular vectors, which are held fixed.

    Args:
        matrix: real or complex.

    Returns:
        The vector; its largest component is positive, so that all who ask for it get the same.

    Source: Govaerts 2000, Numerical Methods for Bifurcations of Dynamical Equilibria, ch. 3.
    """
    left, _, right = jnp.linalg.svd(frozen(matrix), full_matrices=False)
    column, row = left[:, -1], right[-1]
    size = matrix.shape[0]
    bordered = jnp.concatenate([matrix, row[None]])
    bordered = jnp.concatenate([bordered, jnp.concatenate([column, jnp.zeros(1)])[:, None]], axis=1)
    wanted = jnp.zeros(size + 1, bordered.dtype).at[-1].set(1.0)
    vector = solve(bordered, wanted)[:size]
    phase = frozen(jnp.sign(vector[jnp.argmax(jnp.abs(vector))]))
    return vector / (phase * jnp.sqrt(jnp.sum(jnp.abs(vector) ** 2)))


def critical_direction(
    kind: BifurcationKind, matrix: Float[Array, "state state"], roots: Complex[Array, " multiplier"]
) -> Float[Array, " state"]:
    """Give the direction in which an orbit loses its hold, of unit length.

    Args:
        kind: of the bifurcation.
        matrix: derivative of the map.
        roots: its multipliers.

    Returns:
        Of a real multiplier its direction; of a pair the real part, turned so that the imaginary part is
        perpendicular to it.
    """
    unit = jnp.eye(matrix.shape[0])
    if kind != "neimark_sacker":
        return null_direction(matrix - CRITICAL[kind] * unit)
    off = jnp.abs(jnp.abs(roots) - 1.0) + jnp.where(jnp.imag(roots) > 0.0, 0.0, jnp.inf)
    vector = null_direction(matrix - roots[jnp.argmin(off)] * unit)
    vector = vector * jnp.exp(-0.5j * jnp.angle(jnp.sum(vector**2)))
    real = jnp.real(vector)
    return real / jnp.linalg.norm(real)


def cubic_coefficient(
    matrix: Float[Array, "state state"],
    matrix_beside: Callable[[Float[Array, " state"]], Float[Array, "state state"]],
) -> Float[Array, ""]:
    """Give the coefficient c of a period doubling, along whose direction W the motion goes `s -> -s + c s^3`.

    `c = w (D^3 P [W, W, W] / 6 + D^2 P [W, (I - D P)^-1 D^2 P [W, W]] / 2)` with `w W = 1`. Where it is
    positive a stable orbit of twice the period takes over; where it is negative a saddle of twice the period
    stands beside the orbit as long as this is stable. Derivatives are central differences of `D P W`.

    Args:
        matrix: derivative of the map at the doubling.
        matrix_beside: gives it at a shift of the state.

    Returns:
        The coefficient, in the unit of the states.

    Source: Kuznetsov 2004, Elements of Applied Bifurcation Theory, secs. 5.4.2 and 9.3.
    """
    unit = jnp.eye(matrix.shape[0])
    right, left = null_direction(matrix + unit), null_direction((matrix + unit).T)

    def along(direction: Array, _: None) -> tuple[Array, tuple[Array, Array, Array]]:
        def moved(sign: Array) -> Array:
            return matrix_beside(sign * _SHIFT * direction) @ right

        ahead, behind = jax.vmap(moved)(jnp.array([1.0, -1.0]))
        slope, bend = (ahead - behind) / (2.0 * _SHIFT), (ahead + behind - 2.0 * matrix @ right) / _SHIFT**2
        answer = solve(unit - matrix, slope)
        size = jnp.linalg.norm(answer)
        return answer / size, (slope, bend, size)

    # One traced step serves both directions: the critical one, and what answers its square.
    _, (slopes, bends, sizes) = jax.lax.scan(along, right, None, length=2)
    whole = bends[0] / 6.0 + 0.5 * sizes[0] * slopes[1]
    return jnp.dot(left, whole) / jnp.dot(left, right)


def _determinant(matrix: Float[Array, "row row"]) -> Float[Array, ""]:
    """Give the determinant as a polynomial, whose derivatives of any order hold where it vanishes.

    Source: Faddeev & Faddeeva 1963, Computational Methods of Linear Algebra, sec. 47.
    """
    size = matrix.shape[0]
    unit = jnp.eye(size)
    part, coefficient = unit, -jnp.trace(matrix)
    for order in range(2, size + 1):
        part = matrix @ part + coefficient * unit
        coefficient = -jnp.trace(matrix @ part) / order
    return coefficient * (-1.0) ** size
