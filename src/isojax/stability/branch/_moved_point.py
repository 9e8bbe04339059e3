"""Where a point of a branch goes when the model moves: along the branch of the other model, or nowhere.

Newton's method on the equations of a bifurcation, or of an orbit, alone may end anywhere once that is gone,
and near where a pair of them vanishes it may miss what is there. Here the known orbit first moves across its
branch to that of the other model, which is smooth also where bifurcations vanish. The new branch is then
followed both ways, and the point is where its test function changes sign as it did at the known one.
"""

import functools
from collections.abc import Callable
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..._implicit import frozen
from ..._small_systems import solve
from ..orbit import ShootingMethod, state_scale, trajectory, value_and_jacobian
from ._branch import SpecialPoint
from ._criticality import BifurcationKind, critical_values
from ._extended_system import PointGuess
from ._locating import TEST_OF
from ._parameter_family import ParameterFamily

_STAGES = 4
"""Models between the known and the other one, through which the orbit is moved."""

_STEPS = 0.02 * np.minimum(1.06 ** np.arange(40), 3.0)
"""Steps along the branch either way, over the size of motion and range: the further, the longer."""

_CORRECTIONS = 4
"""Steps of Newton's method for a point."""

_SECANTS = 4
"""Steps of the secant method along the branch to the zero of the test function."""

_FOUND_WITHIN = 1e-6
"""Largest last step of Newton's method after which a point counts, in scaled unknowns."""

_STRAIGHT = 0.8
"""Cosine of the turn of the tangent in one step below which the branch counts as lost."""

_PARABOLA_READ = 0.75
"""How far a parabola through three points is read, over the gaps between them: beyond the half, so that a
zero in the middle of a gap is not lost between two parabolas."""

_SIDESTEP = 2e-3
"""Distance along the known branch at which the sense of its test function's change is read."""


Test = Callable[[Array, Array, Array], Array]
"""Gives what vanishes at a point from its unknown, the derivative of its map and its tangent."""


class Place(NamedTuple):
    """A point of a branch: scaled state and share, unit tangent, test function, and whether it was found."""

    unknown: Float[Array, " unknown"]
    tangent: Float[Array, " unknown"]
    test: Float[Array, ""]
    sound: Array


def moved_guess(point: SpecialPoint, kind: BifurcationKind, family: ParameterFamily) -> PointGuess:
    """Give about where a bifurcation lies among other isolators and drives.

    Args:
        point: the known point; no number of it is traced.
        kind: which bifurcation it is.
        family: isolators and drives along the same parameter over the same range.

    Returns:
        State and share; NaN where the branch there has no such bifurcation within reach.
    """
    point, family = frozen((point, family))
    known, method = point.family, point.method
    shares = known.shares(point.value[None])
    setting = known.at(shares)
    path = trajectory(setting.model, method.integrator, setting.drive, tuple(point.y0), turns=method.turns)
    scale = state_scale(path)

    def test(_: Array, matrix: Array, tangent: Array) -> Array:
        return critical_values(matrix, tangent)[TEST_OF[kind]]

    move = Move(known, family, method, scale, test)
    origin = jnp.concatenate([point.y0 / scale, shares])
    across = move.across(origin)
    place, line = move.line(origin, across, _STEPS)
    found = zero_along(place, line, _STEPS, move.sense(origin, across)).unknown
    states = scale.shape[0]
    return PointGuess(found[:states] * scale, found[states:])


class Move(NamedTuple):
    """From the branch of one family to that of another.

    Attributes:
        known: isolators and drives of the known point.
        family: the other ones.
        method: how the orbits are closed.
        scale: size of each state at the known point.
        test: vanishes at the point.
    """

    known: ParameterFamily
    family: ParameterFamily
    method: ShootingMethod
    scale: Float[Array, " state"]
    test: Test

    def across(self, origin: Float[Array, " unknown"]) -> Float[Array, " unknown"]:
        """Give the unit tangent of the known branch at the known point, on which the parameter rises."""
        _, slope = value_and_jacobian(lambda u: self.known.open_end(self.method, self.scale, u), origin)
        along = jnp.linalg.svd(slope)[2][-1]  # null vector of the slope
        return along * jnp.where(along[-1] < 0.0, -1.0, 1.0)

    def sense(self, origin: Float[Array, " unknown"], across: Float[Array, " unknown"]) -> Float[Array, ""]:
        """Give the sign of the change of the test function along the known branch at the known point."""
        place = functools.partial(corrected, self.known, method=self.method, scale=self.scale, test=self.test)
        aside = jax.vmap(lambda side: place(origin + side * _SIDESTEP * across, across).test)
        behind, ahead = aside(jnp.array([-1.0, 1.0]))
        return jnp.sign(ahead - behind)

    def line(
        self,
        origin: Float[Array, " unknown"],
        across: Float[Array, " unknown"],
        steps: Float[np.ndarray, " step"],
    ) -> tuple[Callable[[Array, Array], Place], Place]:
        """Follow the other branch both ways from where the known point moves to.

        Args:
            origin: the known point: scaled state and share.
            across: tangent of the known branch there.
            steps: along the branch, either way.

        Returns:
            What gives a point of the other branch from a guess and the normal of a plane through it; and the
            branch, its first axis from back to front, with the moved point in the middle.
        """
        place = functools.partial(corrected, method=self.method, scale=self.scale, test=self.test)

        def nearer(here: Array, share: Array) -> tuple[Array, Place]:
            between = jax.tree.map(
                lambda old, new: old + share * (new - old) if eqx.is_inexact_array(old) else new,
                self.known,
                self.family,
            )
            found = place(between, here, across)
            return found.unknown, found

        _, stages = jax.lax.scan(nearer, origin, jnp.arange(1.0, _STAGES + 1.0) / _STAGES)
        moved = jax.tree.map(lambda own: own[-1], stages)
        own = functools.partial(place, self.family)
        ways = _walk(own, moved, steps)
        line = jax.tree.map(
            lambda here, both: jnp.concatenate([both[0, ::-1], here[None], both[1]]), moved, ways
        )
        return own, line


