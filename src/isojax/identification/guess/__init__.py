"""The classical route: coefficients to start a fit from, without a simulation.

In: a campaign.toml or a `Campaign`. Out: a `ClassicalGuess`, whose model the fit starts from; `scales` of
motion and force.
Read `_classical_guess.py` first, then `_start_coefficients.py` and the two balances that it calls:
`_dwell_balance.py` and `_restoring_force.py`, both by `_force_balance.py`. The paper's own route is
`_paper_table.py`, with `_equivalent_law.py`, `_half_power.py` and `_circle_fit.py`.
"""

from ._as_campaign import as_campaign as as_campaign
from ._balance_start import balance_starts as balance_starts
from ._balance_start import find_balance_start as find_balance_start
from ._circle_fit import CircleFit as CircleFit
from ._circle_fit import fit_circle as fit_circle
from ._classical_guess import ClassicalGuess as ClassicalGuess
from ._classical_guess import classical_guess as classical_guess
from ._declared_model import base_model as base_model
from ._equivalent_coefficients import equivalent_coefficients as equivalent_coefficients
from ._equivalent_coefficients import invert_equivalent as invert_equivalent
from ._equivalent_coefficients import normalised_law as normalised_law
from ._half_power import HalfPower as HalfPower
from ._half_power import find_half_power as find_half_power
from ._internal_path import internal_states_along as internal_states_along
from ._linear_response import linear_response as linear_response
from ._measured_receptance import MeasuredResponse as MeasuredResponse
from ._measured_receptance import measured_receptance as measured_receptance
from ._motion import Motion as Motion
from ._motion import is_absolute as is_absolute
from ._motion import measured_motion as measured_motion
from ._other_starts import linear_starts as linear_starts
from ._other_starts import wells_start as wells_start
from ._paper_table import PaperTable as PaperTable
from ._paper_table import paper_table as paper_table
from ._scales import scales as scales
