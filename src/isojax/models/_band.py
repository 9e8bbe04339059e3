"""How far a curve of a fitted model may be off."""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from .._show import Row, brief, shown
from ._coefficient_errors import CoefficientErrors
from ._credible_set import credible_set
from ._isolator import Isolator
from ._normal_mixture import CONFIDENCE, HALF_WIDTH
from ._second_order import expanded, expansion_nodes
from ._shifted_curve import shifts_across

_DRAWS, _SEED = 1000, 0
"""Draws of the coefficients: those of `uncertainty`, where nothing else is asked for."""


@shown
class Band(eqx.Module):
    """The band around a curve, point by point: the error of the coefficients.

    It is that of the delta method. Where draws were taken beside it and the two differ by more than a tenth
    of the interval, the band is curved there, and its ends are quantiles of the draws. Draws of a curve are
    those of its expansion to second order; where that is not known, the band to first order stands, and
    counts as curved.

    A curve that may fold back, in the plane of frequency and amplitude, moves across itself: the ends of the
    band then lie on either side of each point, and both coordinates have one.

    Attributes:
        standard_error: of each quantity of the curve, by its name.
        lower: one end of the interval.
        upper: the other end.
        confidence: chance that an interval is meant to hold the truth.
        curved: of each quantity, where the band is curved; None where no draws were taken.
    """

    standard_error: Mapping[str, Float[Array, "..."]]
    lower: Mapping[str, Float[Array, "..."]]
    upper: Mapping[str, Float[Array, "..."]]
    confidence: float = eqx.field(static=True)
    curved: Mapping[str, Bool[Array, "..."]] | None = None

    @property
    def curved_part(self) -> str:
        """How many of its points are curved, in words; "" where none is."""
        if self.curved is None:
            return ""
        bent = np.any([np.asarray(one) for one in self.curved.values()], axis=0)
        # Curves side by side are filled up with NaN to the longest.
        there = np.all([np.isfinite(one) for one in self.standard_error.values()], axis=0)
        bent = np.count_nonzero(bent & there)
        return f"curved at {bent} of {np.count_nonzero(there)} points" if bent else ""

    def _headline(self) -> str:
        bent = f", {self.curved_part}" if self.curved_part else ""
        return f"{self.confidence:.0%} of {', '.join(self.standard_error)}{bent}"

    def _rows(self) -> list[Row]:
        return [
            Row(name, f"± {brief(error)}", "standard error") for name, error in self.standard_error.items()
        ]


@shown
class CurveBeside(NamedTuple):
    """A curve of other models, from which draws of it follow.

    Attributes:
        values: of its quantities at the steps of `expansion_nodes`; NaN where it was not found.
        draws: independent steps in standard deviations.
    """

    values: Float[np.ndarray, "node quantity ..."]
    draws: Float[np.ndarray, "draw step"]


def find_band(
    errors: CoefficientErrors,
    names: tuple[str, ...],
    curve: Callable[[Isolator], Float[Array, "quantity ..."]],
    *,
    drawn: Float[np.ndarray, "draw quantity ..."] | None = None,
    others: Callable[[Isolator], Float[Array, "quantity ..."]] | None = None,
) -> Band:
    """Carry the error of a fit into quantities of its model.

    Args:
        errors: of the coefficients. Take them before the curve is worked out: a fit that has none is refused.
        names: of the quantities.
        curve: gives these quantities for an isolator, differentiable by `jax.jacfwd`.
        drawn: the quantities at coefficients drawn from their distribution, NaN where they do not exist.
        others: in place of `drawn`, gives the quantities of isolators beside the fitted one, under `jax.jit`.

    Returns:
        The band.
    """
    values, change = (np.asarray(one) for one in errors.carry(curve))
    if others is None:
        return band_around(names, values, change, drawn=drawn)
    nodes = jnp.asarray(expansion_nodes(errors.steps))
    beside = np.asarray(jax.lax.map(lambda steps: others(errors.moved(steps)), nodes))
    drawn = values + expanded(beside - values, draw_coefficients(errors))
    sizes = np.linalg.norm(change, axis=-1)
    known = credible_set(values, sizes, drawn, CONFIDENCE)
    straight = values + HALF_WIDTH * np.stack([-sizes, sizes])
    # Where the quantities of another model were not found, the band to first order stands, and is in doubt.
    sure = np.isfinite(known.interval).all(axis=0)
    error, (lower, upper) = (
        np.where(sure, known.standard_error, sizes),
        np.where(sure, known.interval, straight),
    )
    return _named(names, error, lower, upper, known.curved)


