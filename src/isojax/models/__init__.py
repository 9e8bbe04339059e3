"""The isolator: mass and elements, its integrator, its forced response, its file.

In: a mass, elements and a drive. Out: an `Isolator`, its simulated motion and readings, its JSON file.
Read `_isolator.py` (the equation of motion) and `_instant.py` (the signals at one time), then `_rk4.py` and
`_integrator.py` (the step), `_scan.py` (many records), `_solve.py` (diffrax) and `_simulate.py` (one drive).
`_laws.py` and `_event_step.py` split a step where a law jumps; `_storage.py` reads and writes the file;
`_coefficient_errors.py` carries the covariance of a fit into answers, `_normal_mixture.py` its tails,
`_credible_set.py` draws from it, and
`_band.py` both into curves, with `_second_order.py` (draws of a curve) and `_shifted_curve.py`;
`_conditions.py` and `_fit_at.py` give the isolator and a fit at a chamber pressure or temperature.
"""

from ._as_isolator import Modelled as Modelled
from ._as_isolator import as_isolator as as_isolator
from ._band import Band as Band
from ._band import CurveBeside as CurveBeside
from ._band import band_across as band_across
from ._band import band_around as band_around
from ._band import draw_coefficients as draw_coefficients
from ._band import find_band as find_band
from ._band import find_band_across as find_band_across
from ._coefficient_errors import CoefficientErrors as CoefficientErrors
from ._coefficient_errors import EndsEstimated as EndsEstimated
from ._coefficient_errors import Estimated as Estimated
from ._coefficient_errors import coefficient_errors as coefficient_errors
from ._conditions import untested_words as untested_words
from ._credible_set import CredibleSet as CredibleSet
from ._credible_set import credible_set as credible_set
from ._credible_set import existence as existence
from ._event_step import Ringing as Ringing
from ._event_step import Step as Step
from ._event_step import add_ringing as add_ringing
from ._event_step import find_regime as find_regime
from ._event_step import find_ringing as find_ringing
from ._event_step import split_step as split_step
from ._fit_at import FitAt as FitAt
from ._fit_at import fit_at as fit_at
from ._instant import Instant as Instant
from ._instant import split_stages as split_stages
from ._integrator import Integrator as Integrator
from ._isolator import Isolator as Isolator
from ._isolator import Quantity as Quantity
from ._laws import ROUNDED as ROUNDED
from ._laws import ContinuedLaw as ContinuedLaw
from ._laws import Regime as Regime
from ._laws import State as State
from ._laws import find_switches as find_switches
from ._laws import share_internal as share_internal
from ._normal_mixture import CONFIDENCE as CONFIDENCE
from ._normal_mixture import HALF_WIDTH as HALF_WIDTH
from ._normal_mixture import NormalMixture as NormalMixture
from ._normal_mixture import half_width as half_width
from ._rk4 import RK4 as RK4
from ._scan import advance as advance
from ._scan import advance_record as advance_record
from ._scan import read_record as read_record
from ._scan import scan_records as scan_records
from ._second_order import expansion_nodes as expansion_nodes
from ._simulate import Simulation as Simulation
from ._simulate import simulate as simulate
from ._sliding import freeing_accelerations as freeing_accelerations
from ._sliding import law_beside as law_beside
from ._sliding import sliding_switch as sliding_switch
from ._solve import check_integrator as check_integrator
from ._solve import solve_record as solve_record
from ._storage import load_model as load_model
from ._storage import model_from_dict as model_from_dict
from ._storage import model_to_dict as model_to_dict
from ._storage import read_json as read_json
from ._storage import save_model as save_model
from ._storage import write_whole as write_whole
