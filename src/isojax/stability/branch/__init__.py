"""Branches of periodic orbits along one parameter, and curves of their bifurcations over two.

In: an isolator, the parameter and its range. Out: `Branch` with its `SpecialPoint`s, curves of folds,
period doublings and Neimark-Sacker bifurcations, nearest folds. Read _parameter_family, _arc_length (how
a curve is followed), _branch with _branch_point, _continuation with _tracing; then _other_branches (what
the branch does not reach) with _orbit_search and _orbit_starts; _criticality (what vanishes where an
orbit bifurcates), _locating and _special_points (what is found along a branch) with _bifurcation_system
(its exact equations) and _extended_system (their solution); then _branch_switching, _codimension_two with
_orbit_curve, _bifurcation_curves and _curve_special_points, _moved_point (where a bifurcation goes when
the model moves) with _moved_orbit (where an orbit goes), _possible_points (what the model lacks and others
within its errors have), _branch_bands (errors of a fit) with _drive_words, and _nearest_folds.
"""

from ._bifurcation_curves import CodimensionTwoPoint as CodimensionTwoPoint
from ._bifurcation_curves import FoldCurve as FoldCurve
from ._bifurcation_curves import NeimarkSackerCurve as NeimarkSackerCurve
from ._bifurcation_curves import PeriodDoublingCurve as PeriodDoublingCurve
from ._branch import Branch as Branch
from ._branch import BranchEvent as BranchEvent
from ._branch import BranchPoints as BranchPoints
from ._branch import Searched as Searched
from ._branch import SpecialPoint as SpecialPoint
from ._branch_switching import switch_branch as switch_branch
from ._codimension_two import fold_curve as fold_curve
from ._codimension_two import neimark_sacker_curve as neimark_sacker_curve
from ._codimension_two import period_doubling_curve as period_doubling_curve
from ._continuation import continue_branch as continue_branch
from ._continuation import tracing_steps as tracing_steps
from ._criticality import BifurcationKind as BifurcationKind
from ._curve_special_points import find_codimension_two_again as find_codimension_two_again
from ._moved_orbit import find_orbit_again as find_orbit_again
from ._nearest_folds import NearestFolds as NearestFolds
from ._nearest_folds import find_nearest_folds as find_nearest_folds
from ._parameter_family import ParameterFamily as ParameterFamily
from ._special_points import find_bifurcation_again as find_bifurcation_again
