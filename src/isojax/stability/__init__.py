"""What the identified isolator does: periodic orbits, their multipliers, maps, branches, bifurcations.

In: an isolator and its drive. Out: one frozen result a question, each with its `result` that says whether
it was found. Read the rooms upwards: orbit (one orbit), map (a plane of them), branch (along a parameter),
response (curves over frequency), attractor (motion in time), derivatives (how all of it moves with the
coefficients).
"""

from .attractor import BasinsOfAttraction as BasinsOfAttraction
from .attractor import BifurcationDiagram as BifurcationDiagram
from .attractor import LyapunovExponent as LyapunovExponent
from .attractor import PhasePortrait as PhasePortrait
from .attractor import PoincareSection as PoincareSection
from .attractor import ReturnToOrbit as ReturnToOrbit
from .attractor import basins_of_attraction as basins_of_attraction
from .attractor import bifurcation_diagram as bifurcation_diagram
from .attractor import largest_lyapunov_exponent as largest_lyapunov_exponent
from .attractor import phase_portrait as phase_portrait
from .attractor import poincare_section as poincare_section
from .attractor import return_to_orbit as return_to_orbit
from .branch import Branch as Branch
from .branch import BranchEvent as BranchEvent
from .branch import BranchPoints as BranchPoints
from .branch import CodimensionTwoPoint as CodimensionTwoPoint
from .branch import FoldCurve as FoldCurve
from .branch import NearestFolds as NearestFolds
from .branch import NeimarkSackerCurve as NeimarkSackerCurve
from .branch import PeriodDoublingCurve as PeriodDoublingCurve
from .branch import Searched as Searched
from .branch import SpecialPoint as SpecialPoint
from .branch import continue_branch as continue_branch
from .branch import find_nearest_folds as find_nearest_folds
from .branch import fold_curve as fold_curve
from .branch import neimark_sacker_curve as neimark_sacker_curve
from .branch import period_doubling_curve as period_doubling_curve
from .branch import switch_branch as switch_branch
from .derivatives import Sensitivity as Sensitivity
from .derivatives import find_again as find_again
from .derivatives import sensitivity as sensitivity
from .map import StabilityMap as StabilityMap
from .map import stability_map as stability_map
from .orbit import Floquet as Floquet
from .orbit import HarmonicBalance as HarmonicBalance
from .orbit import Orbit as Orbit
from .orbit import find_periodic_orbit as find_periodic_orbit
from .orbit import harmonic_balance as harmonic_balance
from .response import BackboneCurve as BackboneCurve
from .response import CurveFold as CurveFold
from .response import FrequencyResponse as FrequencyResponse
from .response import Resonance as Resonance
from .response import ResponseBands as ResponseBands
from .response import ResponseCurve as ResponseCurve
from .response import Transmissibility as Transmissibility
from .response import backbone_curve as backbone_curve
from .response import find_resonance as find_resonance
from .response import frequency_response as frequency_response
from .response import response_bands as response_bands
from .response import transmissibility as transmissibility
