"""Where along a branch orbits bifurcate, or an event happens: test function, change of sign, bisection."""

import functools
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from ..._quick_jit import quick_jit
from ..._small_systems import solve
from ..orbit import ShootingMethod, is_odd, period_map, value_and_jacobian
from ._branch import BranchEvent, BranchPoints
from ._branch_point import orbit_at
from ._criticality import BifurcationKind, critical_values
from ._extended_system import PointGuess
from ._parameter_family import ParameterFamily

_BISECTIONS, _EVENT_BISECTIONS, _CORRECTIONS = 14, 44, 4
"""Halvings of the step in which a test function changes sign, of those in which an event happens and which
are found by nothing else, and steps of Newton's method in each."""

_LOCATED_AT_ONCE = 4
"""Bifurcations located together; their count is rounded up to this, so that few shapes are compiled."""

SAME_MOTION = 1e-3
"""Distance of a motion from its mirror image half a period on, or from itself a period on, over its size,
below which it counts as symmetric or repeated: bisection leaves a ten-thousandth of a step."""

_REAL = 1e-6
"""Imaginary part below which a pair of multipliers counts as two real ones, one the inverse of the other."""

TEST_OF: dict[BifurcationKind, int] = {
    "fold": 0,
    "period_doubling": 1,
    "symmetry_breaking": 1,
    "neimark_sacker": 2,
}
"""Which of `critical_values` vanishes at each, its orbit closed as that of the point is."""

_BIFURCATIONS = 3
"""Test functions of bifurcations, which stand before those of events."""


class BranchCurves(NamedTuple):
    """A batch of branches, as followed.

    Attributes:
        scale: size of each state.
        unknowns: points: scaled states and shares.
        counts: points found on each.
        tests: `critical_values` at each point.
    """

    scale: Float[Array, "branch state"]
    unknowns: Float[Array, "branch point unknown"]
    counts: Int[np.ndarray, " branch"]
    tests: Float[Array, "branch point test"]


def _slopes(
    family: ParameterFamily, method: ShootingMethod, scale: Array, here: Array
) -> tuple[Array, Array]:
    """Give the residual at a point and its derivative by state and share."""
    return value_and_jacobian(lambda u: family.open_end(method, scale, u), here)


@quick_jit
def critical_values_along(
    family: ParameterFamily, method: ShootingMethod, scale: Array, unknowns: Array, tangents: Array
) -> Float[Array, "branch point test"]:
    """Give the test functions of bifurcations at every point of a batch of branches."""

    def lane(amplitude: Array, frequency: Array, scale: Array, unknown: Array, tangent: Array) -> Array:
        here = family.driven(amplitude, frequency)
        states = scale.shape[0]

        def point(u: Array, t: Array) -> Array:
            _, slope = _slopes(here, method, scale, u)
            return critical_values(slope[:, :states] + jnp.eye(states), t)

        return jax.vmap(point)(unknown, tangent)

    return jax.vmap(lane)(family.amplitude, family.frequency, scale, unknowns, tangents)


@quick_jit
def _locate(
    family: ParameterFamily,
    method: ShootingMethod,
    scale: Float[Array, "lane state"],
    ends: tuple[Array, Array],
    change: tuple[Float[Array, " lane"], Int[Array, " lane"]],
    bisections: Int[Array, ""],
    events: tuple[BranchEvent, ...],
) -> tuple[Array, Array, Array]:
    """Bisect between the ends for a test function, its value at the first and its number given in `change`.

    Returns:
        The points, their matrices, and how far each motion is from repeating; see `_repeats`.
    """

    def lane(
        drive: tuple[Array, Array], scale: Array, ends: tuple[Array, Array], sign: Array, kind: Array
    ) -> tuple[Array, Array, Array]:
        here, (low, high) = family.driven(*drive), ends
        states = scale.shape[0]
        chord = (high - low) / jnp.linalg.norm(high - low)

        def correct(guess: Array) -> tuple[Array, Array]:
            def newton(_: Array | int, carry: tuple[Array, Array]) -> tuple[Array, Array]:
                u = carry[0]
                left, slope = _slopes(here, method, scale, u)
                across = jnp.dot(chord, u - guess)
                step = solve(jnp.concatenate([slope, chord[None]]), jnp.concatenate([left, across[None]]))
                return u - step, slope

            # One step more than the point needs, so that the last slope is the point's own.
            return jax.lax.fori_loop(0, _CORRECTIONS + 1, newton, (guess, jnp.zeros((states, states + 1))))

        def halve(
            _: Array | int, carry: tuple[Array, Array, Array, Array]
        ) -> tuple[Array, Array, Array, Array]:
            low, high = carry[:2]
            middle, slope = correct(0.5 * (low + high))
            ahead = solve(jnp.concatenate([slope, chord[None]]), jnp.zeros(states + 1).at[-1].set(1.0))
            tests = critical_values(slope[:, :states] + jnp.eye(states), ahead)
            if events:
                orbit = orbit_at(here, method, scale, middle, ahead)
                own = [jnp.asarray(event.function(orbit), float)[None] for event in events]
                tests = jnp.concatenate([tests, *own])
            test = tests[kind]
            same = test * sign > 0.0
            return jnp.where(same, middle, low), jnp.where(same, high, middle), middle, slope

        begin = (low, high, low, jnp.zeros((states, states + 1)))
        _, _, found, slope = jax.lax.fori_loop(0, bisections + 1, halve, begin)
        repeats = _repeats(here, method, scale, found[:states], found[states:])
        return found, slope[:, :states] + jnp.eye(states), repeats

    return jax.vmap(lane)((family.amplitude, family.frequency), scale, ends, *change)


