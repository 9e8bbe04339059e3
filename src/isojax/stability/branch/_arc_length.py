"""Following a curve of solutions by pseudo-arc-length: past folds, where the parameter turns back."""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from ..._small_systems import solve
from ..orbit import value_and_jacobian

_TOLERANCE = 1e-8
"""Largest step of Newton's method after which a point counts as found, in scaled unknowns: at a kink of the
law Newton may stall below it."""

_PATIENCE, _FIRST_PATIENCE = 7, 30
"""Steps of Newton's method for a point before a shorter step is tried, and for the first point."""

_SHORTEST_STEP = 1e-5
"""Smallest step along the curve, over the largest."""

_ANGLE = 0.25
"""Turn of the tangent between two points that counts as large [rad]; twice of it is refused."""

_CLOSES_FROM, _CLOSES_WITHIN = 5, 0.2
"""Points after which a curve may close, and the distance of its first point from a step, over the step, below
which it does."""

_RAN_OUT, REACHED_BOUND, RETURNED, STALLED, NEVER_STARTED, _TURNED, HELD, STIFF = range(8)
"""Why a curve ends: out of points, on a bound, back at its first point, no step short enough, no first
point, past its first turn, where dry friction holds the mass, where a state is too fast for any steps."""


class Departure(NamedTuple):
    """Where a curve starts, and which way it is followed.

    Attributes:
        first: start of the search for the first point.
        row: direction across which the first point is sought; a unit vector picks the unknown held fixed.
        tangent: direction in which to leave.
    """

    first: Float[Array, " unknown"]
    row: Float[Array, " unknown"]
    tangent: Float[Array, " unknown"]


class Stride(NamedTuple):
    """Steps along a curve.

    Attributes:
        longest: largest step, in scaled unknowns.
        most: points to make room for.
        to_turn: whether the curve ends at the first point after which the last unknown falls.
    """

    longest: float
    most: int
    to_turn: bool = False


class Followed(NamedTuple):
    """A curve of solutions.

    Attributes:
        unknowns: points of the curve; unused places hold the last.
        tangents: unit vectors along it.
        found: how many points.
        ending: why it ends.
    """

    unknowns: Float[Array, "point unknown"]
    tangents: Float[Array, "point unknown"]
    found: Int[Array, ""]
    ending: Int[Array, ""]


class _Walk(NamedTuple):
    """Where the search stands: one step of Newton's method at a time, so that a batch never waits."""

    here: Float[Array, " unknown"]
    predicted: Float[Array, " unknown"]
    base: Float[Array, " unknown"]
    tangent: Float[Array, " unknown"]
    row: Float[Array, " unknown"]
    step: Float[Array, ""]
    landing: Bool[Array, ""]
    tries: Int[Array, ""]
    followed: Followed


