"""A bifurcation found exactly: the motion, split at its kinks, closes and a multiplier turns critical."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from ..._implicit import frozen, with_derivatives
from ..._quick_jit import quick_jit
from ..._types import Scalar
from ..orbit import (
    MOST_STEPS_A_PERIOD,
    ShootingMethod,
    Split,
    first_split,
    multipliers,
    split_image,
    split_jacobian,
    steps_wanted,
)
from ._criticality import BifurcationKind, critical_direction, criticality, null_direction, pair_cosine
from ._parameter_family import ParameterFamily

_SPLIT_ERROR = 1e-10
"""Error of the multipliers to which the motion is split: a fold force follows to a hundredth of that."""

MOST_PLACES = 1000
"""Crossings of kinks in a motion beyond which no more room is made."""

LOCATED_WITHIN = 0.02
"""Distance from a start located on a branch, over the range of a parameter, up to which a point counts."""

_DIFFERENCE = 1e-4
"""Shift of an unknown for second derivatives: their error is then a hundred-millionth."""

_TRIALS, _MOST_STEPS = 2, 22
"""Motions by which the steps are chosen, and evaluations at most, those included."""


class _System(eqx.Module):
    """The equations of a bifurcation next to a guess, the motion split at its kinks.

    Attributes:
        method: how the orbit is closed.
        kind: which bifurcation.
        split: where the motion is split.
        across: in two parameters, normal of the plane across the curve over scaled state and shares; empty
            in one.
        origin: point of this plane.
        cosine: in two parameters, in place of the plane, that of the critical pair's angle; None for the
            plane.
    """

    method: ShootingMethod
    kind: BifurcationKind = eqx.field(static=True)
    split: Split
    across: Float[Array, " unknown"]
    origin: Float[Array, " unknown"]
    cosine: Float[Array, ""] | None = None

    @property
    def states(self) -> int:
        """Count of states."""
        return self.split.scale.shape[0]

    @property
    def whole(self) -> int:
        """Count of states and crossings."""
        return self.states + self.split.crossings.phases.shape[0]

    def at_cosine(self, cosine: float) -> "_System":
        """Give the equations with the angle of the critical pair in place of the plane."""
        nothing = jnp.zeros(0)
        return _System(self.method, self.kind, self.split, nothing, nothing, jnp.asarray(cosine))

    def image(self, at: ParameterFamily, unknown: Array) -> Float[Array, " component"]:
        """Give the state after the turns, and how far each kink is missed, of place and shares."""
        setting, place = at.at(unknown[self.whole :]), unknown[: self.whole]
        return jnp.concatenate(split_image(setting.model, self.method, setting.drive, self.split, place))

    def matrix(self, at: ParameterFamily, unknown: Array) -> Float[Array, "state state"]:
        """Give the derivative of the map, in scaled units."""
        setting, place = at.at(unknown[self.whole :]), unknown[: self.whole]
        return split_jacobian(setting.model, self.method, setting.drive, self.split, place)[0]

    def tests(self, matrix: Array) -> Float[Array, " equation"]:
        """Give what vanishes of the derivative of the map."""
        tests = [criticality(self.kind, matrix)]
        if self.cosine is not None:
            tests.append(pair_cosine(matrix) - self.cosine)
        return jnp.stack(tests)

    def plane(self, unknown: Array) -> Float[Array, " equation"]:
        """Give the distance from the plane across the curve, where there is one."""
        if self.cosine is not None or not self.across.size:
            return jnp.zeros(0)
        here = jnp.concatenate([unknown[: self.states], unknown[self.whole :]])
        return jnp.dot(self.across, here - self.origin)[None]

    def residual(self, unknown: Array, at: ParameterFamily) -> Float[Array, " equation"]:
        """Give what vanishes at the bifurcation."""
        moved = self.image(at, unknown)
        gap = moved.at[: self.states].add(-unknown[: self.states])
        return jnp.concatenate([gap, self.tests(self.matrix(at, unknown)), self.plane(unknown)])

    def values(self, final: Array, at: ParameterFamily) -> "_Values":
        """Give what is wanted of the solution."""
        return self.read(final, self.matrix(at, final))

    def read(self, final: Array, matrix: Array) -> "_Values":
        """Give what is wanted of the solution, from the derivative of the map in scaled units."""
        scale = self.split.scale
        direction = critical_direction(self.kind, matrix, multipliers(matrix))
        return final[self.whole :], final[: self.states] * scale, _unscaled(matrix, scale), direction


_Values = tuple[
    Float[Array, " parameter"], Float[Array, " state"], Float[Array, "state state"], Float[Array, " state"]
]


def _unscaled(matrix: Array, scale: Array) -> Array:
    return scale[:, None] * matrix / scale[None]


class Polished(NamedTuple):
    """A bifurcation point, without derivatives: see `moving`.

    Attributes:
        final: solution of the equations: scaled state, phases of the crossings, shares.
        system: these equations.
        shares: parameters, as shares of their ranges.
        state: at t = 0, SI units.
        matrix: derivative of the state after the turns by the one before, SI units.
        direction: critical direction of the state, scaled to unit length; of a pair its real part.
        scale: size of each state.
        bend: quadratic coefficient of the motion in the critical direction, `w D^2 P [W, W]` with `w W = 1`,
            of a fold; zero at a cusp, NaN of other kinds.
        cosine: see `pair_cosine`.
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
    cosine: Float[Array, ""]
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


