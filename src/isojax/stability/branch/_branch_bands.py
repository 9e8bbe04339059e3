"""How far a branch and its special points may be off: the error of a fit, carried into each of them."""

import dataclasses
from collections.abc import Callable
from typing import get_args

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..._implicit import frozen
from ..._quick_jit import quick_jit
from ..._results import is_successful
from ...models import (
    CoefficientErrors,
    CurveBeside,
    Isolator,
    band_around,
    draw_coefficients,
    existence,
    expansion_nodes,
    find_band,
    find_band_across,
)
from ..orbit import ShootingMethod
from ._bifurcation_curves import CodimensionTwoPoint
from ._branch import Branch, SpecialPoint
from ._branch_point import orbit_at
from ._criticality import BifurcationKind
from ._curve_special_points import find_codimension_two_again
from ._moved_point import corrected, moved_guess
from ._parameter_family import ParameterFamily
from ._special_points import bifurcation_moving, find_event_again
from ._tracing import branch_points, lanes_of

_NAMES = ("value", "amplitude", "frequency")
"""Of a special point."""


def with_bands(branch: Branch, errors: CoefficientErrors) -> Branch:
    """Give a branch, its special points and the branches beside it their bands.

    Args:
        branch: of the fitted model.
        errors: of its coefficients.

    Returns:
        The same branch.
    """
    branch = frozen(branch)
    curve, beside = _curve(branch), CurveBeside(_curves_beside(branch, errors), draw_coefficients(errors))
    return dataclasses.replace(
        branch,
        band=find_band_across(errors, ("value", "response"), curve, beside),
        special_points=tuple(_point_with_band(branch, point, errors) for point in branch.special_points),
        others=tuple(with_bands(other, errors) for other in branch.others),
    )


def with_bands_at(
    points: tuple[CodimensionTwoPoint, ...], errors: CoefficientErrors
) -> tuple[CodimensionTwoPoint, ...]:
    """Give the special points of a curve of bifurcations their bands.

    Args:
        points: of the fitted model.
        errors: of its coefficients.

    Returns:
        The same points; one that was not found has no band.
    """

    def one(point: CodimensionTwoPoint) -> CodimensionTwoPoint:
        def moved(isolator: Isolator) -> Array:
            found = find_codimension_two_again(point, isolator)
            return jnp.stack([found.amplitude, found.frequency])

        band = find_band(errors, ("amplitude", "frequency"), moved, others=moved)
        return dataclasses.replace(point, band=band)

    return tuple(one(point) if is_successful(point.result) else point for point in frozen(points))


def _curve(branch: Branch) -> Callable[[Isolator], Float[Array, "quantity ..."]]:
    """Give value and response along a branch as a function of the isolator: they move across the branch."""
    single, count = branch.points.value.ndim == 1, branch.points.value.shape[-1]
    family, scale, unknowns, tangents = lanes_of(branch)
    method = ShootingMethod(branch.integrator, branch.periods, branch.symmetric)

    def moved(isolator: Isolator) -> Array:
        there = dataclasses.replace(family, model=isolator)
        found, _ = branch_points(there, method, scale, unknowns, tangents)
        both = jnp.stack([found.value, found.response])[..., :count]
        return both[:, 0] if single else both

    return moved


def _curves_beside(branch: Branch, errors: CoefficientErrors) -> Float[np.ndarray, "node quantity ..."]:
    """Give value and response along the branches of other models, each point across from the known one."""
    models = jax.vmap(errors.moved)(jnp.asarray(expansion_nodes(errors.steps)))
    method = ShootingMethod(branch.integrator, branch.periods, branch.symmetric)
    found = np.asarray(_moved_far(method, *lanes_of(branch), models))
    found = found[..., : branch.points.value.shape[-1]]
    return found[:, :, 0] if branch.points.value.ndim == 1 else found