def follow(
    equations: Callable[[Float[Array, " unknown"]], Float[Array, " equation"]],
    departure: Departure,
    free: int,
    stride: Stride,
    is_held: Callable[[Float[Array, " unknown"]], Bool[Array, ""]] | None = None,
) -> Followed:
    """Follow the curve `equations(u) = 0`, one equation fewer than unknowns.

    Tangent predictor, Newton corrector in the plane across it, steps by the corrector's effort and by how far
    the tangent turns. The curve ends exactly on a bound, or where it closes on its first point.

    Args:
        equations: what vanishes on the curve; unknowns scaled to order one.
        departure: where the curve starts.
        free: count of unknowns without bounds; those after them are shares between 0 and 1.
        stride: steps along it.
        is_held: whether a point is no orbit of its own because friction holds the mass there; the curve ends
            just before. Never if omitted.

    Returns:
        The curve.

    Source: Keller 1977, Applications of Bifurcation Theory, p. 359; Doedel, Keller & Kernevez 1991, Int. J.
    Bifurcation and Chaos 1:493.
    """
    first, row, tangent = departure
    step, most, to_turn = stride
    size = first.shape[0]
    units = jnp.eye(size)
    unbounded = jnp.full(free, jnp.inf)
    lower = jnp.concatenate([-unbounded, jnp.zeros(size - free)])
    upper = jnp.concatenate([unbounded, jnp.ones(size - free)])

    def holds(point: Array) -> Array:
        return jnp.array(False) if is_held is None else is_held(point)

    def predict(base: Array, tangent: Array, length: Array) -> tuple[Array, Array, Array]:
        ahead = base + length * tangent
        limit = jnp.where(tangent > 0.0, upper, lower)
        # A little before the bound counts too: the corrector could step over it.
        beyond = (
            (ahead + 0.1 * length * jnp.sign(tangent) - limit) * jnp.sign(tangent) > 0.0
        ) & jnp.isfinite(limit)
        reach = jnp.where(beyond, (limit - base) / jnp.where(tangent == 0.0, 1.0, tangent), jnp.inf)
        place = jnp.argmin(reach)
        landing = jnp.any(beyond)
        short = jnp.where(landing, reach[place], length)
        return base + short * tangent, jnp.where(landing, units[place], tangent), landing

    def accept(walk: _Walk, found: Array, ahead: Array) -> _Walk:
        past = walk.followed
        length = jnp.linalg.norm(found - walk.base)
        origin, way = past.unknowns[0], past.tangents[0]
        share = jnp.clip(
            jnp.dot(origin - walk.base, found - walk.base) / jnp.maximum(length, 1e-300) ** 2, 0, 1
        )
        apart = jnp.linalg.norm(walk.base + share * (found - walk.base) - origin)
        near = apart < _CLOSES_WITHIN * length
        closed = (past.found >= _CLOSES_FROM) & near & (jnp.dot(way, ahead) > 0.5)
        found, ahead = jnp.where(closed, origin, found), jnp.where(closed, way, ahead)
        done = walk.landing | closed
        bend = jnp.arccos(jnp.clip(jnp.dot(ahead, walk.tangent), -1.0, 1.0))
        growth = jnp.where(walk.tries <= 2, 1.5, jnp.where(walk.tries <= 3, 1.2, 0.7))
        growth = jnp.minimum(growth, jnp.clip(_ANGLE / jnp.maximum(bend, 1e-12), 0.5, 1.5))
        following = jnp.where(past.found == 0, walk.step, jnp.minimum(walk.step * growth, step))
        predicted, row, landing = predict(found, ahead, following)
        count = past.found + 1
        ending = jnp.where(closed, RETURNED, jnp.where(done, REACHED_BOUND, past.ending))
        if to_turn:
            ending = jnp.where((ahead[-1] <= 0.0) & ~done, _TURNED, ending)
        followed = Followed(
            past.unknowns.at[past.found].set(found), past.tangents.at[past.found].set(ahead), count, ending
        )
        return _Walk(predicted, predicted, found, ahead, row, following, landing, jnp.array(0), followed)

    def refuse(walk: _Walk) -> _Walk:
        shorter = 0.5 * jnp.minimum(walk.step, jnp.linalg.norm(walk.predicted - walk.base))
        past = walk.followed
        predicted, row, landing = predict(walk.base, walk.tangent, shorter)
        stuck = jnp.where(past.found == 0, NEVER_STARTED, STALLED)
        # Where friction is about to hold the mass, motions are so small that Newton may stall before.
        ahead = walk.base + step * walk.tangent
        stuck = jnp.where(holds(jnp.where(jnp.arange(size) < free, 0.0, ahead)), HELD, stuck)
        ending = jnp.where((shorter < _SHORTEST_STEP * step) | (past.found == 0), stuck, past.ending)
        return _Walk(
            predicted,
            predicted,
            walk.base,
            walk.tangent,
            row,
            shorter,
            landing,
            jnp.array(0),
            past._replace(ending=ending),
        )

    def improve(walk: _Walk) -> _Walk:
        value, slope = value_and_jacobian(equations, walk.here)
        across = jnp.dot(walk.row, walk.here - walk.predicted)
        change = solve(jnp.concatenate([slope, walk.row[None]]), jnp.concatenate([value, across[None]]))
        moved = walk.here - change
        ahead = solve(jnp.concatenate([slope, walk.tangent[None]]), units[-1])
        ahead = ahead / jnp.linalg.norm(ahead)
        starting = walk.followed.found == 0
        span = jnp.linalg.norm(walk.predicted - walk.base)
        sane = jnp.all(jnp.isfinite(change)) & (
            starting | (jnp.linalg.norm(moved - walk.predicted) < 0.5 * span + 1e-9)
        )
        found = sane & (jnp.max(jnp.abs(change)) < _TOLERANCE)
        straight = starting | (jnp.dot(ahead, walk.tangent) > jnp.cos(2.0 * _ANGLE))
        sound = jnp.all(jnp.isfinite(ahead)) & ~holds(moved)
        patience = jnp.where(starting, _FIRST_PATIENCE, _PATIENCE)
        over = ~sane | (walk.tries >= patience) | (found & ~(straight & sound))
        going = walk._replace(here=moved, tries=walk.tries + 1)
        choices = (accept(walk, moved, ahead), refuse(walk), going)
        return jax.tree.map(lambda yes, no, on: jnp.where(over, no, jnp.where(found, yes, on)), *choices)

    def running(walk: _Walk) -> Array:
        return (walk.followed.ending == _RAN_OUT) & (walk.followed.found < most)

    nothing = Followed(jnp.zeros((most, size)), jnp.zeros((most, size)), jnp.array(0), jnp.array(_RAN_OUT))
    walk = _Walk(
        first, first, first, tangent, row, jnp.asarray(0.25 * step), jnp.array(False), jnp.array(0), nothing
    )
    followed = jax.lax.while_loop(running, improve, walk).followed
    last = jnp.maximum(followed.found - 1, 0)
    used = (jnp.arange(most) < followed.found)[:, None]
    return followed._replace(
        unknowns=jnp.where(used, followed.unknowns, followed.unknowns[last][None]),
        tangents=jnp.where(used, followed.tangents, followed.tangents[last][None]),
    )
