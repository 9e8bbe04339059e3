"""What the identified isolator does: periodic orbits, their multipliers, maps, branches, bifurcations."""

from ._bifurcation_diagram import BifurcationDiagram as BifurcationDiagram
from ._bifurcation_diagram import bifurcation_diagram as bifurcation_diagram
from ._branch import Branch as Branch
from ._branch import BranchPoints as BranchPoints
from ._branch import SpecialPoint as SpecialPoint
from ._continuation import continue_branch as continue_branch
from ._curves import Cusp as Cusp
from ._curves import FoldCurve as FoldCurve
from ._curves import PeriodDoublingCurve as PeriodDoublingCurve
from ._floquet import Floquet as Floquet
from ._locus import fold_curve as fold_curve
from ._locus import period_doubling_curve as period_doubling_curve
from ._lyapunov import LyapunovExponent as LyapunovExponent
from ._lyapunov import largest_lyapunov_exponent as largest_lyapunov_exponent
from ._map import StabilityMap as StabilityMap
from ._map import stability_map as stability_map
from ._orbit import Orbit as Orbit
from ._orbit import find_periodic_orbit as find_periodic_orbit
from ._phase_portrait import PhasePortrait as PhasePortrait
from ._phase_portrait import phase_portrait as phase_portrait
from ._poincare import PoincareSection as PoincareSection
from ._poincare import poincare_section as poincare_section
from ._switching import switch_branch as switch_branch
