"""One periodic orbit of the forced isolator.

In: an isolator, a harmonic drive. Out: `Orbit` with its state at t = 0 and its Floquet multipliers, or a
harmonic balance. Read _describing_function (the start), _event_path (steps that end where a law jumps or
bends), _period_map (fixed steps), _fast_states (how many), _kink_crossings and _split_period_map (the motion
split there), _shooting (the closed motion), _floquet, _orbit; _harmonic_balance stands beside them. The rooms
branch, map, response, attractor and derivatives build on this one.
"""

from ._axis import ascending as ascending
from ._describing_function import answer_scale as answer_scale
from ._describing_function import balanced_motion as balanced_motion
from ._describing_function import imposed_balance as imposed_balance
from ._describing_function import overtone_response as overtone_response
from ._describing_function import response_amplitudes as response_amplitudes
from ._describing_function import response_start as response_start
from ._describing_function import rest_displacement as rest_displacement
from ._event_path import follow_events as follow_events
from ._fast_states import answer_sizes as answer_sizes
from ._fast_states import fastest_rate as fastest_rate
from ._fast_states import integrator_over as integrator_over
from ._fast_states import integrator_that_follows as integrator_that_follows
from ._fast_states import integrator_with as integrator_with
from ._floquet import Floquet as Floquet
from ._floquet import margin_beside_folds as margin_beside_folds
from ._floquet import modulus as modulus
from ._floquet import multipliers as multipliers
from ._floquet import pair_angle as pair_angle
from ._floquet import stable_words as stable_words
from ._half_range import half_range as half_range
from ._harmonic_balance import HarmonicBalance as HarmonicBalance
from ._harmonic_balance import harmonic_balance as harmonic_balance
from ._held import is_held as is_held
from ._jacobian import value_and_jacobian as value_and_jacobian
from ._kink_crossings import Crossings as Crossings
from ._kink_crossings import advance_across_kinks as advance_across_kinks
from ._known_numbers import is_traced as is_traced
from ._known_numbers import refuse_traced as refuse_traced
from ._known_numbers import refuse_transformed as refuse_transformed
from ._orbit import Orbit as Orbit
from ._orbit import closed_by_half as closed_by_half
from ._orbit import find_periodic_orbit as find_periodic_orbit
from ._period_map import period_map as period_map
from ._period_map import trajectory as trajectory
from ._rests import rest_displacements as rest_displacements
from ._settled import settled as settled
from ._shooting import Accuracy as Accuracy
from ._shooting import closing as closing
from ._shooting import shoot as shoot
from ._shooting_method import ShootingMethod as ShootingMethod
from ._sine import PeriodicDrive as PeriodicDrive
from ._sine import Sine as Sine
from ._sine import fewest_steps as fewest_steps
from ._sine import highest_order as highest_order
from ._sine import integrator_for as integrator_for
from ._sine import need_fundamental as need_fundamental
from ._sine import recorded_sine as recorded_sine
from ._sine import with_overtones as with_overtones
from ._smoothness import has_continuous_slopes as has_continuous_slopes
from ._split_period_map import FEWEST_STEPS as FEWEST_STEPS
from ._split_period_map import MOST_STEPS_A_PERIOD as MOST_STEPS_A_PERIOD
from ._split_period_map import Split as Split
from ._split_period_map import event_places as event_places
from ._split_period_map import first_split as first_split
from ._split_period_map import split_image as split_image
from ._split_period_map import split_jacobian as split_jacobian
from ._split_period_map import state_scale as state_scale
from ._split_period_map import steps_wanted as steps_wanted
from ._state_path import AbstractStatePath as AbstractStatePath
from ._symmetry import is_odd as is_odd
from ._symmetry import is_odd_along as is_odd_along
from ._turning_map import turning_map as turning_map
