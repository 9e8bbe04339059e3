"""The extended equations of a bifurcation: the motion closes and a multiplier turns critical."""

import math
from collections.abc import Callable
from typing import Literal, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import optimistix as optx
from jaxtyping import Array, Bool, Float

from ..orbit import ShootingMethod, Split, find_split, split_image, split_jacobian
from ._parameter_family import ParameterFamily

BifurcationKind = Literal["fold", "period_doubling", "neimark_sacker", "symmetry_breaking"]

CRITICAL: dict[str, float] = {"fold": 1.0, "period_doubling": -1.0, "symmetry_breaking": -1.0}
"""The real multiplier that turns critical, of the half-period map for a broken symmetry."""

_SPLIT_ERROR = 1e-10
"""Error of the multipliers to which the motion is split: a fold force follows to a hundredth of that."""

MOST_PLACES = 1000
"""Crossings of kinks in a motion beyond which no more room is made."""

_STRAYED = 0.02
"""Distance from the located start, as a share of a parameter's range, beyond which a point is another one."""


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
        mismatch: residual of the equations.
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


class PointGuess(NamedTuple):
    """A start of the search for a bifurcation.

    Attributes:
        state: at t = 0, SI units.
        shares: parameters, as shares of their ranges.
        plane: for two parameters, the normal of a plane across the curve over (scaled state, direction,
            shares), the scale of its states, and the direction at the start.
    """

    state: Float[Array, " state"]
    shares: Float[Array, " parameter"]
    plane: tuple[Float[Array, " unknown"], Float[Array, " state"], Float[Array, " state"]] | None = None


class _Motion(NamedTuple):
    """The motion of a guess, split at its kinks.

    Attributes:
        method: how the orbit is closed.
        split: where the motion is split.
        unknown: its scaled state, then the phases of its crossings.
        matrix: derivative of the map.
        phases: derivative of the phases by the state.
    """

    method: ShootingMethod
    split: Split
    unknown: Float[Array, " unknown"]
    matrix: Float[Array, "state state"]
    phases: Float[Array, "crossing state"]

    def lift(self, direction: Array) -> Array:
        """Give a direction of the state together with the change of the phases that goes with it."""
        return jnp.concatenate([direction, self.phases @ direction])

    def stretched(
        self, at: ParameterFamily, place: Array, where: Array, along: Array
    ) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
        """Give the image of a place, and the derivative of the image along a direction."""
        setting = at.at(where)

        def image(u: Array) -> tuple[Array, Array]:
            return split_image(setting.model, self.method, setting.drive, self.split, u)

        return jax.jvp(image, (place,), (along,))


Equations = Callable[[Array, ParameterFamily], Array]


def _pair_equations(motion: _Motion, shares: Array) -> tuple[Equations, Array]:
    """Give the equations of a pair of multipliers on the unit circle, and their start."""
    states, whole = motion.matrix.shape[0], motion.unknown.shape[0]
    values, vectors = jnp.linalg.eig(motion.matrix)
    off = jnp.abs(jnp.abs(values) - 1.0) + jnp.where(jnp.imag(values) > 0.0, 0.0, jnp.inf)
    place = jnp.argmin(off)
    vector, angle = vectors[:, place], jnp.angle(values[place])
    # Turned so that its parts are perpendicular: then the functional below separates them.
    vector = vector * jnp.exp(-0.5j * jnp.angle(jnp.sum(vector**2)))
    real, imaginary = jnp.real(vector), jnp.imag(vector)
    size = jnp.dot(real, real)
    real, imaginary, functional = real / jnp.sqrt(size), imaginary / jnp.sqrt(size), real / jnp.sqrt(size)

    def equations(guess: Array, at: ParameterFamily) -> Array:
        place, one, other = guess[:whole], guess[whole : 2 * whole], guess[2 * whole : 3 * whole]
        turn, where = guess[3 * whole], guess[3 * whole + 1 :]
        (moved, missed), (first, first_missed) = motion.stretched(at, place, where, one)
        _, (second, second_missed) = motion.stretched(at, place, where, other)
        cosine, sine = jnp.cos(turn), jnp.sin(turn)
        a, b = one[:states], other[:states]
        norm = jnp.stack([functional @ a - 1.0, functional @ b])
        closed = [moved - place[:states], missed]
        pair = [first - cosine * a + sine * b, first_missed, second - sine * a - cosine * b, second_missed]
        return jnp.concatenate([*closed, *pair, norm])

    parts = [motion.unknown, motion.lift(real), motion.lift(imaginary), angle[None], shares]
    return equations, jnp.concatenate(parts)


