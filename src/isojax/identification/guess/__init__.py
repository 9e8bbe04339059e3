"""Classical analysis: coefficients to start from, and typical magnitudes, without a simulation.

In: a campaign. Out: a `ClassicalGuess` with the start of a fit, and the `Scales` of the campaign.
Read `_read_campaign` and `_declared_model`, then `_classical_guess` (the door) and `_start_coefficients`
(dwells or time?), then `_dwell_balance`, `_restoring_force` and `_force_balance` (the regression).
`_paper_table` is the paper's route: `_half_power`, `_circle_fit`, `_equivalent_law`. `_scales` and
`_motion` serve all rooms above.
"""

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
from ._linear_response import linear_response as linear_response
from ._motion import Motion as Motion
from ._motion import is_absolute as is_absolute
from ._motion import measured_motion as measured_motion
from ._paper_table import PaperTable as PaperTable
from ._paper_table import paper_table as paper_table
from ._read_campaign import read_campaign as read_campaign
from ._scales import scales as scales
