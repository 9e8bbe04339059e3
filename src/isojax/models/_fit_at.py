"""A fit at an operating condition: the isolator there, and the covariance of its plain coefficients."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._parameters import find_parameter, full_names, list_parameters, replace_parameters
from .._results import RESULTS
from .._show import shown
from .._types import Scalar
from ._coefficient_errors import EndsEstimated, Estimated
from ._conditions import untested_words
from ._isolator import Isolator
from ._normal_mixture import NormalMixture


@shown
class FitAt(NamedTuple):
    """What a fit says of the isolator at an operating condition; it goes wherever `fit=` is asked for.

    Of a further record there: `fit_at(next_record(fit), ...)`.

    Attributes:
        model: the isolator at the condition.
        free: names of its coefficients that the fit moves.
        covariance: of these [product of their units].
        result: how the search of the fit ended.
        mixture: law of the coefficients' deviations where its tails are longer than normal ones.
        untested: that a condition lies beyond those of the fitted records, whose errors the laws' own
            deviation there may exceed; "" where it does not.
    """

    model: Isolator
    free: tuple[str, ...]
    covariance: Float[np.ndarray, "coefficient coefficient"]
    result: RESULTS
    mixture: NormalMixture | None = None
    untested: str = ""

    def _lines(self) -> list[str]:
        return [self.untested] if self.untested else []


def fit_at(fit: Estimated | EndsEstimated, **conditions: Scalar | float) -> FitAt:
    """Give a fit at an operating condition, for the bands and chances of curves and maps there.

    The plain coefficients there are linear in the fitted ones, so that their errors are exact; where a
    curvature was fitted they are those of the delta method.

    Args:
        fit: a fit, a saved one, or what ends with one, such as a closed loop.
        **conditions: as in `Isolator.at`.

    Returns:
        The isolator at the condition with its covariance.

    Raises:
        ValueError: if there is no fit; as `Isolator.at`.

    Example:
        A fitted stiffness that follows the pressure, k(p) = k + dk (p/p0 - 1):

        >>> chamber = ij.elements.PressureStiffness(change=8e5, reference=2e5)
        >>> model = ij.Isolator(800.0, (ij.elements.LinearStiffness(1e6), chamber))
        >>> free = ("linear_stiffness.coefficient", "pressure_stiffness.change")
        >>> fit = ij.models.FitAt(model, free, np.diag([3e3, 2e4]) ** 2, ij.RESULTS.successful)
        >>> there = ij.models.fit_at(fit, pressure=2.4e5)
        >>> there.free, np.sqrt(there.covariance).round()
        (('linear_stiffness.coefficient',), array([[5000.]]))
    """
    held = fit if isinstance(fit, Estimated) else getattr(fit, "after", None)
    if not isinstance(held, Estimated):
        raise ValueError(
            f"Argument `fit` must be a fit, or end with one, but is of type {type(fit).__name__}."
        )
    places = [find_parameter(held.model, name) for name in full_names(held.model, held.free, "fit.free")]
    numbers = [entry.value for entry in list_parameters(held.model)]

    def plain(values: Array) -> Array:
        moved = list(numbers)
        for place, value in zip(places, values, strict=True):
            moved[place] = value
        there = replace_parameters(held.model, moved).at(**conditions)
        return jnp.stack([entry.value for entry in list_parameters(there)])

    model = held.model.at(**conditions)
    slopes = np.asarray(jax.jacfwd(plain)(jnp.stack([numbers[place] for place in places])))
    moves = np.any(slopes != 0.0, axis=1)
    names = tuple(entry.name for entry, moved in zip(list_parameters(model), moves, strict=True) if moved)
    slopes, law = slopes[moves], getattr(held, "mixture", None)
    covariance = slopes @ np.asarray(held.covariance) @ slopes.T
    if law is not None:
        # What is correlated adds up as the law says, whose tails a covariance does not know.
        law = law.propagated(slopes)
        size = np.sqrt(np.diag(covariance))
        adds = (np.count_nonzero(slopes, axis=1) > 1) & (size > 0.0)
        scale = np.where(adds, law.standard_errors / np.where(adds, size, 1.0), 1.0)
        covariance *= np.outer(scale, scale)
    return FitAt(model, names, covariance, held.result, law, untested_words(held, conditions))