def draw_coefficients(errors: CoefficientErrors) -> Float[np.ndarray, "draw step"]:
    """Give the draws that stand beside bands, in standard deviations.

    Args:
        errors: of the coefficients.

    Returns:
        The steps.
    """
    return errors.draw(_DRAWS, _SEED)


def band_around(
    names: tuple[str, ...],
    values: Float[np.ndarray, "quantity ..."],
    change: Float[np.ndarray, "quantity ... step"],
    *,
    drawn: Float[np.ndarray, "draw quantity ..."] | None = None,
) -> Band:
    """Give the band around quantities from their change by each independent step of a covariance.

    Args:
        names: of the quantities.
        values: of these.
        change: by each step of one standard deviation.
        drawn: the quantities at coefficients drawn from their distribution, NaN where they do not exist.

    Returns:
        The band.
    """
    sizes = np.linalg.norm(change, axis=-1)
    if drawn is None:
        return _named(names, sizes, values - HALF_WIDTH * sizes, values + HALF_WIDTH * sizes, None)
    known = credible_set(values, sizes, drawn, CONFIDENCE)
    lower, upper = known.interval
    return _named(names, known.standard_error, lower, upper, known.curved)


def find_band_across(
    errors: CoefficientErrors,
    names: tuple[str, str],
    curve: Callable[[Isolator], Float[Array, "quantity ..."]],
    beside: CurveBeside | None = None,
) -> Band:
    """Carry the error of a fit into a curve of its model that may fold back, in the plane of two quantities.

    Args:
        errors: of the coefficients.
        names: of the two.
        curve: gives both along the curve for an isolator, differentiable by `jax.jacfwd`.
        beside: the curve of other models; None for a band to first order.

    Returns:
        The band.
    """
    values, change = (np.asarray(one) for one in errors.carry(curve))
    return band_across(names, values, change, beside)


def band_across(
    names: tuple[str, str],
    values: Float[np.ndarray, "quantity ..."],
    change: Float[np.ndarray, "quantity ... step"],
    beside: CurveBeside | None = None,
) -> Band:
    """Give the band around a curve that may fold back, in the plane of two quantities: along its normal.

    Args:
        names: of the two.
        values: along the curve.
        change: by each step of one standard deviation; a shift of the curve along itself moves nothing.
        beside: the curve of other models; None for a band to first order.

    Returns:
        The band.
    """
    extent = np.nanmax(values, axis=-1, keepdims=True) - np.nanmin(values, axis=-1, keepdims=True)
    extent = np.where(extent > 0.0, extent, 1.0)
    along = np.gradient(values / extent, axis=-1)
    normal = np.stack([-along[1], along[0]]) / np.maximum(np.hypot(along[0], along[1]), 1e-300)
    own = np.linalg.norm(np.sum(normal[..., None] * change / extent[..., None], axis=0), axis=-1)
    ends, curved = (-HALF_WIDTH * own, HALF_WIDTH * own), None
    if beside is not None:
        shifts = shifts_across(values / extent, beside.values / extent, normal)
        known = credible_set(0.0 * own, own, expanded(shifts, beside.draws), CONFIDENCE)
        # Where the curve of another model was not found, the band to first order stands, and is in doubt.
        sure = np.isfinite(known.interval).all(axis=0)
        ends = np.where(sure, known.interval, ends)
        curved = np.broadcast_to(known.curved, values.shape)
    lower, upper = (values + end * normal * extent for end in ends)
    return _named(names, np.linalg.norm(change, axis=-1), lower, upper, curved)


def _named(
    names: tuple[str, ...],
    error: np.ndarray,
    lower: np.ndarray,
    upper: np.ndarray,
    curved: np.ndarray | None,
) -> Band:
    def by_name(numbers: np.ndarray) -> dict[str, Array]:
        return {name: jnp.asarray(one) for name, one in zip(names, numbers, strict=True)}

    bent = None if curved is None else by_name(curved)
    return Band(by_name(error), by_name(lower), by_name(upper), CONFIDENCE, bent)
