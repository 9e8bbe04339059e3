"""Traces that absent forces leave in the records, beside the coefficients that are fitted.

In: an `Estimate` and elements at zero strength. Out: their projected traces (`_projection`). `_free_laws` are
force laws of any power and shape, `_free_traces` their traces beside a fit, of which `_matching_pursuit`
selects those that stand out of the residual.
"""

from ._free_laws import AbstractFreeForce as AbstractFreeForce
from ._free_laws import free_laws as free_laws
from ._free_traces import FreeTraces as FreeTraces
from ._free_traces import trace_free_laws as trace_free_laws
from ._matching_pursuit import MatchingPursuit as MatchingPursuit
from ._matching_pursuit import SelectedLaw as SelectedLaw
from ._matching_pursuit import matching_pursuit as matching_pursuit
from ._matching_pursuit import no_laws as no_laws
from ._projection import Projection as Projection
from ._projection import project as project
