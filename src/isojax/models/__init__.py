"""The isolator: mass and elements, its integrator, its forced response, its file."""

from ._element_states import Regime as Regime
from ._element_states import share_internal as share_internal
from ._event_step import Ringing as Ringing
from ._event_step import Table as Table
from ._event_step import add_ringing as add_ringing
from ._event_step import find_regime as find_regime
from ._event_step import find_ringing as find_ringing
from ._event_step import split_step as split_step
from ._integrator import Integrator as Integrator
from ._isolator import Isolator as Isolator
from ._isolator import Quantity as Quantity
from ._isolator import State as State
from ._rk4 import RK4 as RK4
from ._scan import advance as advance
from ._scan import advance_record as advance_record
from ._scan import at_stages as at_stages
from ._scan import read_record as read_record
from ._scan import scan_records as scan_records
from ._simulate import Simulation as Simulation
from ._simulate import simulate as simulate
from ._storage import load_model as load_model
from ._storage import model_to_dict as model_to_dict
from ._storage import save_model as save_model
from ._storage import write_whole as write_whole
