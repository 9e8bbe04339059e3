"""A simulated record and its exact derivatives: by coefficients, initial states and absent effects.

In: a model and records cut into segments. Out: information matrices J'J with J'r, one a segment.
Read `_segments` (where records are cut) and `_batch` (segments side by side), then `_information` (the
matrices of a model, and the one choice between `_fixed_steps`, RK4 under a scan, and `_solved_steps`, a
diffrax solver with its tolerances) with `_whitening`, `_unknowns`, `_families`, `_internal_states` and
`_channels`, then `_score_columns` (the columns of absent effects) with `_effect_inputs`, `_slopes`,
`_transitions` and `_propagation`.
"""

from ._batch import Batch as Batch
from ._batch import Prepared as Prepared
from ._batch import coordinate_motion as coordinate_motion
from ._batch import prepare as prepare
from ._batch import workers as workers
from ._channels import carries as carries
from ._channels import channel_table as channel_table
from ._channels import drive_table as drive_table
from ._channels import effects_without_signal as effects_without_signal
from ._channels import line_coherence as line_coherence
from ._families import follow_motion as follow_motion
from ._information import information as information
from ._information import readings as readings
from ._internal_states import internal_starts as internal_starts
from ._score_columns import SCORE_PIECES as SCORE_PIECES
from ._score_columns import Followed as Followed
from ._score_columns import score_information as score_information
from ._segments import FIRST_STATES as FIRST_STATES
from ._segments import SHORTEST as SHORTEST
from ._segments import Segment as Segment
from ._segments import cut_evenly as cut_evenly
from ._segments import cut_segments as cut_segments
from ._segments import segments_between as segments_between
from ._segments import slowest_decay as slowest_decay
from ._tables import Tables as Tables
from ._unknowns import STIFFNESS_SCALE_UNIT as STIFFNESS_SCALE_UNIT
from ._unknowns import Unknowns as Unknowns
from ._unknowns import has_stiffness_scale as has_stiffness_scale
from ._unknowns import scaled_model as scaled_model
from ._unknowns import stiffness_place as stiffness_place
from ._unknowns import with_zero as with_zero
from ._whitening import Whitening as Whitening
from ._whitening import find_whitening as find_whitening
from ._whitening import whiten as whiten
