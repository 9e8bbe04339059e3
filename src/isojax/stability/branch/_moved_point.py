"""Where a bifurcation of a branch goes when the model moves: along the branch of the other model, or nowhere.

Newton's method on the equations of a bifurcation alone may end anywhere once the bifurcation is gone, and
near where a pair of them vanishes it may miss what is there. Here the known orbit first moves across its
branch to that of the other model, which is smooth also where bifurcations vanish. The new branch is then
followed both ways, and the bifurcation is where its test function changes sign as it did at the known one.
"""

import functools
from collections.abc import Callable
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..._implicit import frozen
from ..orbit import ShootingMethod, state_scale, trajectory, value_and_jacobian
from ._branch import SpecialPoint
from ._criticality import BifurcationKind
from ._extended_system import PointGuess
from ._locating import TEST_OF, critical_values
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

_SIDESTEP = 2e-3
"""Distance along the known branch at which the sense of its test function's change is read."""


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
    origin = jnp.concatenate([point.y0 / scale, shares])
    place = functools.partial(corrected, method=method, scale=scale, test=TEST_OF[kind])
    _, slope = value_and_jacobian(lambda u: known.open_end(method, scale, u), origin)
    # Null vector of the slope: the way along the branch.
    across = jnp.linalg.svd(slope)[2][-1]
    aside = jax.vmap(lambda side: place(known, origin + side * _SIDESTEP * across, across).test)
    behind, ahead = aside(jnp.array([-1.0, 1.0]))
    sense = jnp.sign(ahead - behind)

    def nearer(here: Array, share: Array) -> tuple[Array, Place]:
        between = jax.tree.map(
            lambda old, new: old + share * (new - old) if eqx.is_inexact_array(old) else new, known, family
        )
        found = place(between, here, across)
        return found.unknown, found

    _, stages = jax.lax.scan(nearer, origin, jnp.arange(1.0, _STAGES + 1.0) / _STAGES)
    moved = jax.tree.map(lambda own: own[-1], stages)
    there = functools.partial(place, family)
    line = jax.tree.map(
        lambda here, ways: jnp.concatenate([ways[0, ::-1], here[None], ways[1]]), moved, _walk(there, moved)
    )
    found = _zero(there, line, sense)
    states = scale.shape[0]
    return PointGuess(found[:states] * scale, found[states:])


def corrected(
    family: ParameterFamily,
    guess: Float[Array, " unknown"],
    normal: Float[Array, " unknown"],
    *,
    method: ShootingMethod,
    scale: Float[Array, " state"],
    test: int,
) -> Place:
    """Give the point of a branch in the plane through a guess, its tangent on the side of the normal.

    Args:
        family: isolators and drives.
        guess: scaled state and share.
        normal: of the plane.
        method: how the orbits are closed.
        scale: size of each state.
        test: which of `critical_values` is read.

    Returns:
        The point.
    """
    states = scale.shape[0]

    def newton(_: Array | int, carry: tuple[Array, Array, Array]) -> tuple[Array, Array, Array]:
        u = carry[0]
        left, slope = value_and_jacobian(lambda at: family.open_end(method, scale, at), u)
        change = jnp.linalg.solve(
            jnp.concatenate([slope, normal[None]]),
            jnp.concatenate([left, jnp.dot(normal, u - guess)[None]]),
        )
        return u - change, slope, jnp.max(jnp.abs(change))

    begin = guess, jnp.zeros((states, states + 1)), jnp.asarray(jnp.inf)
    found, slope, last = jax.lax.fori_loop(0, _CORRECTIONS, newton, begin)
    ahead = jnp.linalg.solve(jnp.concatenate([slope, normal[None]]), jnp.zeros(states + 1).at[-1].set(1.0))
    ahead = ahead / jnp.linalg.norm(ahead)
    value = critical_values(slope[:, :states] + jnp.eye(states), ahead)[test]
    return Place(found, ahead, value, last < _FOUND_WITHIN)


def _walk(place: Callable[[Array, Array], Place], start: Place) -> Place:
    """Follow a branch from a point, back and forward, which is the first axis; tangents point forward."""

    def way(side: Array) -> Place:
        def step(here: Place, length: Array) -> tuple[Place, Place]:
            found = place(here.unknown + side * length * here.tangent, here.tangent)
            straight = jnp.dot(found.tangent, here.tangent) > _STRAIGHT
            found = found._replace(sound=found.sound & here.sound & straight)
            return found, found

        return jax.lax.scan(step, start, jnp.asarray(_STEPS))[1]

    return jax.vmap(way)(jnp.array([-1.0, 1.0]))


def _zero(
    place: Callable[[Array, Array], Place], line: Place, sense: Float[Array, ""]
) -> Float[Array, " unknown"]:
    """Give where the test function passes zero in a sense, nearest to the middle of a line; NaN if nowhere.

    Through each three points a parabola is laid, which also shows a pair of zeros between two of them; from
    its zero the secant method goes on along the branch.
    """
    ends = np.concatenate([[0.0], np.cumsum(_STEPS)])
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
    good = sound & (shift >= -0.5 * gaps[:-1]) & (shift <= 0.5 * gaps[1:])
    best = jnp.argmin(jnp.where(good, jnp.abs(along[1:-1] + shift), jnp.inf))
    start = jax.tree.map(lambda own: own[best + 1], line)
    rate = slope[best] + 2.0 * bend[best] * shift[best]

    def secant(_: Array | int, carry: tuple[Place, Array, Array]) -> tuple[Place, Array, Array]:
        old, length, rate = carry
        new = place(old.unknown + length * old.tangent, old.tangent)
        change = (new.test - old.test) / jnp.where(length == 0.0, 1.0, length)
        rate = jnp.where(change * sense > 0.0, change, rate)
        return new, -new.test / rate, rate

    begin = start, jnp.where(good[best], shift[best], jnp.nan), rate
    return jax.lax.fori_loop(0, _SECANTS, secant, begin)[0].unknown
