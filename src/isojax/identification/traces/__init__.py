"""Traces that absent forces leave in the records, beside the coefficients that are fitted.

In: an `Estimate` and elements at zero strength. Out: their projected traces (`_projection`), and the free
force laws (`_free_laws`) that stand out of the residual (`_matching_pursuit`).
"""

from ._free_laws import AbstractFreeForce as AbstractFreeForce
from ._free_laws import free_laws as free_laws
from ._matching_pursuit import MatchingPursuit as MatchingPursuit
from ._matching_pursuit import SelectedLaw as SelectedLaw
from ._matching_pursuit import matching_pursuit as matching_pursuit
from ._matching_pursuit import no_laws as no_laws
from ._projection import Projection as Projection
from ._projection import project as project