@quick_jit
def _moved_far(
    method: ShootingMethod,
    family: ParameterFamily,
    scale: Float[Array, "branch state"],
    unknowns: Float[Array, "branch point unknown"],
    tangents: Float[Array, "branch point unknown"],
    models: Isolator,
) -> Float[Array, "node quantity branch point"]:
    """Give value and response where the branches of other isolators cross planes; NaN where not found."""

    def curve(model: Isolator) -> Array:
        def lane(amplitude: Array, frequency: Array, scale: Array, unknown: Array, normal: Array) -> Array:
            here = dataclasses.replace(family, model=model).driven(amplitude, frequency)

            def point(guess: Array, normal: Array) -> Array:
                found = corrected(here, guess, normal, method=method, scale=scale, test=_rise)
                orbit = orbit_at(here, method, scale, found.unknown, found.tangent)
                return jnp.stack([orbit.value, orbit.response]) * jnp.where(found.sound, 1.0, jnp.nan)

            return jax.vmap(point, out_axes=1)(unknown, normal)

        drives = family.amplitude, family.frequency
        return jax.vmap(lane, out_axes=1)(*drives, scale, unknowns, tangents)

    return jax.lax.map(curve, models)


def _rise(_: Array, __: Array, tangent: Array) -> Array:
    return tangent[-1]


def _point_with_band(branch: Branch, point: SpecialPoint, errors: CoefficientErrors) -> SpecialPoint:
    if not is_successful(point.result):
        return point
    kind = _kind_of(point)
    if kind is None:
        event = next(event for event in branch.events if event.name == point.kind)
        scale = jnp.atleast_2d(branch.scale)[point.branch]

        def moved(isolator: Isolator) -> Array:
            family = dataclasses.replace(point.family, model=isolator)
            return _place(find_event_again(point, event, family, scale))

        # An event is only differentiated, not sought anew: no draws of it.
        return dataclasses.replace(point, band=find_band(errors, _NAMES, moved))

    def found(isolator: Isolator) -> Array:
        family = dataclasses.replace(point.family, model=isolator)
        return _place(bifurcation_moving(point, kind, family))

    drawn = _drawn(point, kind, errors)
    share, error = (float(one) for one in existence(drawn[:, 0]))
    band = find_band(errors, _NAMES, found, drawn=drawn)
    return dataclasses.replace(point, band=band, probability=share, probability_error=error)


def with_probability(point: SpecialPoint, errors: CoefficientErrors) -> SpecialPoint:
    """Give a bifurcation that the fitted model lacks its probability, and its band where it exists.

    Args:
        point: at a model that has it.
        errors: of the fitted coefficients.

    Returns:
        The same point.
    """
    kind = _kind_of(point)
    assert kind is not None
    drawn = _drawn(point, kind, errors)
    share, error = (float(one) for one in existence(drawn[:, 0]))
    nothing = np.full((len(_NAMES), errors.steps), np.nan)
    band = band_around(_NAMES, nothing[:, 0], nothing, drawn=drawn)
    return dataclasses.replace(point, band=band, probability=share, probability_error=error)


def _kind_of(point: SpecialPoint) -> BifurcationKind | None:
    return next((name for name in get_args(BifurcationKind) if name == point.kind), None)


def _place(point: SpecialPoint) -> Float[Array, " quantity"]:
    return jnp.stack([point.value, point.amplitude, point.frequency])


def _drawn(
    point: SpecialPoint, kind: BifurcationKind, errors: CoefficientErrors
) -> Float[np.ndarray, "draw quantity"]:
    """Give a bifurcation at coefficients drawn from their distribution; NaN where it does not exist."""
    models = jax.vmap(errors.moved)(jnp.asarray(draw_coefficients(errors)))
    return np.asarray(_found_at(frozen(point), kind, models))


@quick_jit
def _found_at(point: SpecialPoint, kind: BifurcationKind, models: Isolator) -> Float[Array, "draw quantity"]:
    """Give a bifurcation of a batch of isolators, by the steps of the branch: a band asks for no more."""

    def one(model: Isolator) -> Array:
        family = dataclasses.replace(point.family, model=model)
        shares = moved_guess(point, kind, family).shares
        there = family.at(shares)
        known = jnp.where(jnp.isfinite(shares[0]), 1.0, jnp.nan)
        return jnp.stack([family.values(shares)[0], there.amplitude * known, there.frequency * known])

    return jax.vmap(one)(models)
