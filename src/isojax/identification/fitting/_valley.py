"""Does chi2 rise about a fit as its standard errors say, or do they describe the tangent of a bent valley?"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from ..._parameters import list_parameters, replace_parameters
from ._elimination import step_nuisances
from ._estimate import Estimate
from ._problem import Point, one_hot

SAME_RISE = 2.0
"""Factor between the rise of chi2 one standard error away and that of a parabola, up to which standard
errors describe the valley."""

_WELL_KNOWN = 0.1
"""Standard error over the value up to which a coefficient changes too little for a valley to bend."""


class Bent(NamedTuple):
    """A coefficient whose standard error does not describe how chi2 rises.

    Attributes:
        place: among the free coefficients.
        rises: of chi2, one standard error below and above with the others where the parabola has them, over
            the rises of the parabola; infinite where the motion diverges there, NaN beyond a bound.
    """

    place: int
    rises: Float[np.ndarray, "2"]


def find_bent(found: Estimate) -> tuple[Bent, ...]:
    """Look one standard error to either side of a fit, for each coefficient that is not well known.

    One simulation with derivatives, and two more a coefficient.

    Args:
        found: the fit; it must have succeeded.

    Returns:
        Coefficients along which chi2 rises by less than half or by more than twice what it should.

    Source: Bates & Watts 1988, Nonlinear Regression Analysis, sec. 6.1 (profile t off a straight line).
    """
    uncertainty, listed = found.uncertainty, list_parameters(found.model)
    values = np.array([float(listed[place].value) for place in found.places])
    asked = [
        place
        for place, error in enumerate(uncertainty.standard_error)
        if uncertainty.determined[place] and error > _WELL_KNOWN * abs(values[place])
    ]
    if not asked:
        return ()
    columns = one_hot(found.model, found.places, [1.0] * len(found.places))
    begun = found.simulator.evaluate(found.model, columns, found.comparable_nuisances)
    bent = []
    for place in asked:
        # An undetermined coefficient, which has no covariance, stays.
        along = np.nan_to_num(uncertainty.covariance[place]) / uncertainty.standard_error[place]
        rises = np.array([_rise(found, begun, columns, sign * along) for sign in (-1.0, 1.0)])
        known = rises[~np.isnan(rises)]
        if np.any((known < 1.0 / SAME_RISE) | (known > SAME_RISE)):
            bent.append(Bent(place, rises))
    return tuple(bent)


def _rise(
    found: Estimate,
    begun: Point,
    columns: Float[np.ndarray, "parameter column"],
    step: Float[np.ndarray, " column"],
) -> float:
    """Give the rise of chi2 over a step, over that of the parabola."""
    listed = list_parameters(found.model)
    values = [float(entry.value) for entry in listed]
    for place, change in zip(found.places, step, strict=True):
        values[place] += change
        spec = listed[place].spec
        if not spec.lower <= values[place] <= spec.upper:
            return float("nan")
    owner = found.simulator.prepared(found.model, len(found.model.elements)).record
    moved = step_nuisances(begun.reduced, owner, begun.nuisances, step)
    there = found.simulator.evaluate(replace_parameters(found.model, values), columns, moved)
    matrix = begun.reduced.matrix
    expected = float(step @ matrix[:-1, :-1] @ step - 2.0 * matrix[:-1, -1] @ step)
    return (there.chi2 - begun.chi2) / expected if there.is_finite else float("inf")