def corrected(
    family: ParameterFamily,
    guess: Float[Array, " unknown"],
    normal: Float[Array, " unknown"],
    *,
    method: ShootingMethod,
    scale: Float[Array, " state"],
    test: Test,
) -> Place:
    """Give the point of a branch in the plane through a guess, its tangent on the side of the normal.

    Args:
        family: isolators and drives.
        guess: scaled state and share.
        normal: of the plane.
        method: how the orbits are closed.
        scale: size of each state.
        test: gives what is read there.

    Returns:
        The point.
    """
    states = scale.shape[0]

    def newton(_: Array | int, carry: tuple[Array, Array, Array]) -> tuple[Array, Array, Array]:
        u = carry[0]
        left, slope = value_and_jacobian(lambda at: family.open_end(method, scale, at), u)
        change = solve(
            jnp.concatenate([slope, normal[None]]),
            jnp.concatenate([left, jnp.dot(normal, u - guess)[None]]),
        )
        return u - change, slope, jnp.max(jnp.abs(change))

    begin = guess, jnp.zeros((states, states + 1)), jnp.asarray(jnp.inf)
    found, slope, last = jax.lax.fori_loop(0, _CORRECTIONS, newton, begin)
    ahead = solve(jnp.concatenate([slope, normal[None]]), jnp.zeros(states + 1).at[-1].set(1.0))
    ahead = ahead / jnp.linalg.norm(ahead)
    value = test(found, slope[:, :states] + jnp.eye(states), ahead)
    return Place(found, ahead, value, last < _FOUND_WITHIN)


def _walk(place: Callable[[Array, Array], Place], start: Place, steps: Float[np.ndarray, " step"]) -> Place:
    """Follow a branch from a point, back and forward, which is the first axis; tangents point forward."""

    def way(side: Array) -> Place:
        def step(here: Place, length: Array) -> tuple[Place, Place]:
            found = place(here.unknown + side * length * here.tangent, here.tangent)
            straight = jnp.dot(found.tangent, here.tangent) > _STRAIGHT
            found = found._replace(sound=found.sound & here.sound & straight)
            return found, found

        return jax.lax.scan(step, start, jnp.asarray(steps))[1]

    return jax.vmap(way)(jnp.array([-1.0, 1.0]))


def zero_along(
    place: Callable[[Array, Array], Place],
    line: Place,
    steps: Float[np.ndarray, " step"],
    sense: Float[Array, ""],
    within: Bool[Array, " place"] | None = None,
) -> Place:
    """Give where the test function passes zero in a sense, nearest to the middle of a line; NaN if nowhere.

    Through each three points a parabola is laid, which also shows a pair of zeros between two of them; from
    its zero the secant method goes on along the branch.

    Args:
        place: gives a point of the branch from a guess and a normal.
        line: points of the branch.
        steps: between these, from the middle either way.
        sense: sign of the change of the test function.
        within: next to which points of the line the zero may lie; all if omitted.

    Returns:
        The point.
    """
    ends = np.concatenate([[0.0], np.cumsum(steps)])
    along = jnp.asarray(np.concatenate([-ends[:0:-1], ends]))
    gaps, here = jnp.diff(along), line.test[1:-1]
    rates = jnp.diff(line.test) / gaps
    bend = (rates[1:] - rates[:-1]) / (gaps[1:] + gaps[:-1])
    slope = rates[:-1] + bend * gaps[:-1]
    root = jnp.sqrt(slope**2 - 4.0 * bend * here)  # NaN without a zero
    # Of the two forms of a quadratic's root the one that loses no digits.
    shift = jnp.where(
        slope * sense > 0.0, -2.0 * here / (slope + sense * root), (sense * root - slope) / (2.0 * bend)
    )
    sound = line.sound[:-2] & line.sound[1:-1] & line.sound[2:]
    sound = sound if within is None else sound & within[1:-1]
    good = sound & (shift >= -_PARABOLA_READ * gaps[:-1]) & (shift <= _PARABOLA_READ * gaps[1:])
    best = jnp.argmin(jnp.where(good, jnp.abs(along[1:-1] + shift), jnp.inf))
    start = jax.tree.map(lambda own: own[best + 1], line)
    rate = slope[best] + 2.0 * bend[best] * shift[best]

    def secant(_: Array | int, carry: tuple[Place, Array, Array]) -> tuple[Place, Array, Array]:
        old, length, rate = carry
        new = place(old.unknown + length * old.tangent, old.tangent)
        change = (new.test - old.test) / jnp.where(length == 0.0, 1.0, length)
        # Of no step the change is rounding.
        rate = jnp.where((change * sense > 0.0) & (length != 0.0), change, rate)
        return new, -new.test / rate, rate

    begin = start, jnp.where(good[best], shift[best], jnp.nan), rate
    return jax.lax.fori_loop(0, _SECANTS, secant, begin)[0]
