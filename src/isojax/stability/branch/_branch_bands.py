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
from ...models import CoefficientErrors, Isolator, band_around, existence, find_band
from ..orbit import ShootingMethod
from ._bifurcation_curves import CodimensionTwoPoint
from ._branch import Branch, SpecialPoint
from ._criticality import BifurcationKind
from ._curve_special_points import find_codimension_two_again
from ._moved_point import moved_guess
from ._special_points import find_bifurcation_again, find_event_again
from ._tracing import branch_points, room_for

_NAMES = ("value", "amplitude", "frequency")
"""Of a special point."""

_DRAWS, _SEED = 1000, 0
"""Draws of the coefficients: those of `uncertainty`, where nothing else is asked for."""


def with_bands(branch: Branch, errors: CoefficientErrors) -> Branch:
    """Give a branch, its special points and the branches beside it their bands.

    Args:
        branch: of the fitted model.
        errors: of its coefficients.

    Returns:
        The same branch.
    """
    branch = frozen(branch)
    return dataclasses.replace(
        branch,
        band=find_band(errors, ("value", "response"), _curve(branch), across=True),
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

        band = find_band(errors, ("amplitude", "frequency"), moved)
        return dataclasses.replace(point, band=band)

    return tuple(one(point) if is_successful(point.result) else point for point in frozen(points))


def _curve(branch: Branch) -> Callable[[Isolator], Float[Array, "quantity ..."]]:
    """Give value and response along a branch as a function of the isolator: they move across the branch."""
    points, single = branch.points, branch.points.value.ndim == 1

    def lanes(values: Array) -> Array:
        return values[None] if single else values

    count = points.value.shape[-1]
    # Rounded up, so that few shapes are compiled.
    room = room_for(np.array([count]), 2 * count + 128) - count
    scale, shares = lanes(branch.scale), branch.family.shares(points.value)
    unknowns = jnp.concatenate([lanes(points.y0) / scale[:, None], lanes(shares)[..., None]], axis=-1)
    unknowns, tangents = (
        jnp.pad(values, ((0, 0), (0, room), (0, 0)), constant_values=jnp.nan)
        for values in (unknowns, lanes(points.tangent))
    )
    method = ShootingMethod(branch.integrator, branch.periods, branch.symmetric)

    def moved(isolator: Isolator) -> Array:
        family = dataclasses.replace(branch.family, model=isolator)
        family = family.driven(*(jnp.atleast_1d(one) for one in (family.amplitude, family.frequency)))
        found = branch_points(family, method, scale, unknowns, tangents)
        both = jnp.stack([found.value, found.response])[..., :count]
        return both[:, 0] if single else both

    return moved


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
        return _place(find_bifurcation_again(point, kind, family))

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
    models = jax.vmap(errors.moved)(jnp.asarray(errors.draw(_DRAWS, _SEED)))
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
