"""Bifurcations that a branch of a fitted model lacks, and a model within its errors has.

A test function that comes near zero along the branch without reaching it, such as the slope of the parameter
at a fold, says how far: at its extremum its first derivative by the coefficients is that of its value, and
the nearest coefficients at which it vanishes follow. There the branch is followed again. What it meets is
the start from which `find_again` finds the bifurcation for every draw that has it.
"""

import dataclasses
from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..._implicit import frozen
from ..._quick_jit import quick_jit
from ..._results import is_successful
from ..._small_systems import solve
from ...models import CoefficientErrors, Isolator
from ..orbit import ShootingMethod, value_and_jacobian
from ._branch import Branch, SpecialPoint
from ._branch_point import moved_across
from ._criticality import BifurcationKind, critical_values
from ._parameter_family import ParameterFamily
from ._tracing import lanes_of

_FARTHEST_MODEL = 3.5
"""Standard deviations up to which the nearest coefficients with a bifurcation are sought: beyond, fewer than
one model in four thousand has it."""

_BEYOND = (0.4, 1.0, 2.0)
"""Standard deviations past these at which the branch is followed, until it has the bifurcation: there it lies
clear of where it vanishes."""

_TRIED_AT_ONCE = 4
"""Extrema of which derivatives are taken together, so that one shape is compiled."""

_PAIR = 2
"""Bifurcations that begin together where a test function reaches zero without crossing it."""


class _Dip(NamedTuple):
    """Where a test function comes near zero without reaching it."""

    test: int
    lane: int
    place: int


def find_possible_points(
    branch: Branch, errors: CoefficientErrors, again: Callable[[Isolator], Branch]
) -> tuple[tuple[SpecialPoint, ...], int]:
    """Find bifurcations that the branch of a fitted model lacks, at the nearest model that has them.

    Args:
        branch: of the fitted model, frozen.
        errors: of its coefficients.
        again: follows the same branch for another isolator.

    Returns:
        They, each at another model: that of its `family`. And the places where to first order there is one
        within reach, or nobody knows, but none was found at the models tried.

    Source: Hasofer & Lind 1974, J. Eng. Mech. Div. ASCE 100:111 (the nearest point at which a limit is
    reached).
    """
    method = ShootingMethod(branch.integrator, branch.periods, branch.symmetric)
    family, *lanes = lanes_of(branch)
    curves = _Curves(*lanes)
    tests = np.asarray(_tests(family, method, *curves))
    found: list[SpecialPoint] = []
    undecided = 0
    dips = _dips(tests)
    for first in range(0, len(dips), _TRIED_AT_ONCE):
        some = dips[first : first + _TRIED_AT_ONCE]
        values, slopes = _with_slopes(branch, method, curves, some, errors)
        for dip, value, slope in zip(some, values, slopes, strict=True):
            size = float(np.linalg.norm(slope))
            if size == 0.0 or abs(value) > _FARTHEST_MODEL * size:
                continue
            way = -np.sign(value) * slope / size
            new = _new_points(branch, errors, again, dip, (abs(value) / size, way)) if size > 0.0 else []
            found, undecided = found + new, undecided + (not new)
    return tuple(found), undecided


class _Curves(NamedTuple):
    """The points of a batch of branches: scaled states and shares."""

    scale: Float[Array, "branch state"]
    unknowns: Float[Array, "branch point unknown"]
    tangents: Float[Array, "branch point unknown"]

    def at(self, dips: list[_Dip]) -> "_Curves":
        """Give single points as branches of one point."""
        lane, place = np.array([dip.lane for dip in dips]), np.array([dip.place for dip in dips])
        return _Curves(
            self.scale[lane], self.unknowns[lane, place][:, None], self.tangents[lane, place][:, None]
        )


