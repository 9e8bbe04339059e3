"""The free force laws beside a fit: what each would leave in its records."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from ..fitting import Estimate, Search
from ._free_laws import AbstractFreeForce, free_laws
from ._projection import Projection, project


class FreeTraces(NamedTuple):
    """The free force laws beside a fit, at zero strength.

    Attributes:
        fitted: the fit.
        laws: the laws.
        units: size of one unit of the strength of each.
        projection: their traces in the records.
    """

    fitted: Estimate
    laws: tuple[AbstractFreeForce, ...]
    units: Float[np.ndarray, " law"]
    projection: Projection


def trace_free_laws(fitted: Estimate, search: Search) -> FreeTraces:
    """Give the traces of all free force laws beside a fit.

    Args:
        fitted: the estimate.
        search: how to search.

    Returns:
        The traces.
    """
    laws = free_laws(search.scales)
    search.progress(f"traces of {len(laws)} free force laws")
    units = np.array([1e-3 * law.typical_strength(search.scales) for law in laws])
    return FreeTraces(fitted, laws, units, project(fitted, laws, units))
