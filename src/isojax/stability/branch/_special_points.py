"""Bifurcations along a branch: test function, change of sign, bisection, and then the extended equations."""

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from ..._results import RESULTS, is_successful
from ...models import Integrator
from ..orbit import multipliers, period_map
from ._branch import SpecialPoint
from ._extended_system import Kind, first_places, polish_jitted
from ._parameter_family import Family

_BISECTIONS, _CORRECTIONS = 14, 4
"""Halvings of the step in which a test function changes sign, and steps of Newton's method in each."""

_LANES = 4
"""Located together; their count is rounded up to this, so that few shapes are compiled."""

_MIRRORED = 1e-3
"""Distance of the two halves of a motion, over its size, below which it counts as symmetric: bisection leaves
a ten-thousandth of a step."""


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
    family: Family, integrator: Integrator, turns: float, scale: Array, here: Array
) -> tuple[Array, Array]:
    """Give what is left open at a point and its derivative by state and share."""
    states = scale.shape[0]

    def open_end(u: Array) -> Array:
        return family.image(integrator, turns, scale, u[:states], u[states:]) - u[:states]

    return open_end(here), jax.jacfwd(open_end)(here)


@eqx.filter_jit
def critical_values_along(
    family: Family, integrator: Integrator, turns: float, scale: Array, unknowns: Array, tangents: Array
) -> Float[Array, "branch point test"]:
    """Give the test functions at every point of a batch of branches.

    Args:
        family: isolators and drives, drive with a leading axis.
        integrator: steps and solver.
        turns: drive periods of the map.
        scale: size of each state, branch first.
        unknowns: points, branch first.
        tangents: along the branches.

    Returns:
        Test functions.
    """

    def lane(amplitude: Array, frequency: Array, scale: Array, unknown: Array, tangent: Array) -> Array:
        here = eqx.tree_at(lambda f: (f.amplitude, f.frequency), family, (amplitude, frequency))
        states = scale.shape[0]

        def point(u: Array, t: Array) -> Array:
            _, slope = _slopes(here, integrator, turns, scale, u)
            return critical_values(slope[:, :states] + jnp.eye(states), t)

        return jax.vmap(point)(unknown, tangent)

    return jax.vmap(lane)(family.amplitude, family.frequency, scale, unknowns, tangents)


@eqx.filter_jit
def _locate(
    family: Family,
    integrator: Integrator,
    turns: float,
    scale: Float[Array, "lane state"],
    ends: tuple[Array, Array],
    before: Float[Array, " lane"],
    which: Int[Array, " lane"],
    bisections: int,
) -> tuple[Array, Array, Array]:
    """Bisect; give the points, their matrices, and how far the two halves of each motion differ."""

    def lane(
        amplitude: Array, frequency: Array, scale: Array, low: Array, high: Array, sign: Array, kind: Array
    ):
        here = eqx.tree_at(lambda f: (f.amplitude, f.frequency), family, (amplitude, frequency))
        states = scale.shape[0]
        chord = (high - low) / jnp.linalg.norm(high - low)

        def correct(guess: Array) -> Array:
            def newton(_: Array | int, u: Array) -> Array:
                left, slope = _slopes(here, integrator, turns, scale, u)
                across = jnp.dot(chord, u - guess)
                return u - jnp.linalg.solve(
                    jnp.concatenate([slope, chord[None]]), jnp.concatenate([left, across[None]])
                )

            return jax.lax.fori_loop(0, _CORRECTIONS, newton, guess)

        def halve(_: Array | int, ends: tuple[Array, Array]) -> tuple[Array, Array]:
            low, high = ends
            middle = correct(0.5 * (low + high))
            _, slope = _slopes(here, integrator, turns, scale, middle)
            ahead = jnp.linalg.solve(
                jnp.concatenate([slope, chord[None]]), jnp.zeros(states + 1).at[-1].set(1.0)
            )
            test = critical_values(slope[:, :states] + jnp.eye(states), ahead)[kind]
            same = test * sign > 0.0
            return jnp.where(same, middle, low), jnp.where(same, high, middle)

        low, high = jax.lax.fori_loop(0, bisections, halve, (low, high))
        found = correct(0.5 * (low + high))
        _, slope = _slopes(here, integrator, turns, scale, found)
        repeats = _repeats(here, integrator, scale, found[:states], found[states:])
        return found, slope[:, :states] + jnp.eye(states), repeats

    return jax.vmap(lane)(family.amplitude, family.frequency, scale, *ends, before, which)