class PointGuess(NamedTuple):
    """A start of the search for a bifurcation.

    Attributes:
        state: at t = 0, SI units.
        shares: parameters, as shares of their ranges.
        plane: for two parameters, the normal of a plane across the curve over (scaled state, shares), and the
            scale of its states.
        cosine: for two parameters, in place of the plane, that of the angle of the pair of multipliers.
    """

    state: Float[Array, " state"]
    shares: Float[Array, " parameter"]
    plane: tuple[Float[Array, " unknown"], Float[Array, " state"]] | None = None
    cosine: Float[Array, ""] | None = None


def _start(
    family: ParameterFamily, method: ShootingMethod, kind: BifurcationKind, guess: PointGuess, places: int
) -> tuple[_System, Array]:
    """Give the equations next to a guess, and the unknowns there."""
    setting = family.at(guess.shares)
    split, place = first_split(setting.model, method, setting.drive, guess.state, places)
    nothing = jnp.zeros(0)
    across, origin = nothing, nothing
    if guess.plane is not None:
        normal, plane_scale = guess.plane
        states = plane_scale.shape[0]
        # The same plane in the scale of this motion.
        across = jnp.concatenate([normal[:states] * split.scale / plane_scale, normal[states:]])
        across = across / jnp.linalg.norm(across)
        origin = jnp.concatenate([place[:states], guess.shares])
    system = _System(method, kind, split, across, origin, guess.cosine)
    return system, jnp.concatenate([place, guess.shares])


class _Expansion(NamedTuple):
    """The motion beside a point, to second order.

    Attributes:
        moved: state after the turns and misses of the kinks.
        slope: their derivative by place and shares.
        right: how states and crossings follow a change of the state: a column a state.
        left: how the image answers a change of both with the crossings following: a row a state.
        matrix: derivative of the map.
        curved: derivative by place and shares of what `slope` makes of the columns of `right`.
    """

    moved: Float[Array, " component"]
    slope: Float[Array, "component unknown"]
    right: Float[Array, "component state"]
    left: Float[Array, "state component"]
    matrix: Float[Array, "state state"]
    curved: Float[Array, "state component unknown"]

    @property
    def matrix_slope(self) -> Float[Array, "state state unknown"]:
        """Derivative of the matrix by place and shares."""
        return jnp.einsum("sc,kcu->sku", self.left, self.curved)


def _expand(system: _System, family: ParameterFamily, unknown: Array, right: Array) -> _Expansion:
    """Give the motion beside a point; `right` is that of a point nearby.

    Second derivatives are central differences of first ones: a nest of derivatives takes twice as long to
    compile, and these steer Newton's method and a test for its zero alone.
    """
    states, whole, size = system.states, system.whole, unknown.size
    units = jnp.eye(size)
    columns = jnp.concatenate([right, jnp.zeros((size - whole, states))]).T
    shifts = _DIFFERENCE * jnp.stack([units, -units], axis=1)
    beside = jnp.broadcast_to(shifts[:, :, None], (size, 2, states, size)).reshape(-1, size)
    moves = jnp.concatenate([jnp.zeros((size, size)), beside])
    places = moves + jnp.broadcast_to(unknown, moves.shape)
    along = jnp.broadcast_to(columns, (size, 2, states, size)).reshape(-1, size)

    def stretched(place: Array, direction: Array) -> tuple[Array, Array]:
        return jax.jvp(lambda u: system.image(family, u), (place,), (direction,))

    images, moves = jax.vmap(stretched)(places, jnp.concatenate([units, along]))
    moved, slope = images[0], moves[:size].T
    ahead, behind = jnp.moveaxis(moves[size:].reshape(size, 2, states, -1), 1, 0)
    curved = jnp.moveaxis((ahead - behind) / (2.0 * _DIFFERENCE), 0, -1)
    upper, lower = slope[:states, :whole], slope[states:, :whole]
    phases = -jnp.linalg.solve(lower[:, states:], lower[:, :states])
    answer = -jnp.linalg.solve(lower[:, states:].T, upper[:, states:].T).T
    right = jnp.concatenate([jnp.eye(states), phases])
    left = jnp.concatenate([jnp.eye(states), answer], axis=1)
    matrix = upper[:, :states] + upper[:, states:] @ phases
    return _Expansion(moved, slope, right, left, matrix, curved)


