"""isojax.stability.orbit."""

from ._axis import ascending as ascending
from ._describing_function import imposed_balance as imposed_balance
from ._describing_function import response_amplitudes as response_amplitudes
from ._describing_function import response_start as response_start
from ._describing_function import rest_displacement as rest_displacement
from ._drive import Sine as Sine
from ._drive import recorded_sine as recorded_sine
from ._floquet import Floquet as Floquet
from ._floquet import modulus as modulus
from ._floquet import multipliers as multipliers
from ._harmonic_balance import HarmonicBalance as HarmonicBalance
from ._harmonic_balance import harmonic_balance as harmonic_balance
from ._orbit import Orbit as Orbit
from ._orbit import find_periodic_orbit as find_periodic_orbit
from ._period_map import period_map as period_map
from ._period_map import trajectory as trajectory
from ._pieces import Crossings as Crossings
from ._pieces import advance_in_pieces as advance_in_pieces
from ._pieces import find_crossings as find_crossings
from ._shooting import state_scale as state_scale
from ._symmetry import is_odd as is_odd
