"""How far a curve of a fitted model may be off."""

from collections.abc import Callable, Mapping

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.special import ndtri

from .._show import Row, brief, shown
from ._coefficient_errors import EndsEstimated, Estimated, coefficient_errors
from ._isolator import Isolator

CONFIDENCE = 0.95
"""Chance that each point of a band is meant to hold the truth."""


@shown
class Band(eqx.Module):
    """The band around a curve, point by point: the error of the coefficients, to first order.

    A curve that may fold back, in the plane of frequency and amplitude, moves across itself: the ends of the
    band then lie on either side of each point, and both coordinates have one.

    Attributes:
        standard_error: of each quantity of the curve, by its name.
        lower: one end of the interval.
        upper: the other end.
        confidence: chance that an interval is meant to hold the truth.
    """

    standard_error: Mapping[str, Float[Array, "..."]]
    lower: Mapping[str, Float[Array, "..."]]
    upper: Mapping[str, Float[Array, "..."]]
    confidence: float = eqx.field(static=True)

    def _headline(self) -> str:
        return f"{self.confidence:.0%} of {', '.join(self.standard_error)}"

    def _rows(self) -> list[Row]:
        return [
            Row(name, f"± {brief(error)}", "standard error") for name, error in self.standard_error.items()
        ]


def find_band(
    fit: Estimated | EndsEstimated,
    model: Isolator,
    names: tuple[str, ...],
    curve: Callable[[Isolator], Float[Array, "quantity ..."]],
    *,
    across: bool = False,
) -> Band:
    """Carry the error of a fit into a curve of its model.

    Args:
        fit: the fit.
        model: its isolator.
        names: of the quantities of the curve.
        curve: gives these quantities for an isolator, differentiable by `jax.jacfwd`.
        across: whether there are two quantities, and each point moves across the curve through them.

    Returns:
        The band.

    Raises:
        ValueError: if the fit failed, leaves a coefficient undetermined, or is of another model.
    """
    values, change = (np.asarray(one) for one in coefficient_errors(fit, model).carry(curve))
    sizes = np.linalg.norm(change, axis=-1)
    sides = _across(values, change) if across else sizes
    width = -float(ndtri(0.5 * (1.0 - CONFIDENCE)))

    def named(numbers: np.ndarray) -> dict[str, Array]:
        return {name: jnp.asarray(one) for name, one in zip(names, numbers, strict=True)}

    return Band(named(sizes), named(values - width * sides), named(values + width * sides), CONFIDENCE)


def _across(values: np.ndarray, change: np.ndarray) -> np.ndarray:
    """Give one standard deviation along the direction in which each point scatters most, on one side."""
    extent = np.nanmax(values, axis=-1, keepdims=True) - np.nanmin(values, axis=-1, keepdims=True)
    extent = np.where(extent > 0.0, extent, 1.0)
    first, second = change / extent[..., None]
    one, both, two = (np.sum(a * b, axis=-1) for a, b in ((first, first), (first, second), (second, second)))
    angle = 0.5 * np.arctan2(2.0 * both, one - two)
    size = np.sqrt(0.5 * (one + two) + np.hypot(0.5 * (one - two), both))
    sides = size * np.stack([np.cos(angle), np.sin(angle)])
    # The direction is known up to its sign: the same side of the curve all along it.
    along = np.gradient(values / extent, axis=-1)
    side = np.sign(along[0] * sides[1] - along[1] * sides[0])
    return np.where(side == 0.0, 1.0, side) * sides * extent