def _newton(system: _System, beside: _Expansion, unknown: Array) -> tuple[Array, Array]:
    """Give the residual at a point, and the step of Newton's method from it."""
    states = system.states
    gap = beside.moved.at[:states].add(-unknown[:states])
    by_matrix = jax.jacfwd(system.tests)(beside.matrix)
    rows = jnp.einsum("tsk,sku->tu", by_matrix, beside.matrix_slope)
    closing = beside.slope.at[:states, :states].add(-jnp.eye(states))
    plane = jax.jacfwd(system.plane)(unknown)
    residual = jnp.concatenate([gap, system.tests(beside.matrix), system.plane(unknown)])
    jacobian = jnp.concatenate([closing, rows, plane])
    return residual, jnp.linalg.solve(jacobian, residual)


class _Search(NamedTuple):
    """Where the search stands."""

    unknown: Float[Array, " unknown"]
    right: Float[Array, "component state"]
    steps: Int[Array, ""]
    trial: Float[Array, "state state"]
    evaluations: Int[Array, ""]
    last: Bool[Array, ""]
    done: Bool[Array, ""]
    mismatch: Float[Array, ""]
    matrix: Float[Array, "state state"]
    bend: Float[Array, ""]


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

    The unknowns are orbit and parameter of

        `P(z, p) = z`, `T(D P) = 0`

    with the polynomial T of `criticality`. In two parameters a plane across the curve closes the equations,
    or the angle of a pair. One loop holds the motion to second order, once: two motions choose the steps,
    Newton's method follows, and the last evaluation reads the solution.

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

    Source: Govaerts 2000, Numerical Methods for Bifurcations of Dynamical Equilibria, ch. 4; Kuznetsov 2004,
    Elements of Applied Bifurcation Theory, sec. 10.3.
    """
    family, guess = frozen((family, guess))
    system, begin = _start(family, method, kind, guess, places)
    states, whole, goal = system.states, system.whole, method.integrator.orbit_tolerance
    least, most = system.split.steps, method.periods * MOST_STEPS_A_PERIOD

    def body(search: _Search) -> _Search:
        own = eqx.tree_at(lambda one: one.split.steps, system, search.steps)
        beside = _expand(own, family, search.unknown, search.right)
        residual, step = _newton(own, beside, search.unknown)
        trying = search.evaluations < _TRIALS
        trials = jnp.stack([search.trial, beside.matrix])
        wanted = steps_wanted(least, trials, tolerance, doublings=0, most=most)
        steps = jnp.where(search.evaluations == 0, 2 * least, jnp.where(trying, wanted, search.steps))
        sane = jnp.all(jnp.isfinite(step))
        moves = ~trying & ~search.last & sane
        unknown = search.unknown - jnp.where(moves, step, 0.0)
        short = jnp.max(jnp.abs(step) / (1.0 + jnp.abs(unknown))) < goal
        last = ~trying & (short | ~sane | (search.evaluations >= _MOST_STEPS - 2))
        return _Search(
            unknown,
            beside.right,
            steps,
            jnp.where(trying, beside.matrix, search.trial),
            search.evaluations + 1,
            last,
            search.last | (~trying & ~sane),
            jnp.max(jnp.abs(residual)),
            beside.matrix,
            _bend(own, beside),
        )

    # All depend on the guess, so that JAX sees at once over what a batch runs: it traces the loop anew for
    # every number of which it learns that later.
    zero = 0.0 * jnp.sum(guess.shares)
    square, none, no = zero * jnp.ones((states, states)), zero.astype(int), zero > 1.0
    right = jnp.concatenate([jnp.eye(states), jnp.zeros((whole - states, states))]) + zero
    start = _Search(begin, right, least + none, square, none, no, no, zero, square, zero)
    end = jax.lax.while_loop(lambda search: ~search.done, body, start)
    system = eqx.tree_at(lambda one: one.split.steps, system, end.steps)
    shares, state, matrix, direction = system.read(end.unknown, end.matrix)
    # Newton may have gone to another bifurcation, or to two real multipliers one the inverse of the other.
    near = jnp.max(jnp.abs(shares - guess.shares)) < within
    good = jnp.isfinite(end.mismatch) & (end.mismatch < method.integrator.residual_tolerance) & near
    split, cosine = system.split, pair_cosine(end.matrix)
    return Polished(
        end.unknown,
        system,
        shares,
        state,
        matrix,
        direction,
        split.scale,
        end.bend,
        cosine,
        good,
        split.complete,
    )


def _bend(system: _System, beside: _Expansion) -> Float[Array, ""]:
    """Give the quadratic coefficient at a fold."""
    if system.kind != "fold":
        return jnp.array(jnp.nan)
    singular = beside.matrix - jnp.eye(system.states)
    right, left = null_direction(singular), null_direction(singular.T)
    lifted = beside.right @ right
    twice = jnp.einsum("kcu,k,u->c", beside.curved[..., : system.whole], right, lifted)
    return jnp.dot(left @ beside.left, twice) / jnp.dot(left, right)


polish_jitted = quick_jit(polish)
