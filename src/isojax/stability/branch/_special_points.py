"""Bifurcations along a branch: test function, change of sign, bisection, and then the extended equations."""

import functools

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float, Int

from ..._implicit import frozen
from ..._results import RESULTS, is_successful
from ..orbit import ShootingMethod, event_places, is_odd, multipliers, period_map, value_and_jacobian
from ._branch import SpecialPoint
from ._extended_system import (
    LOCATED_WITHIN,
    MOST_PLACES,
    BifurcationKind,
    PointGuess,
    Polished,
    polish_jitted,
)
from ._parameter_family import ParameterFamily

_BISECTIONS, _CORRECTIONS = 14, 4
"""Halvings of the step in which a test function changes sign, and steps of Newton's method in each."""

_LOCATED_AT_ONCE = 4
"""Bifurcations located together; their count is rounded up to this, so that few shapes are compiled."""

_SAME_MOTION = 1e-3
"""Distance of a motion from its mirror image half a period on, or from itself a period on, over its size,
below which it counts as symmetric or repeated: bisection leaves a ten-thousandth of a step."""

_REAL = 1e-6
"""Imaginary part below which a pair of multipliers counts as two real ones, one the inverse of the other."""


def critical_values(
    matrix: Float[Array, "state state"], tangent: Float[Array, " unknown"]
) -> Float[Array, " test"]:
    """Give what changes sign where a branch bifurcates.

    The parameter's part of the tangent (fold), `det(M + I)` (doubling, or broken symmetry on the half-period
    map), and the product of `mu_i mu_j - 1` over all pairs (Neimark-Sacker, or two real multipliers one
    the inverse of the other, which bifurcate nothing).

    Args:
        matrix: derivative of the map.
        tangent: along the branch, the parameter last.

    Returns:
        The three values.

    Source: Kuznetsov 2004, Elements of Applied Bifurcation Theory, sec. 10.2.
    """
    states = matrix.shape[0]
    doubling = jnp.linalg.det(matrix + jnp.eye(states))
    if states == 2:
        torus = jnp.linalg.det(matrix) - 1.0
    else:
        values = multipliers(matrix)
        first, second = np.triu_indices(states, 1)
        torus = jnp.real(jnp.prod(values[first] * values[second] - 1.0))
    return jnp.stack([tangent[-1], doubling, torus])


def _slopes(
    family: ParameterFamily, method: ShootingMethod, scale: Array, here: Array
) -> tuple[Array, Array]:
    """Give the residual at a point and its derivative by state and share."""
    return value_and_jacobian(lambda u: family.open_end(method, scale, u), here)


@eqx.filter_jit
def critical_values_along(
    family: ParameterFamily, method: ShootingMethod, scale: Array, unknowns: Array, tangents: Array
) -> Float[Array, "branch point test"]:
    """Give the test functions at every point of a batch of branches.

    Args:
        family: isolators and drives, drive with a leading axis.
        method: how the orbits are closed.
        scale: size of each state, branch first.
        unknowns: points, branch first.
        tangents: along the branches.

    Returns:
        Test functions.
    """

    def lane(amplitude: Array, frequency: Array, scale: Array, unknown: Array, tangent: Array) -> Array:
        here = family.driven(amplitude, frequency)
        states = scale.shape[0]

        def point(u: Array, t: Array) -> Array:
            _, slope = _slopes(here, method, scale, u)
            return critical_values(slope[:, :states] + jnp.eye(states), t)

        return jax.vmap(point)(unknown, tangent)

    return jax.vmap(lane)(family.amplitude, family.frequency, scale, unknowns, tangents)


