"""The extended equations of a bifurcation: the motion closes and a multiplier turns critical."""

import math
from typing import Literal, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import optimistix as optx
from jaxtyping import Array, Bool, Float

from ...models import Integrator
from ._parameter_family import Family
from ._split_period_map import Split, find_split, split_image, split_jacobian

Kind = Literal["fold", "period_doubling", "neimark_sacker", "symmetry_breaking"]

CRITICAL: dict[str, float] = {"fold": 1.0, "period_doubling": -1.0, "symmetry_breaking": -1.0}
"""The real multiplier that turns critical, of the half-period map for a broken symmetry."""

_SPLIT_ERROR = 1e-10
"""Error of the multipliers to which the motion is split: a fold force follows to a hundredth of that."""


class Polished(NamedTuple):
    """A bifurcation point.

    Attributes:
        shares: parameters, as shares of their ranges.
        state: at t = 0, SI units.
        matrix: derivative of the state after the turns by the one before, SI units.
        direction: critical direction of the state, scaled to unit length; of a pair its real part.
        scale: size of each state.
        bend: quadratic coefficient of the motion in the critical direction, `w D^2 P [W, W]` with `w W = 1`,
            on a curve of folds; zero at a cusp, NaN where it was not asked for.
        mismatch: what is left of the equations.
        found: whether the search converged.
        complete: whether every kink was split at.
    """

    shares: Float[Array, " parameter"]
    state: Float[Array, " state"]
    matrix: Float[Array, "state state"]
    direction: Float[Array, " state"]
    scale: Float[Array, " state"]
    bend: Float[Array, ""]
    mismatch: Float[Array, ""]
    found: Bool[Array, ""]
    complete: Bool[Array, ""]


def null_vector(matrix: Float[Array, "state state"]) -> Float[Array, " state"]:
    """Give the unit vector that a nearly singular matrix shortens most.

    Args:
        matrix: the matrix.

    Returns:
        The vector; its sign is arbitrary.
    """
    return jnp.linalg.svd(matrix)[2][-1]


