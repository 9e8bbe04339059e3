"""A bifurcation found exactly: the motion, split at its kinks, closes and a multiplier turns critical."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from ..._implicit import frozen, with_derivatives
from ..._quick_jit import quick_jit
from ..._small_systems import solve
from ..._types import Scalar
from ..orbit import (
    MOST_STEPS_A_PERIOD,
    ShootingMethod,
    first_split,
    steps_wanted,
)
from ._bifurcation_system import BifurcationSystem, PointValues
from ._criticality import (
    BifurcationKind,
    null_direction,
    pair_cosine,
)
from ._parameter_family import ParameterFamily

_SPLIT_ERROR = 1e-10
"""Error of the multipliers to which the motion is split: a fold force follows to a hundredth of that."""

MOST_PLACES = 1000
"""Crossings of kinks in a motion beyond which no more room is made."""

LOCATED_WITHIN = 0.02
"""Distance from a start located on a branch, over the range of a parameter, up to which a point counts."""

MOVED_WITHIN = 1.0
"""The same for a known point that is found again: it moves with the model."""

_DIFFERENCE = 1e-4
"""Shift of an unknown for second derivatives: their error is then a hundred-millionth."""

_ZERO_WITHIN = 1e-6
"""Scaled distance along a curve to which a coefficient's zero is found. At a cusp the parameters do not move
along it to first order."""

_SECANT_FROM, _SECANT_WITHIN = 1e-5, 4.0
"""Step of the secant method from which it says how the coefficient changes, and by which factor at most."""

_TRIALS, _MOST_STEPS = 2, 22
"""Motions by which the steps are chosen, and evaluations at most, those included."""


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
        bend: of a fold the quadratic coefficient in the critical direction, `w D^2 P [W, W]` with `w W = 1`;
            of a doubling in two parameters the cubic one, see `cubic_coefficient`; NaN of others.
        cosine: see `pair_cosine`.
        found: whether the search converged.
        complete: whether every kink was split at.
    """

    final: Float[Array, " extended"]
    system: BifurcationSystem
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


def _extended(final: Array, family: ParameterFamily, system: BifurcationSystem) -> tuple[Array, PointValues]:
    return system.residual(final, family), system.values(final, family)


class PointGuess(NamedTuple):
    """A start of the search for a bifurcation.

    Attributes:
        state: at t = 0, SI units.
        shares: parameters, as shares of their ranges.
        plane: for two parameters, the normal of a plane across the curve over (scaled state, shares), and the
            scale of its states.
        cosine: for two parameters, in place of the plane, that of the angle of the pair of multipliers.
        rise: for two parameters, how the coefficient of a fold or a doubling changes along the normal of the
            plane: given, the coefficient vanishes in place of the distance from the plane. That of a fold
            counts in the critical direction on the side of the normal.
    """

    state: Float[Array, " state"]
    shares: Float[Array, " parameter"]
    plane: tuple[Float[Array, " unknown"], Float[Array, " state"]] | None = None
    cosine: Float[Array, ""] | None = None
    rise: Float[Array, ""] | None = None


def _start(
    family: ParameterFamily, method: ShootingMethod, kind: BifurcationKind, guess: PointGuess, places: int
) -> tuple[BifurcationSystem, Array]:
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
    system = BifurcationSystem(method, kind, split, across, origin, guess.cosine)
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


def _expand(system: BifurcationSystem, family: ParameterFamily, unknown: Array, right: Array) -> _Expansion:
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
    phases = -solve(lower[:, states:], lower[:, :states])
    answer = -solve(lower[:, states:].T, upper[:, states:].T).T
    right = jnp.concatenate([jnp.eye(states), phases])
    left = jnp.concatenate([jnp.eye(states), answer], axis=1)
    matrix = upper[:, :states] + upper[:, states:] @ phases
    return _Expansion(moved, slope, right, left, matrix, curved)


