"""The best fit with one coefficient held at a given value."""

from typing import Any

from ..._parameters import list_parameters, replace_parameters
from ..._results import RESULTS
from ._descent import Descent, descend
from ._estimate import Estimate, magnitudes
from ._initial_states import best_nuisances
from ._problem import Point
from ._search import Search


def fit_held(found: Estimate, name: str | None, value: float, start: Point, search: Search) -> Descent:
    """Minimise chi2 over the other free coefficients of a fit; the scatter of the stiffness stays as it is.

    Args:
        found: the fit.
        name: of the coefficient to hold; none is held if omitted.
        value: where [its unit].
        start: where the others, and the nuisances, start.
        search: how to search.

    Returns:
        The best point, its columns those of the other coefficients.
    """
    listed = list_parameters(start.model)
    held = [place for place, entry in enumerate(listed) if entry.name == name]
    model = replace_parameters(
        start.model, [value if place in held else entry.value for place, entry in enumerate(listed)]
    )
    others = tuple(place for place in found.places if place not in held)
    if others:
        sizes = magnitudes(model, others, search.scales)
        return descend(found.simulator, model, others, sizes, start.nuisances, search)
    point = best_nuisances(found.simulator, model, start.nuisances.spread, start.nuisances)
    result: Any = RESULTS.successful if point.is_finite else RESULTS.not_finite
    return Descent(point, result, 1)
