"""Traces of absent effects in the data, with what a refit would absorb projected out of them."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from ..._parameters import element_names, list_parameters
from ...elements import AbstractElement
from ...models import Isolator
from ..fitting import Estimate, Point, one_hot


class Projection(NamedTuple):
    """What the data hold of absent effects beside the fitted coefficients and nuisances.

    With r the whitened residual, J the columns of fitted coefficients and nuisances, P = I - Q Q' and g = P
    g_j for each absent effect, everything in the units of `units`.

    Attributes:
        model: the fitted model with the absent effects appended.
        point: where it was evaluated; its columns are the fitted coefficients, then the strengths, with
            nothing in those whose trace was lost.
        units: size of one unit of each fitted coefficient.
        absorbed: step of the fitted coefficients that a unit of each effect goes with; last, of none of them.
        information: g' g.
        score: g' r.
        visibility: |g| / |g_j|.
    """

    model: Isolator
    point: Point
    units: Float[np.ndarray, " coefficient"]
    absorbed: Float[np.ndarray, "coefficient column"]
    information: Float[np.ndarray, "effect effect"]
    score: Float[np.ndarray, " effect"]
    visibility: Float[np.ndarray, " effect"]

    @property
    def step(self) -> Float[np.ndarray, "coefficient column"]:
        """`absorbed` in the units of the coefficients."""
        return self.units[:, None] * self.absorbed


def project(
    fitted: Estimate, absent: Sequence[AbstractElement], units: Float[np.ndarray, " effect"]
) -> Projection:
    """Give the projected traces of absent effects: exact linear variations of the simulated records.

    Args:
        fitted: the estimate beside which they are absent.
        absent: effects at zero strength.
        units: size of one unit of each strength.

    Returns:
        The projection.

    Source: Rao 1948.
    """
    # Beside what they contain, not in its place: an effect that absorbs another shows what it adds to it.
    model = Isolator(fitted.model.mass, (*fitted.model.elements, *absent), fitted.model.excitation)
    carried, count = len(fitted.model.elements), len(fitted.places)
    own = np.sqrt(1.0 / np.maximum(np.diag(fitted.point.reduced.matrix)[:-1], 1e-300))
    names = element_names(model)[carried:]
    place_of = {entry.name: place for place, entry in enumerate(list_parameters(model))}
    strengths = (f"{name}.{one.strength}" for name, one in zip(names, absent, strict=True))
    places = [*fitted.places, *(place_of[name] for name in strengths)]
    directions = one_hot(model, places, [*own, *units])
    point = fitted.simulator.evaluate(model, directions, fitted.point.nuisances, carried)
    by_record = point.reduced.by_record
    # An internal state that diverged along the motion leaves no trace: its effect counts as hidden.
    lost = np.flatnonzero(~np.isfinite(np.diagonal(by_record, axis1=1, axis2=2).sum(axis=0)))
    residual = by_record.shape[-1] - 1
    if np.any(lost < count) or residual in lost:
        # The residual or the fitted columns diverged as well: no trace means anything then.
        lost = np.arange(residual + 1)
    point = point._replace(reduced=point.reduced.without(lost))
    matrix = point.reduced.matrix
    base, cross = matrix[:count, :count], matrix[:count, count:]
    absorbed = np.linalg.pinv(base, rcond=1e-12, hermitian=True) @ cross
    left = matrix[count:, count:] - cross.T @ absorbed
    size = np.sqrt(np.maximum(np.diag(left)[:-1], 0.0))
    visibility = size / np.sqrt(np.maximum(point.reduced.raw[count:], 1e-300))
    return Projection(model, point, own, absorbed, left[:-1, :-1], left[:-1, -1], visibility)