def _real_equations(motion: _Motion, critical: float, guess: PointGuess) -> tuple[Equations, Array]:
    """Give the equations of a real critical multiplier, and their start."""
    states, whole, scale = motion.matrix.shape[0], motion.unknown.shape[0], motion.split.scale
    shares, plane = guess.shares, guess.plane
    direction = null_vector(motion.matrix - critical * jnp.eye(states))
    across = jnp.zeros(0)
    if plane is not None:
        normal, plane_scale, towards = jax.lax.stop_gradient(plane)
        towards = towards * plane_scale / scale
        direction = direction * jnp.where(jnp.dot(direction, towards) < 0.0, -1.0, 1.0)
        ratio = scale / plane_scale
        # The same plane in the scale of this motion.
        across = jnp.concatenate(
            [normal[:states] * ratio, normal[states : 2 * states] * ratio, normal[2 * states :]]
        )
        across = across / jnp.linalg.norm(across)

    def equations(guess: Array, at: ParameterFamily) -> Array:
        place, along, where = guess[:whole], guess[whole : 2 * whole], guess[2 * whole :]
        (moved, missed), (shift, shift_missed) = motion.stretched(at, place, where, along)
        parts = [
            moved - place[:states],
            missed,
            shift - critical * along[:states],
            shift_missed,
            (jnp.dot(along[:states], along[:states]) - 1.0)[None],
        ]
        if plane is not None:
            here = jnp.concatenate([place[:states], along[:states], where])
            there = jnp.concatenate([motion.unknown[:states], direction, shares])
            parts.append(jnp.dot(across, here - there)[None])
        return jnp.concatenate(parts)

    return equations, jnp.concatenate([motion.unknown, motion.lift(direction), shares])


def polish(
    family: ParameterFamily,
    method: ShootingMethod,
    kind: BifurcationKind,
    guess: PointGuess,
    places: int,
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
        method: how the orbit is closed.
        kind: which bifurcation.
        guess: start of the search.
        places: kinks a motion to make room for.
        tolerance: error of the multipliers that the integration may leave.

    Returns:
        The point.

    Source: Seydel 2010, Practical Bifurcation and Stability Analysis, sec. 5.4; Govaerts 2000, Numerical
    Methods for Bifurcations of Dynamical Equilibria, ch. 3; Kuznetsov 2004, Elements of Applied Bifurcation
    Theory, sec. 10.3.
    """
    frozen, state, shares = jax.lax.stop_gradient((family, guess.state, guess.shares))
    setting = frozen.at(shares)
    found = find_split(setting.model, method, setting.drive, state, places, tolerance)
    motion = _Motion(method, *jax.lax.stop_gradient(found))
    split, states, whole = motion.split, state.shape[0], motion.unknown.shape[0]
    if kind == "neimark_sacker":
        equations, begin = _pair_equations(motion, shares)
    else:
        equations, begin = _real_equations(motion, CRITICAL[kind], guess._replace(shares=shares))
    goal = method.integrator.orbit_tolerance
    solver = optx.Newton(rtol=goal, atol=goal)
    final = optx.root_find(equations, solver, begin, family, max_steps=20, throw=False).value
    mismatch = jnp.max(jnp.abs(equations(final, family)))
    where = final[-shares.shape[0] :]
    there = family.at(where)
    transition, _ = split_jacobian(there.model, method, there.drive, split, final[:whole])
    mismatch = jax.lax.stop_gradient(mismatch)
    bend = jnp.array(jnp.nan)
    if kind == "fold" and guess.plane is not None:
        bend = _bend(frozen, method, split, *jax.lax.stop_gradient((final, where)))
    # Newton may have gone to another bifurcation: the start was located, so the point is close by.
    near = jnp.max(jnp.abs(jax.lax.stop_gradient(where) - shares)) < _STRAYED
    return Polished(
        where,
        final[:states] * split.scale,
        split.scale[:, None] * transition / split.scale[None],
        final[whole : whole + states],
        split.scale,
        bend,
        mismatch,
        jnp.isfinite(mismatch) & (mismatch < method.integrator.residual_tolerance) & near,
        split.complete,
    )


def _bend(
    family: ParameterFamily,
    method: ShootingMethod,
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
        moved, missed = split_image(setting.model, method, setting.drive, split, u)
        return jnp.concatenate([moved - u[:states], missed])

    def slope(u: Array) -> Array:
        return jax.jvp(left, (u,), (along,))[1]

    twice = jax.jvp(slope, (place,), (along,))[1]
    functional = null_vector(jax.jacfwd(left)(place).T)
    return jnp.dot(functional, twice) / jnp.dot(functional[:states], along[:states])


polish_jitted = eqx.filter_jit(polish)


def first_places(family: ParameterFamily, states: int, turns: float) -> int:
    """Give how many crossings of kinks to make room for first."""
    return math.ceil(4 * len(family.model.kinks((jnp.zeros(()),) * states)) * turns)
