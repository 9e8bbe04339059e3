"""The extended equations of a bifurcation: the motion closes and a multiplier turns critical."""

from typing import Literal, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import optimistix as optx
from jaxtyping import Array, Bool, Float

from ..._implicit import frozen, with_derivatives
from ..._types import Scalar
from ..orbit import ShootingMethod, Split, find_split, split_image, split_jacobian
from ._parameter_family import ParameterFamily

BifurcationKind = Literal["fold", "period_doubling", "neimark_sacker", "symmetry_breaking"]

CRITICAL: dict[str, float] = {"fold": 1.0, "period_doubling": -1.0, "symmetry_breaking": -1.0}
"""The real multiplier that turns critical, of the half-period map for a broken symmetry."""

_SPLIT_ERROR = 1e-10
"""Error of the multipliers to which the motion is split: a fold force follows to a hundredth of that."""

MOST_PLACES = 1000
"""Crossings of kinks in a motion beyond which no more room is made."""

LOCATED_WITHIN = 0.02
"""Distance from a start located on a branch, over the range of a parameter, up to which a point counts."""


class _System(eqx.Module):
    """The equations of a bifurcation next to a guess, the motion split at its kinks.

    Attributes:
        method: how the orbit is closed.
        kind: which bifurcation.
        split: where the motion is split.
        functional: of a pair, what fixes the size and the phase of its direction.
        across: of a real multiplier in two parameters, normal of the plane across the curve over scaled
            state, direction and shares; empty in one.
        origin: point of this plane.
    """

    method: ShootingMethod
    kind: BifurcationKind = eqx.field(static=True)
    split: Split
    functional: Float[Array, " component"]
    across: Float[Array, " unknown"]
    origin: Float[Array, " unknown"]

    @property
    def whole(self) -> int:
        """Count of states and crossings."""
        return self.split.scale.shape[0] + self.split.crossings.phases.shape[0]

    def stretched(
        self, at: ParameterFamily, place: Array, where: Array, along: Array
    ) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
        """Give the image of a place, and the derivative of the image along a direction."""
        setting = at.at(where)

        def image(u: Array) -> tuple[Array, Array]:
            return split_image(setting.model, self.method, setting.drive, self.split, u)

        return jax.jvp(image, (place,), (along,))

    def residual(self, guess: Array, at: ParameterFamily) -> Float[Array, " equation"]:
        """Give what vanishes at the bifurcation."""
        return self._of_pair(guess, at) if self.kind == "neimark_sacker" else self._of_one(guess, at)

    def _of_one(self, guess: Array, at: ParameterFamily) -> Array:
        whole, states = self.whole, self.split.scale.shape[0]
        place, along, where = guess[:whole], guess[whole : 2 * whole], guess[2 * whole :]
        (moved, missed), (shift, shift_missed) = self.stretched(at, place, where, along)
        parts = [
            moved - place[:states],
            missed,
            shift - CRITICAL[self.kind] * along[:states],
            shift_missed,
            (jnp.dot(along[:states], along[:states]) - 1.0)[None],
        ]
        if self.across.size:
            here = jnp.concatenate([place[:states], along[:states], where])
            parts.append(jnp.dot(self.across, here - self.origin)[None])
        return jnp.concatenate(parts)

    def _of_pair(self, guess: Array, at: ParameterFamily) -> Array:
        whole, states = self.whole, self.split.scale.shape[0]
        place, one, other = guess[:whole], guess[whole : 2 * whole], guess[2 * whole : 3 * whole]
        turn, where = guess[3 * whole], guess[3 * whole + 1 :]
        (moved, missed), (first, first_missed) = self.stretched(at, place, where, one)
        _, (second, second_missed) = self.stretched(at, place, where, other)
        cosine, sine = jnp.cos(turn), jnp.sin(turn)
        a, b = one[:states], other[:states]
        norm = jnp.stack([self.functional @ a - 1.0, self.functional @ b])
        closed = [moved - place[:states], missed]
        pair = [first - cosine * a + sine * b, first_missed, second - sine * a - cosine * b, second_missed]
        return jnp.concatenate([*closed, *pair, norm])

    def values(self, final: Array, at: ParameterFamily) -> "_Values":
        """Give what is wanted of the solution."""
        whole, scale = self.whole, self.split.scale
        shares = final[-at.start.shape[0] :]
        there = at.at(shares)
        matrix, _ = split_jacobian(there.model, self.method, there.drive, self.split, final[:whole])
        state, direction = final[: scale.shape[0]] * scale, final[whole : whole + scale.shape[0]]
        return shares, state, scale[:, None] * matrix / scale[None], direction


_Values = tuple[
    Float[Array, " parameter"], Float[Array, " state"], Float[Array, "state state"], Float[Array, " state"]
]


class Polished(NamedTuple):
    """A bifurcation point, without derivatives: see `moving`.

    Attributes:
        final: solution of the extended equations.
        system: these equations.
        shares: parameters, as shares of their ranges.
        state: at t = 0, SI units.
        matrix: derivative of the state after the turns by the one before, SI units.
        direction: critical direction of the state, scaled to unit length; of a pair its real part.
        scale: size of each state.
        bend: quadratic coefficient of the motion in the critical direction, `w D^2 P [W, W]` with `w W = 1`,
            on a curve of folds; zero at a cusp, NaN where it was not asked for.
        found: whether the search converged.
        complete: whether every kink was split at.
    """

    final: Float[Array, " extended"]
    system: _System
    shares: Float[Array, " parameter"]
    state: Float[Array, " state"]
    matrix: Float[Array, "state state"]
    direction: Float[Array, " state"]
    scale: Float[Array, " state"]
    bend: Float[Array, ""]
    found: Bool[Array, ""]
    complete: Bool[Array, ""]

    def moving(self, family: ParameterFamily) -> "Polished":
        """Give the same point with its derivatives by the isolators and drives.

        Args:
            family: those among which it was found.

        Returns:
            The point.
        """
        known = self.shares, self.state, self.matrix, self.direction
        shares, state, matrix, direction = with_derivatives(known, _extended, self.final, family, self.system)
        return self._replace(shares=shares, state=state, matrix=matrix, direction=direction)


