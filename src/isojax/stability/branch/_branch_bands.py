"""How far a branch and its special points may be off: the error of a fit, carried into each of them."""

import dataclasses
from collections.abc import Callable
from typing import get_args

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..._implicit import frozen
from ..._results import is_successful
from ...models import CoefficientErrors, Isolator, find_band
from ..orbit import ShootingMethod
from ._bifurcation_curves import CodimensionTwoPoint
from ._branch import Branch, SpecialPoint
from ._criticality import BifurcationKind
from ._curve_special_points import find_codimension_two_again
from ._special_points import find_bifurcation_again, find_event_again
from ._tracing import branch_points, room_for


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
    kind = next((name for name in get_args(BifurcationKind) if name == point.kind), None)

    def moved(isolator: Isolator) -> Array:
        family = dataclasses.replace(point.family, model=isolator)
        if kind is None:
            event = next(event for event in branch.events if event.name == point.kind)
            found = find_event_again(point, event, family, jnp.atleast_2d(branch.scale)[point.branch])
        else:
            found = find_bifurcation_again(point, kind, family)
        return jnp.stack([found.value, found.amplitude, found.frequency])

    band = find_band(errors, ("value", "amplitude", "frequency"), moved)
    return dataclasses.replace(point, band=band)