def _repeats(
    family: Family, integrator: Integrator, scale: Array, scaled: Array, shares: Array
) -> Float[Array, "2"]:
    """Give the distance of the motion from its mirror image half a period on, and from itself a period on."""
    setting = family.at(shares)
    begin = tuple(scaled * scale)
    later = (period_map(setting.model, integrator, setting.drive, begin, turns=turns) for turns in (0.5, 1.0))
    off = [jnp.max(jnp.abs(jnp.stack(state) / scale - scaled)) for state in later]
    return jnp.stack(off) / jnp.max(jnp.abs(scaled))


_repeats_jitted = eqx.filter_jit(_repeats)


def find_special_points(
    live: Family,
    integrator: Integrator,
    periods: int,
    half: bool,
    odd: bool,
    scale: Float[Array, "branch state"],
    unknowns: Float[Array, "branch point unknown"],
    tangents: Float[Array, "branch point unknown"],
    counts: Int[np.ndarray, " branch"],
) -> tuple[SpecialPoint, ...]:
    """Find the bifurcations along a batch of branches.

    Args:
        live: isolators and drives, drive with a leading axis; its derivatives reach the points.
        integrator: steps and solver.
        periods: drive periods after which the orbits repeat.
        half: whether the orbits were closed with the half-period map.
        odd: whether the model is odd, so that asymmetric orbits may end in symmetric ones.
        scale: size of each state.
        unknowns: points.
        tangents: along the branches.
        counts: points found on each.

    Returns:
        The points, branch after branch.
    """
    family = jax.lax.stop_gradient(live)
    turns = 0.5 if half else float(periods)
    tests = np.asarray(critical_values_along(family, integrator, turns, scale, unknowns, tangents))
    changes = (np.sign(tests[:, :-1]) != np.sign(tests[:, 1:])) & np.isfinite(tests[:, :-1] * tests[:, 1:])
    changes &= (np.arange(tests.shape[1] - 1) < counts[:, None] - 1)[..., None]
    lanes, places, kinds = np.nonzero(changes)
    if not lanes.size:
        return ()
    padded = np.resize(np.arange(lanes.size), -(-lanes.size // _LANES) * _LANES)
    lane, place, which = lanes[padded], places[padded], kinds[padded]
    ends = (unknowns[lane, place], unknowns[lane, place + 1])
    drives = (family.amplitude[lane], family.frequency[lane])
    there = eqx.tree_at(lambda f: (f.amplitude, f.frequency), family, drives)
    before = jnp.asarray(tests[lane, place, which])
    found, matrices, repeats = _locate(
        there, integrator, turns, scale[lane], ends, before, jnp.asarray(which), _BISECTIONS
    )
    points = []
    for index in range(lanes.size):
        kind, own_periods, own_half = _judge(
            which[index], periods, half, odd, np.asarray(matrices[index]), np.asarray(repeats[index])
        )
        if kind is not None:
            own = eqx.tree_at(
                lambda f: (f.amplitude, f.frequency),
                live,
                (live.amplitude[lanes[index]], live.frequency[lanes[index]]),
            )
            states = scale.shape[1]
            size, lane_number = scale[lanes[index]], int(lanes[index])
            state, shares = found[index, :states] * size, found[index, states:]
            point = special_point(own, integrator, kind, own_periods, own_half, lane_number, state, shares)
            crossed = _crossed(periods, half, odd) if kind == "fold" else None
            if crossed is not None and not _is_fold(own, integrator, size, point, crossed[0]):
                other = special_point(own, integrator, *crossed, lane_number, state, shares)
                point = other if is_successful(other.result) else point
            points.append(point)
    return tuple(points)


def _crossed(periods: int, half: bool, odd: bool) -> tuple[Kind, int, bool] | None:
    """Give what a branch meets where it crosses the one that it may have left."""
    if odd and not half and periods == 1:
        return "symmetry_breaking", 1, True
    return ("period_doubling", 1, False) if periods == 2 else None


def _is_fold(
    family: Family, integrator: Integrator, scale: Array, point: SpecialPoint, crossing: Kind
) -> bool:
    """Whether a point was found and is not where the branch crosses the one that it left.

    At a crossing the equations of the search are singular, so that it may stop beside it, too far for the
    motion to count as symmetric or repeated; the fold's own equations then lead there or nowhere.
    """
    if not is_successful(point.result):
        return False
    family, point = jax.lax.stop_gradient((family, point))
    shares = (point.value - family.start) / (family.stop - family.start)
    mirrored, repeated = _repeats_jitted(family, integrator, scale, point.y0 / scale, shares)
    return float(mirrored if crossing == "symmetry_breaking" else repeated) >= _MIRRORED


def _judge(
    which: int | np.integer,
    periods: int,
    half: bool,
    odd: bool,
    matrix: np.ndarray,
    repeats: np.ndarray,
) -> tuple[Kind | None, int, bool]:
    """Say which bifurcation a sign change is, of which orbit."""
    mirrored, repeated = repeats < _MIRRORED
    if which == 0:
        crossed = _crossed(periods, half, odd)
        if crossed is not None and (mirrored if crossed[0] == "symmetry_breaking" else repeated):
            return crossed
        return "fold", periods, half
    if which == 1:
        return ("symmetry_breaking" if half else "period_doubling"), periods, half
    values = np.linalg.eigvals(matrix)
    first, second = np.triu_indices(values.size, 1)
    pair = np.argmin(np.abs(values[first] * values[second] - 1.0))
    if abs(values[first[pair]].imag) < 1e-6:
        return None, periods, half
    return "neimark_sacker", periods, half


def special_point(
    family: Family,
    integrator: Integrator,
    kind: Kind,
    periods: int,
    half: bool,
    branch: int,
    state: Float[Array, " state"],
    shares: Float[Array, " parameter"],
) -> SpecialPoint:
    """Give a bifurcation found from a start, the motion split at its kinks.

    Args:
        family: isolators and drives along one parameter.
        integrator: steps and solver.
        kind: which bifurcation.
        periods: drive periods after which the orbit repeats.
        half: whether to close it with the half-period map.
        branch: which branch of a batch it lies on.
        state: start at t = 0, SI units.
        shares: start of the parameter.

    Returns:
        The point.
    """
    turns = 0.5 if half else float(periods)
    places = first_places(family, state.shape[0], turns)
    found = polish_jitted(family, integrator, kind, turns, places, state, shares)
    while not bool(jax.lax.stop_gradient(found.complete)) and places < 1000:
        places *= 2
        found = polish_jitted(family, integrator, kind, turns, places, state, shares)
    good = jax.lax.stop_gradient(found.found & found.complete)
    blank = jnp.where(good, 1.0, jnp.nan)
    setting = family.at(found.shares)
    roots = multipliers(found.matrix * blank)
    result = RESULTS.where(good, RESULTS.promote(diffrax.RESULTS.successful), RESULTS.not_converged)
    return SpecialPoint(
        kind,
        periods,
        branch,
        family.values(found.shares)[0] * blank,
        jnp.asarray(setting.amplitude) * blank,
        jnp.asarray(setting.frequency) * blank,
        found.state * blank,
        roots * roots if half else roots,
        roots if half else jnp.full(roots.shape, jnp.nan + 0j),
        found.direction * found.scale,
        result,
        family,
        integrator,
        half,
    )