def _extended(final: Array, family: ParameterFamily, system: _System) -> tuple[Array, _Values]:
    return system.residual(final, family), system.values(final, family)


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


def _pair_system(motion: _Motion, shares: Array) -> tuple[_System, Array]:
    """Give the equations of a pair of multipliers on the unit circle, and their start."""
    values, vectors = jnp.linalg.eig(motion.matrix)
    off = jnp.abs(jnp.abs(values) - 1.0) + jnp.where(jnp.imag(values) > 0.0, 0.0, jnp.inf)
    place = jnp.argmin(off)
    vector, angle = vectors[:, place], jnp.angle(values[place])
    # Turned so that its parts are perpendicular: then the functional below separates them.
    vector = vector * jnp.exp(-0.5j * jnp.angle(jnp.sum(vector**2)))
    real, imaginary = jnp.real(vector), jnp.imag(vector)
    size = jnp.dot(real, real)
    real, imaginary, functional = real / jnp.sqrt(size), imaginary / jnp.sqrt(size), real / jnp.sqrt(size)
    nothing = jnp.zeros(0)
    system = _System(motion.method, "neimark_sacker", motion.split, functional, nothing, nothing)
    parts = [motion.unknown, motion.lift(real), motion.lift(imaginary), angle[None], shares]
    return system, jnp.concatenate(parts)


def _real_system(motion: _Motion, kind: BifurcationKind, guess: PointGuess) -> tuple[_System, Array]:
    """Give the equations of a real critical multiplier, and their start."""
    states, scale = motion.matrix.shape[0], motion.split.scale
    direction = null_vector(motion.matrix - CRITICAL[kind] * jnp.eye(states))
    nothing = jnp.zeros(0)
    across, origin = nothing, nothing
    if guess.plane is not None:
        normal, plane_scale, towards = guess.plane
        towards = towards * plane_scale / scale
        direction = direction * jnp.where(jnp.dot(direction, towards) < 0.0, -1.0, 1.0)
        ratio = scale / plane_scale
        # The same plane in the scale of this motion.
        across = jnp.concatenate(
            [normal[:states] * ratio, normal[states : 2 * states] * ratio, normal[2 * states :]]
        )
        across = across / jnp.linalg.norm(across)
        origin = jnp.concatenate([motion.unknown[:states], direction, guess.shares])
    system = _System(motion.method, kind, motion.split, nothing, across, origin)
    return system, jnp.concatenate([motion.unknown, motion.lift(direction), guess.shares])


def polish(
    family: ParameterFamily,
    method: ShootingMethod,
    kind: BifurcationKind,
    guess: PointGuess,
    places: int,
    tolerance: float = _SPLIT_ERROR,
    within: Scalar | float = LOCATED_WITHIN,
) -> Polished:
    """Find a bifurcation next to a start, the motion split at its kinks.

    For a real multiplier the unknowns are orbit, direction W and parameter of

        `P(z, p) = z`, `D P W = mu W`, `|W| = 1`,

    for a pair on the unit circle also its angle and the imaginary part of the direction. In two parameters a
    plane across the curve closes the equations.

    Args:
        family: isolators and drives.
        method: how the orbit is closed.
        kind: which bifurcation.
        guess: start of the search.
        places: kinks a motion to make room for.
        tolerance: error of the multipliers that the integration may leave.
        within: distance from the start, as a share of a parameter's range, up to which the point counts.

    Returns:
        The point; `Polished.moving` gives it its derivatives.

    Source: Seydel 2010, Practical Bifurcation and Stability Analysis, sec. 5.4; Govaerts 2000, Numerical
    Methods for Bifurcations of Dynamical Equilibria, ch. 3; Kuznetsov 2004, Elements of Applied Bifurcation
    Theory, sec. 10.3.
    """
    family, guess = frozen((family, guess))
    setting = family.at(guess.shares)
    found = find_split(setting.model, method, setting.drive, guess.state, places, tolerance)
    motion = _Motion(method, *found)
    if kind == "neimark_sacker":
        system, begin = _pair_system(motion, guess.shares)
    else:
        system, begin = _real_system(motion, kind, guess)
    goal = method.integrator.orbit_tolerance
    solver = optx.Newton(rtol=goal, atol=goal)
    final = optx.root_find(system.residual, solver, begin, family, max_steps=20, throw=False).value
    mismatch = jnp.max(jnp.abs(system.residual(final, family)))
    shares, state, matrix, direction = system.values(final, family)
    bend = jnp.array(jnp.nan)
    if kind == "fold" and guess.plane is not None:
        bend = _bend(family, method, motion.split, final, shares)
    # Newton may have gone to another bifurcation.
    near = jnp.max(jnp.abs(shares - guess.shares)) < within
    good = jnp.isfinite(mismatch) & (mismatch < method.integrator.residual_tolerance) & near
    scale, complete = motion.split.scale, motion.split.complete
    return Polished(final, system, shares, state, matrix, direction, scale, bend, good, complete)


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