@quick_jit
def _tests(
    family: ParameterFamily,
    method: ShootingMethod,
    scale: Float[Array, "branch state"],
    unknowns: Float[Array, "branch point unknown"],
    tangents: Float[Array, "branch point unknown"],
) -> Float[Array, "branch point test"]:
    """Give the test functions of bifurcations along branches, which move across themselves with the model."""

    def lane(amplitude: Array, frequency: Array, scale: Array, unknown: Array, tangent: Array) -> Array:
        here, states = family.driven(amplitude, frequency), scale.shape[0]

        def point(u: Array, t: Array) -> Array:
            moved, _ = moved_across(here, method, scale, u, t)
            _, slope = value_and_jacobian(lambda at: here.open_end(method, scale, at), moved)
            ahead = solve(jnp.concatenate([slope, t[None]]), jnp.zeros(states + 1).at[-1].set(1.0))
            return critical_values(slope[:, :states] + jnp.eye(states), ahead / jnp.linalg.norm(ahead))

        return jax.vmap(point)(unknown, tangent)

    return jax.vmap(lane)(family.amplitude, family.frequency, scale, unknowns, tangents)


def _dips(tests: Float[np.ndarray, "branch point test"]) -> list[_Dip]:
    """Give where each test function has an extremum towards zero on one side of it."""
    before, here, after = tests[:, :-2], tests[:, 1:-1], tests[:, 2:]
    with np.errstate(invalid="ignore"):
        same = (np.sign(before) == np.sign(here)) & (np.sign(after) == np.sign(here)) & (here != 0.0)
        near = (np.abs(here) < np.abs(before)) & (np.abs(here) <= np.abs(after))
    lanes, places, kinds = np.nonzero(same & near)
    return [_Dip(*map(int, one)) for one in zip(kinds, lanes, places + 1, strict=True)]


def _with_slopes(
    branch: Branch, method: ShootingMethod, curves: _Curves, dips: list[_Dip], errors: CoefficientErrors
) -> tuple[Float[np.ndarray, " dip"], Float[np.ndarray, "dip step"]]:
    """Give the test functions at their extrema, and their changes by each independent step."""
    filled = [dips[place % len(dips)] for place in range(_TRIED_AT_ONCE)]
    some, lanes = curves.at(filled), np.array([dip.lane for dip in filled])
    amplitude, frequency = (
        jnp.atleast_1d(one)[lanes] for one in (branch.family.amplitude, branch.family.frequency)
    )
    there = branch.family.driven(amplitude, frequency)

    def tests(model: Isolator) -> Array:
        found = _tests(dataclasses.replace(there, model=model), method, *some)[:, 0]
        return jnp.stack([found[place, dip.test] for place, dip in enumerate(filled)])

    values, slopes = errors.carry(tests)
    return np.asarray(values)[: len(dips)], np.asarray(slopes)[: len(dips)]


def _new_points(
    branch: Branch,
    errors: CoefficientErrors,
    again: Callable[[Isolator], Branch],
    dip: _Dip,
    towards: tuple[float, Float[np.ndarray, " step"]],
) -> list[SpecialPoint]:
    """Give the pair of bifurcations that begins at a dip, at the first model tried that has it."""
    kinds: tuple[BifurcationKind, ...] = (
        "fold",
        "symmetry_breaking" if branch.symmetric else "period_doubling",
        "neimark_sacker",
    )
    kind, (distance, way) = kinds[dip.test], towards
    held = len(_own(branch, kind, dip.lane))
    for beyond in _BEYOND:
        steps = (distance + beyond) * way
        if not errors.inside(steps[None])[0]:
            break
        own = _own(frozen(again(errors.moved(jnp.asarray(steps)))), kind, dip.lane)
        if len(own) >= held + _PAIR:
            away = [_distance(branch, dip, point) for point in own]
            return [own[place] for place in sorted(np.argsort(away, kind="stable")[:_PAIR])]
    return []


def _own(branch: Branch, kind: str, lane: int) -> list[SpecialPoint]:
    """Give the bifurcations of a kind on one branch of a batch."""
    return [
        point
        for point in branch.special_points
        if point.kind == kind and point.branch == lane and is_successful(point.result)
    ]


def _distance(branch: Branch, dip: _Dip, point: SpecialPoint) -> float:
    """Give how far a bifurcation lies from a dip, in scaled states and shares."""
    _, *lanes = lanes_of(branch)
    curves = _Curves(*lanes)
    shares = branch.family.shares(point.value[None])
    there = jnp.concatenate([point.y0 / curves.scale[dip.lane], shares])
    return float(jnp.linalg.norm(there - curves.unknowns[dip.lane, dip.place]))