def _repeats(
    family: ParameterFamily, method: ShootingMethod, scale: Array, scaled: Array, shares: Array
) -> Float[Array, "2"]:
    """Give the distance of the motion from its mirror image half a period on, and from itself a period on."""
    there, begin = family.at(shares), tuple(scaled * scale)
    maps = functools.partial(period_map, there.model, method.integrator, there.drive, begin)
    later = (maps(turns=turns) for turns in (0.5, 1.0))
    off = [jnp.max(jnp.abs(jnp.stack(state) / scale - scaled)) for state in later]
    return jnp.stack(off) / jnp.max(jnp.abs(scaled))


repeats_jitted = quick_jit(_repeats)


@quick_jit
def _event_values(
    events: tuple[BranchEvent, ...], points: BranchPoints
) -> Float[Array, "branch point event"]:
    def one(orbit: BranchPoints) -> Array:
        return jnp.stack([jnp.asarray(event.function(orbit), float) for event in events])

    return jax.vmap(jax.vmap(one))(points)


class Located(NamedTuple):
    """A bifurcation or an event between two points of a branch, before it is found exactly.

    Attributes:
        kind: which bifurcation; None of an event.
        method: how its orbit is closed.
        branch: which branch of the batch it lies on.
        guess: where.
        event: which event; None of a bifurcation.
    """

    kind: BifurcationKind | None
    method: ShootingMethod
    branch: int
    guess: PointGuess
    event: BranchEvent | None = None


def locate(
    family: ParameterFamily,
    method: ShootingMethod,
    curves: BranchCurves,
    events: tuple[BranchEvent, ...] = (),
    points: BranchPoints | None = None,
) -> list[Located]:
    """Locate the bifurcations along a batch of branches, and events, by bisection.

    Args:
        family: isolators and drives, drive with a leading axis.
        method: how the orbits are closed.
        curves: the branches.
        events: what to look out for.
        points: what is known of the branches' points, where there are events.

    Returns:
        Where they are, branch after branch.
    """
    scale, unknowns, counts, tests = curves
    tests = np.asarray(tests)
    if events:
        tests = np.concatenate([tests, np.asarray(_event_values(events, points))], axis=-1)
    with np.errstate(over="ignore"):
        known = np.isfinite(tests[:, :-1]) & np.isfinite(tests[:, 1:])
    changes = (np.sign(tests[:, :-1]) != np.sign(tests[:, 1:])) & known
    changes &= (np.arange(tests.shape[1] - 1) < counts[:, None] - 1)[..., None]
    lanes, places, kinds = np.nonzero(changes)
    if not lanes.size:
        return []
    padded = np.resize(np.arange(lanes.size), -(-lanes.size // _LOCATED_AT_ONCE) * _LOCATED_AT_ONCE)
    lane, place, which = lanes[padded], places[padded], kinds[padded]
    along, sizes = np.asarray(unknowns), np.asarray(scale)
    drives = (jnp.asarray(np.asarray(drive)[lane]) for drive in (family.amplitude, family.frequency))
    halvings = jnp.asarray(_EVENT_BISECTIONS if np.any(kinds >= _BIFURCATIONS) else _BISECTIONS)
    located = _locate(
        family.driven(*drives),
        method,
        jnp.asarray(sizes[lane]),
        (jnp.asarray(along[lane, place]), jnp.asarray(along[lane, place + 1])),
        (jnp.asarray(tests[lane, place, which]), jnp.asarray(which)),
        halvings,
        events,
    )
    crossed, found, states = crossed_branch(family, method), [], sizes.shape[1]
    for branch, test, where, matrix, repeats in zip(
        lanes, kinds, *(np.asarray(values) for values in located), strict=False
    ):
        guess = PointGuess(jnp.asarray(where[:states] * sizes[branch]), jnp.asarray(where[states:]))
        if test >= _BIFURCATIONS:
            found.append(Located(None, method, int(branch), guess, events[test - _BIFURCATIONS]))
            continue
        judged = _kind_of_sign_change(int(test), method, matrix)
        if (
            test == 0
            and crossed is not None
            and distance_from(crossed[0], jnp.asarray(repeats)) < SAME_MOTION
        ):
            judged = crossed
        if judged is not None:
            found.append(Located(judged[0], judged[1], int(branch), guess))
    return found


def crossed_branch(
    family: ParameterFamily, method: ShootingMethod
) -> tuple[BifurcationKind, ShootingMethod] | None:
    """Give what a branch meets where it crosses the one that it may have left, and how orbits close there."""
    once = ShootingMethod(method.integrator, 1, False)
    if method.periods == 1 and not method.half and is_odd(family.model):
        return "symmetry_breaking", ShootingMethod(method.integrator, 1, True)
    return ("period_doubling", once) if method.periods == 2 else None


def distance_from(crossing: BifurcationKind, repeats: Float[Array, "2"]) -> float:
    """Give how far a motion is from one of the branch that is crossed there; see `_repeats`."""
    return float(repeats[0 if crossing == "symmetry_breaking" else 1])


def _kind_of_sign_change(
    which: int, method: ShootingMethod, matrix: np.ndarray
) -> tuple[BifurcationKind, ShootingMethod] | None:
    """Say which bifurcation a sign change is that is no crossing, or None for two real multipliers."""
    if which == 0:
        return "fold", method
    if which == 1:
        return ("symmetry_breaking" if method.half else "period_doubling"), method
    values = np.linalg.eigvals(matrix)
    first, second = np.triu_indices(values.size, 1)
    pair = np.argmin(np.abs(values[first] * values[second] - 1.0))
    return None if abs(values[first[pair]].imag) < _REAL else ("neimark_sacker", method)