def _newton(
    system: BifurcationSystem, beside: _Expansion, unknown: Array, missed: Array | None
) -> tuple[Array, Array]:
    """Give the residual at a point, and the step of Newton's method from it.

    `missed` is how far along the normal the coefficient vanishes, in place of the distance from the plane.
    """
    states = system.states
    gap = beside.moved.at[:states].add(-unknown[:states])
    by_matrix = jax.jacfwd(system.tests)(beside.matrix)
    rows = jnp.einsum("tsk,sku->tu", by_matrix, beside.matrix_slope)
    closing = beside.slope.at[:states, :states].add(-jnp.eye(states))
    plane = jax.jacfwd(system.plane)(unknown)
    last = system.plane(unknown) if missed is None else missed[None]
    residual = jnp.concatenate([gap, system.tests(beside.matrix), last])
    jacobian = jnp.concatenate([closing, rows, plane])
    return residual, solve(jacobian, residual)


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
    rise: Float[Array, ""]
    ahead: Float[Array, ""]


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
    or the angle of a pair, or a coefficient that vanishes, by the secant method along the curve. One loop
    holds the motion to second order, once: two motions choose the steps, Newton's method follows, and the
    last evaluation reads the solution.

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
    states, whole = system.states, system.whole
    to_zero = guess.rise is not None
    # A step moves the coefficient in all directions: the last must be shorter than what is asked for.
    goal = 0.1 * _ZERO_WITHIN if to_zero else method.integrator.orbit_tolerance
    least, most = system.split.steps, method.periods * MOST_STEPS_A_PERIOD

    def body(search: _Search) -> _Search:
        own = eqx.tree_at(lambda one: one.split.steps, system, search.steps)
        beside = _expand(own, family, search.unknown, search.right)
        bend, rise, missed, ahead = _bend(own, beside), search.rise, None, zero
        if to_zero:
            bend = _coefficient(own, family, beside, search.unknown, bend)
            rise = _secant(search, bend)
            missed = bend / rise
            ahead = -missed
        residual, step = _newton(own, beside, search.unknown, missed)
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
            jnp.max(jnp.abs(residual[:-1] if to_zero else residual)),
            beside.matrix,
            bend,
            rise,
            jnp.where(moves, ahead, 0.0),
        )

    # All depend on the guess, so that JAX sees at once over what a batch runs: it traces the loop anew for
    # every number of which it learns that later.
    zero = 0.0 * jnp.sum(guess.shares)
    square, none, no = zero * jnp.ones((states, states)), zero.astype(int), zero > 1.0
    right = jnp.concatenate([jnp.eye(states), jnp.zeros((whole - states, states))]) + zero
    rise = zero if guess.rise is None else guess.rise + zero
    start = _Search(begin, right, least + none, square, none, no, no, zero, square, zero, rise, zero)
    end = jax.lax.while_loop(lambda search: ~search.done, body, start)
    system = eqx.tree_at(lambda one: one.split.steps, system, end.steps)
    shares, state, matrix, direction = system.read(end.unknown, end.matrix)
    # Newton may have gone to another bifurcation, or to two real multipliers one the inverse of the other.
    near = jnp.max(jnp.abs(shares - guess.shares)) < within
    good = jnp.isfinite(end.mismatch) & (end.mismatch < method.integrator.residual_tolerance) & near
    split, cosine, bend = system.split, pair_cosine(end.matrix), end.bend
    if to_zero:
        good &= jnp.abs(bend) < _ZERO_WITHIN * jnp.abs(end.rise)
    elif kind == "period_doubling" and system.across.size:
        bend = system.cubic(family, end.unknown, end.matrix)
    return Polished(
        end.unknown,
        system,
        shares,
        state,
        matrix,
        direction,
        split.scale,
        bend,
        cosine,
        good,
        split.complete,
    )


def _bend(system: BifurcationSystem, beside: _Expansion) -> Float[Array, ""]:
    """Give the quadratic coefficient at a fold."""
    if system.kind != "fold":
        return jnp.array(jnp.nan)
    singular = beside.matrix - jnp.eye(system.states)
    right, left = null_direction(singular), null_direction(singular.T)
    lifted = beside.right @ right
    twice = jnp.einsum("kcu,k,u->c", beside.curved[..., : system.whole], right, lifted)
    return jnp.dot(left @ beside.left, twice) / jnp.dot(left, right)


def _coefficient(
    system: BifurcationSystem, family: ParameterFamily, beside: _Expansion, unknown: Array, bend: Array
) -> Float[Array, ""]:
    """Give the coefficient that vanishes at a special point; of a fold with the sign of `PointGuess.rise`."""
    if system.kind == "period_doubling":
        return system.cubic(family, unknown, beside.matrix)
    right = null_direction(beside.matrix - jnp.eye(system.states))
    return bend * jnp.where(jnp.dot(right, system.across[: system.states]) < 0.0, -1.0, 1.0)


def _secant(search: _Search, bend: Array) -> Float[Array, ""]:
    """Give how the coefficient changes along the normal, by the last step where that says it."""
    moved = jnp.abs(search.ahead) > _SECANT_FROM
    rise = (bend - search.bend) / jnp.where(moved, search.ahead, 1.0)
    share = rise / search.rise
    return jnp.where(moved & (share > 1.0 / _SECANT_WITHIN) & (share < _SECANT_WITHIN), rise, search.rise)


polish_jitted = quick_jit(polish)