def polish(
    family: Family,
    integrator: Integrator,
    kind: Kind,
    turns: float,
    places: int,
    state: Float[Array, " state"],
    shares: Float[Array, " parameter"],
    plane: tuple[Float[Array, " unknown"], Float[Array, " state"], Float[Array, " state"]] | None = None,
    tolerance: float = _SPLIT_ERROR,
) -> Polished:
    """Find a bifurcation next to a start, the motion split at its kinks.

    For a real multiplier the unknowns are orbit, direction W and parameter of

        `P(z, p) = z`, `D P W = mu W`, `|W| = 1`,

    for a pair on the unit circle also its angle and the imaginary part of the direction. In two parameters a
    plane across the curve closes the equations. Derivatives by the model follow from the implicit function
    theorem.

    Args:
        family: isolators and drives.
        integrator: the solver of the equation of motion, and tolerances.
        kind: which bifurcation.
        turns: drive periods of the map; 0.5 for the half-period map.
        places: kinks a motion to make room for.
        state: start of the search at t = 0, SI units.
        shares: start of the search.
        plane: for two parameters, the normal over (scaled state, direction, shares), the scale of its states
            and the direction at the start.
        tolerance: error of the multipliers that the integration may leave.

    Returns:
        The point.

    Source: Seydel 2010, Practical Bifurcation and Stability Analysis, sec. 5.4; Govaerts 2000, Numerical
    Methods for Bifurcations of Dynamical Equilibria, ch. 3; Kuznetsov 2004, Elements of Applied Bifurcation
    Theory, sec. 10.3.
    """
    frozen, state, shares = jax.lax.stop_gradient((family, state, shares))
    setting = frozen.at(shares)
    split, unknown, matrix, phases = jax.lax.stop_gradient(
        find_split(setting, integrator, turns, state, places, tolerance)
    )
    states, whole = state.shape[0], unknown.shape[0]

    def lift(direction: Array) -> Array:
        return jnp.concatenate([direction, phases @ direction])

    def stretched(
        at: Family, place: Array, where: Array, along: Array
    ) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
        return jax.jvp(lambda u: split_image(at.at(where), integrator, turns, split, u), (place,), (along,))

    if kind == "neimark_sacker":
        values, vectors = jnp.linalg.eig(matrix)
        off = jnp.abs(jnp.abs(values) - 1.0) + jnp.where(jnp.imag(values) > 0.0, 0.0, jnp.inf)
        place = jnp.argmin(off)
        vector, angle = vectors[:, place], jnp.angle(values[place])
        # Turn it so that its parts are perpendicular: then the functional below tells them apart.
        vector = vector * jnp.exp(-0.5j * jnp.angle(jnp.sum(vector**2)))
        real, imaginary = jnp.real(vector), jnp.imag(vector)
        size = jnp.dot(real, real)
        real, imaginary, functional = real / jnp.sqrt(size), imaginary / jnp.sqrt(size), real / jnp.sqrt(size)

        def equations(guess: Array, at: Family) -> Array:
            place, one, other = guess[:whole], guess[whole : 2 * whole], guess[2 * whole : 3 * whole]
            turn, where = guess[3 * whole], guess[3 * whole + 1 :]
            (moved, missed), (first, first_missed) = stretched(at, place, where, one)
            _, (second, second_missed) = stretched(at, place, where, other)
            cosine, sine = jnp.cos(turn), jnp.sin(turn)
            a, b = one[:states], other[:states]
            norm = jnp.stack([functional @ a - 1.0, functional @ b])
            closed = [moved - place[:states], missed]
            pair = [
                first - cosine * a + sine * b,
                first_missed,
                second - sine * a - cosine * b,
                second_missed,
            ]
            return jnp.concatenate([*closed, *pair, norm])

        begin = jnp.concatenate([unknown, lift(real), lift(imaginary), angle[None], shares])
    else:
        critical = CRITICAL[kind]
        direction = null_vector(matrix - critical * jnp.eye(states))
        across = jnp.zeros(0)
        if plane is not None:
            normal, plane_scale, towards = jax.lax.stop_gradient(plane)
            towards = towards * plane_scale / split.scale
            direction = direction * jnp.where(jnp.dot(direction, towards) < 0.0, -1.0, 1.0)
            ratio = split.scale / plane_scale
            # The same plane in the scale of this motion.
            across = jnp.concatenate(
                [normal[:states] * ratio, normal[states : 2 * states] * ratio, normal[2 * states :]]
            )
            across = across / jnp.linalg.norm(across)

        def equations(guess: Array, at: Family) -> Array:
            place, along, where = guess[:whole], guess[whole : 2 * whole], guess[2 * whole :]
            (moved, missed), (shift, shift_missed) = stretched(at, place, where, along)
            parts = [
                moved - place[:states],
                missed,
                shift - critical * along[:states],
                shift_missed,
                (jnp.dot(along[:states], along[:states]) - 1.0)[None],
            ]
            if plane is not None:
                here = jnp.concatenate([place[:states], along[:states], where])
                there = jnp.concatenate([unknown[:states], direction, shares])
                parts.append(jnp.dot(across, here - there)[None])
            return jnp.concatenate(parts)

        begin = jnp.concatenate([unknown, lift(direction), shares])

    goal = integrator.orbit_tolerance
    solver = optx.Newton(rtol=goal, atol=goal)
    final = optx.root_find(equations, solver, begin, family, max_steps=20, throw=False).value
    mismatch = jnp.max(jnp.abs(equations(final, family)))
    where = final[-shares.shape[0] :]
    transition, _ = split_jacobian(family.at(where), integrator, turns, split, final[:whole])
    mismatch = jax.lax.stop_gradient(mismatch)
    bend = jnp.array(jnp.nan)
    if kind == "fold" and plane is not None:
        bend = _bend(frozen, integrator, turns, split, *jax.lax.stop_gradient((final, where)))
    # Newton may have gone to another bifurcation: the start was located, so the point is close by.
    near = jnp.max(jnp.abs(jax.lax.stop_gradient(where) - shares)) < 0.02
    return Polished(
        where,
        final[:states] * split.scale,
        split.scale[:, None] * transition / split.scale[None],
        final[whole : whole + states],
        split.scale,
        bend,
        mismatch,
        jnp.isfinite(mismatch) & (mismatch < 1e3 * goal) & near,
        split.complete,
    )


def _bend(
    family: Family,
    integrator: Integrator,
    turns: float,
    split: Split,
    final: Float[Array, " extended"],
    shares: Float[Array, " parameter"],
) -> Float[Array, ""]:
    """Give the quadratic coefficient at a fold."""
    whole = split.scale.shape[0] + split.crossings.phases.shape[0]
    states = split.scale.shape[0]
    place, along = final[:whole], final[whole : 2 * whole]
    setting = family.at(shares)

    def left(u: Array) -> Array:
        moved, missed = split_image(setting, integrator, turns, split, u)
        return jnp.concatenate([moved - u[:states], missed])

    def slope(u: Array) -> Array:
        return jax.jvp(left, (u,), (along,))[1]

    twice = jax.jvp(slope, (place,), (along,))[1]
    functional = null_vector(jax.jacfwd(left)(place).T)
    return jnp.dot(functional, twice) / jnp.dot(functional[:states], along[:states])


polish_jitted = eqx.filter_jit(polish)


def first_places(family: Family, states: int, turns: float) -> int:
    """Give how many crossings of kinks to make room for first.

    Args:
        family: isolators and drives.
        states: count of states.
        turns: drive periods.

    Returns:
        Four a kink and period.
    """
    return math.ceil(4 * len(family.model.kinks((jnp.zeros(()),) * states)) * turns)