@eqx.filter_jit
def _locate(
    family: ParameterFamily,
    method: ShootingMethod,
    scale: Float[Array, "lane state"],
    ends: tuple[Array, Array],
    change: tuple[Float[Array, " lane"], Int[Array, " lane"]],
    bisections: int,
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
                step = jnp.linalg.solve(
                    jnp.concatenate([slope, chord[None]]), jnp.concatenate([left, across[None]])
                )
                return u - step, slope

            # One step more than the point needs, so that the last slope is the point's own.
            return jax.lax.fori_loop(0, _CORRECTIONS + 1, newton, (guess, jnp.zeros((states, states + 1))))

        def halve(
            _: Array | int, carry: tuple[Array, Array, Array, Array]
        ) -> tuple[Array, Array, Array, Array]:
            low, high = carry[:2]
            middle, slope = correct(0.5 * (low + high))
            ahead = jnp.linalg.solve(
                jnp.concatenate([slope, chord[None]]), jnp.zeros(states + 1).at[-1].set(1.0)
            )
            test = critical_values(slope[:, :states] + jnp.eye(states), ahead)[kind]
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


_repeats_jitted = eqx.filter_jit(_repeats)


def find_special_points(
    live: ParameterFamily,
    method: ShootingMethod,
    scale: Float[Array, "branch state"],
    unknowns: Float[Array, "branch point unknown"],
    tangents: Float[Array, "branch point unknown"],
    counts: Int[np.ndarray, " branch"],
) -> tuple[SpecialPoint, ...]:
    """Find the bifurcations along a batch of branches.

    Args:
        live: isolators and drives, drive with a leading axis; its derivatives reach the points.
        method: how the orbits are closed.
        scale: size of each state.
        unknowns: points.
        tangents: along the branches.
        counts: points found on each.

    Returns:
        The points, branch after branch.
    """
    family = frozen(live)
    tests = np.asarray(critical_values_along(family, method, scale, unknowns, tangents))
    changes = (np.sign(tests[:, :-1]) != np.sign(tests[:, 1:])) & np.isfinite(tests[:, :-1] * tests[:, 1:])
    changes &= (np.arange(tests.shape[1] - 1) < counts[:, None] - 1)[..., None]
    lanes, places, kinds = np.nonzero(changes)
    if not lanes.size:
        return ()
    padded = np.resize(np.arange(lanes.size), -(-lanes.size // _LOCATED_AT_ONCE) * _LOCATED_AT_ONCE)
    lane, place, which = lanes[padded], places[padded], kinds[padded]
    ends = (unknowns[lane, place], unknowns[lane, place + 1])
    there = family.driven(family.amplitude[lane], family.frequency[lane])
    change = jnp.asarray(tests[lane, place, which]), jnp.asarray(which)
    located = _locate(there, method, scale[lane], ends, change, _BISECTIONS)
    crossed, points = _crossed(family, method), []
    for branch, test, found, matrix, repeats in zip(lanes, kinds, *located, strict=False):
        judged = _kind_of_sign_change(int(test), method, np.asarray(matrix))
        if test == 0 and crossed is not None and _distance(crossed[0], repeats) < _SAME_MOTION:
            judged = crossed
        if judged is not None:
            own = live.driven(live.amplitude[branch], live.frequency[branch])
            size = scale[branch]
            guess = PointGuess(found[: size.size] * size, found[size.size :])
            point = special_point(own, judged[1], judged[0], int(branch), guess)
            if judged[0] == "fold" and crossed is not None and not _is_fold(own, size, point, crossed[0]):
                other = special_point(own, crossed[1], crossed[0], int(branch), guess)
                point = other if is_successful(other.result) else point
            points.append(point)
    return tuple(points)


def _crossed(
    family: ParameterFamily, method: ShootingMethod
) -> tuple[BifurcationKind, ShootingMethod] | None:
    """Give what a branch meets where it crosses the one that it may have left, and how orbits close there."""
    once = ShootingMethod(method.integrator, 1, False)
    if method.periods == 1 and not method.half and is_odd(family.model):
        return "symmetry_breaking", ShootingMethod(method.integrator, 1, True)
    return ("period_doubling", once) if method.periods == 2 else None


def _distance(crossing: BifurcationKind, repeats: Float[Array, "2"]) -> float:
    """Give how far a motion is from one of the branch that is crossed there; see `_repeats`."""
    return float(repeats[0 if crossing == "symmetry_breaking" else 1])


def _is_fold(family: ParameterFamily, scale: Array, point: SpecialPoint, crossing: BifurcationKind) -> bool:
    """Whether a point was found and is not where the branch crosses the one that it left.

    At a crossing the equations of the search are singular, so that it may stop beside it, too far for the
    motion to count as symmetric or repeated; the fold's own equations then lead there or nowhere.
    """
    if not is_successful(point.result):
        return False
    family, point = frozen((family, point))
    shares = family.shares(point.value[None])
    repeats = _repeats_jitted(family, point.method, scale, point.y0 / scale, shares)
    return _distance(crossing, repeats) >= _SAME_MOTION


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


def special_point(
    family: ParameterFamily,
    method: ShootingMethod,
    kind: BifurcationKind,
    branch: int,
    guess: PointGuess,
    within: float = LOCATED_WITHIN,
) -> SpecialPoint:
    """Give a bifurcation found from a start, the motion split at its kinks.

    Args:
        family: isolators and drives along one parameter.
        method: how the orbit is closed.
        kind: which bifurcation.
        branch: which branch of a batch it lies on.
        guess: start of the search.
        within: distance from the start, as a share of the parameter's range, up to which the point counts.

    Returns:
        The point.
    """
    places = event_places(family.model, method.turns)
    # A number on the device, so that what is compiled serves for all.
    still, guess, reach = *frozen((family, guess)), jnp.asarray(within)
    found = polish_jitted(still, method, kind, guess, places, within=reach)
    while not isinstance(found.complete, Tracer) and not found.complete and places < MOST_PLACES:
        places *= 2
        found = polish_jitted(still, method, kind, guess, places, within=reach)
    return _found_point(family, method, kind, branch, found)


@eqx.filter_jit
def _found_point(
    family: ParameterFamily, method: ShootingMethod, kind: BifurcationKind, branch: int, found: Polished
) -> SpecialPoint:
    good = found.found & found.complete
    found = found.moving(family)
    blank = jnp.where(good, 1.0, jnp.nan)
    setting = family.at(found.shares)
    roots = multipliers(found.matrix * blank)
    result = RESULTS.where(good, RESULTS.promote(diffrax.RESULTS.successful), RESULTS.not_converged)
    return SpecialPoint(
        kind,
        method.periods,
        branch,
        family.values(found.shares)[0] * blank,
        jnp.asarray(setting.amplitude) * blank,
        jnp.asarray(setting.frequency) * blank,
        found.state * blank,
        roots * roots if method.half else roots,
        roots if method.half else jnp.full(roots.shape, jnp.nan + 0j),
        found.direction * found.scale,
        result,
        family,
        method.integrator,
        method.half,
    )
