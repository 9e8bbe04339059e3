"""Bifurcations along a branch, and events: located between its points, and then found exactly."""

import diffrax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jaxtyping import Array, Float

from ..._implicit import frozen, with_derivatives
from ..._quick_jit import quick_jit
from ..._results import RESULTS, is_successful
from ..orbit import ShootingMethod, event_places, multipliers
from ._branch import BranchEvent, BranchPoints, SpecialPoint
from ._branch_point import orbit_at
from ._criticality import BifurcationKind
from ._extended_system import (
    LOCATED_WITHIN,
    MOST_PLACES,
    PointGuess,
    Polished,
    polish_jitted,
)
from ._locating import SAME_MOTION, BranchCurves, crossed_branch, distance_from, locate, repeats_jitted
from ._moved_point import moved_guess
from ._parameter_family import ParameterFamily

moved_guess_jitted = quick_jit(moved_guess)


def find_special_points(
    live: ParameterFamily,
    method: ShootingMethod,
    curves: BranchCurves,
    events: tuple[BranchEvent, ...],
    points: BranchPoints,
) -> tuple[SpecialPoint, ...]:
    """Find the bifurcations along a batch of branches, and events.

    Args:
        live: isolators and drives, drive with a leading axis; its derivatives reach the points.
        method: how the orbits are closed.
        curves: the branches.
        events: what to look out for.
        points: what is known of the branches' points.

    Returns:
        The points, branch after branch.
    """
    still, known = frozen((live, points))
    crossed, found = crossed_branch(still, method), []
    for kind, own, branch, guess, event in locate(still, method, curves, events, known):
        there = live.driven(live.amplitude[branch], live.frequency[branch])
        scale = jnp.asarray(np.asarray(curves.scale)[branch])
        if kind is None:
            found.append(_event_point(there, own, event, branch, scale, guess))
            continue
        point = special_point(there, own, kind, branch, guess)
        if kind == "fold" and crossed is not None and not _is_fold(there, scale, point, crossed[0]):
            other = special_point(there, crossed[1], crossed[0], branch, guess)
            point = other if is_successful(other.result) else point
        found.append(point)
    return tuple(found)


def _is_fold(family: ParameterFamily, scale: Array, point: SpecialPoint, crossing: BifurcationKind) -> bool:
    """Whether a point was found and is not where the branch crosses the one that it left.

    At a crossing the equations of the search are singular, so that it may stop beside it, too far for the
    motion to count as symmetric or repeated; the fold's own equations then lead there or nowhere.
    """
    if not is_successful(point.result):
        return False
    family, point = frozen((family, point))
    shares = family.shares(point.value[None])
    repeats = repeats_jitted(family, point.method, scale, point.y0 / scale, shares)
    return distance_from(crossing, repeats) >= SAME_MOTION


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


def find_bifurcation_again(
    point: SpecialPoint, kind: BifurcationKind, family: ParameterFamily
) -> SpecialPoint:
    """Find a bifurcation of a branch again among other isolators and drives: on the branch there, or nowhere.

    Args:
        point: the known point; no number of it is traced.
        kind: which bifurcation it is.
        family: isolators and drives along the same parameter over the same range.

    Returns:
        The point there.
    """
    guess = moved_guess_jitted(point, kind, frozen(family))
    return special_point(family, point.method, kind, point.branch, guess)


def bifurcation_moving(point: SpecialPoint, kind: BifurcationKind, family: ParameterFamily) -> SpecialPoint:
    """Give a bifurcation of a branch with its derivatives by the isolators and drives.

    Args:
        point: the known point; no number of it is traced.
        kind: which bifurcation it is.
        family: the same isolators and drives; their derivatives reach the point.

    Returns:
        The point.
    """
    guess = PointGuess(point.y0, point.family.shares(point.value[None]))
    return special_point(family, point.method, kind, point.branch, guess)


def find_event_again(
    point: SpecialPoint, event: BranchEvent, family: ParameterFamily, scale: Float[Array, " state"]
) -> SpecialPoint:
    """Give an event of a branch with its derivatives by other isolators and drives.

    Args:
        point: the known point; no number of it is traced.
        event: which event it is.
        family: the same isolators and drives; their derivatives reach the point.
        scale: size of each state.

    Returns:
        The point.
    """
    guess = PointGuess(point.y0, point.family.shares(point.value[None]))
    return _event_point(family, point.method, event, point.branch, scale, guess)


@quick_jit
def _found_point(
    family: ParameterFamily, method: ShootingMethod, kind: BifurcationKind, branch: int, found: Polished
) -> SpecialPoint:
    paired = (kind != "neimark_sacker") | (jnp.abs(found.cosine) <= 1.0)
    good = found.found & found.complete & paired
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


def _event_equations(
    unknown: Float[Array, " unknown"],
    family: ParameterFamily,
    held: tuple[ShootingMethod, Float[Array, " state"], BranchEvent],
) -> tuple[Float[Array, " unknown"], Float[Array, " unknown"]]:
    """Give what vanishes where an event happens: the equations of its derivatives."""
    method, scale, event = held
    left = family.open_end(method, scale, unknown)
    orbit = orbit_at(family, method, scale, unknown, jnp.zeros_like(unknown))
    return jnp.concatenate([left, jnp.asarray(event.function(orbit), float)[None]]), unknown


@quick_jit
def _event_point(
    family: ParameterFamily,
    method: ShootingMethod,
    event: BranchEvent,
    branch: int,
    scale: Float[Array, " state"],
    guess: PointGuess,
) -> SpecialPoint:
    """Give the orbit at which an event happens, by the steps of the branch."""
    found = jnp.concatenate([guess.state / scale, guess.shares])
    unknown = with_derivatives(found, _event_equations, found, family, (method, scale, event))
    orbit = orbit_at(family, method, scale, unknown, jnp.zeros_like(unknown))
    left = jnp.max(jnp.abs(frozen(family).open_end(method, scale, found)))
    good = left < method.integrator.residual_tolerance
    blank = jnp.where(good, 1.0, jnp.nan)
    return SpecialPoint(
        event.name,
        method.periods,
        branch,
        orbit.value * blank,
        orbit.amplitude * blank,
        orbit.frequency * blank,
        orbit.y0 * blank,
        orbit.multipliers * blank,
        orbit.half_period_multipliers * blank,
        jnp.full(scale.shape, jnp.nan),
        RESULTS.where(good, RESULTS.promote(diffrax.RESULTS.successful), RESULTS.not_converged),
        family,
        method.integrator,
        method.half,
    )
