"""What was measured: campaign.toml, readers of data files, dwells, spectra and the noise estimate.

In: the path of a campaign.toml. Out: a `Campaign` of `Record`s in SI, its noise and the health of its data.
Read `_record.py` and `_campaign.py` first, then `reading/` (with `formats/`), `spectrum/`, `noise/` and
`sense/`. `inspection/` is for files that no campaign.toml describes yet.
"""

from ._blow import driven_samples as driven_samples
from ._campaign import TIME_DERIVATIVES as TIME_DERIVATIVES
from ._campaign import Campaign as Campaign
from ._campaign import Filter as Filter
from ._campaign import FloorChannel as FloorChannel
from ._campaign import InputChannel as InputChannel
from ._campaign import OutputChannel as OutputChannel
from ._record import Direction as Direction
from ._record import Dwell as Dwell
from ._record import ExcitationKind as ExcitationKind
from ._record import Record as Record
from ._thinned_record import thin_record as thin_record
from ._thinned_record import thinned_place as thinned_place
from ._thinned_record import thinned_share as thinned_share
from ._windows import check_window as check_window
from ._windows import cut_into_windows as cut_into_windows
from ._windows import windows_of as windows_of
from .inspection import ChannelInspection as ChannelInspection
from .inspection import FileInspection as FileInspection
from .inspection import draft_campaign as draft_campaign
from .inspection import find_data_files as find_data_files
from .inspection import find_period as find_period
from .inspection import inspect_file as inspect_file
from .noise import Colour as Colour
from .noise import DataHealth as DataHealth
from .noise import NoiseEstimate as NoiseEstimate
from .noise import NoisePeak as NoisePeak
from .noise import Spikes as Spikes
from .noise import brief_blows as brief_blows
from .noise import data_health as data_health
from .noise import estimate_noise as estimate_noise
from .noise import noise_peak as noise_peak
from .noise import quieter_noise as quieter_noise
from .noise import residual_noise as residual_noise
from .reading import READERS as READERS
from .reading import Declaration as Declaration
from .reading import detect_kind as detect_kind
from .reading import find_reader as find_reader
from .reading import read_declaration as read_declaration
from .reading import read_measurements as read_measurements
from .reading import segment_dwells as segment_dwells
from .sense import Cause as Cause
from .sense import Suspicion as Suspicion
from .sense import find_suspicions as find_suspicions
from .sense import refuse_contradictions as refuse_contradictions
from .spectrum import DwellHarmonics as DwellHarmonics
from .spectrum import ExcitedBand as ExcitedBand
from .spectrum import FilterComparison as FilterComparison
from .spectrum import HumLine as HumLine
from .spectrum import MainsCollision as MainsCollision
from .spectrum import Receptance as Receptance
from .spectrum import compare_filtered_receptance as compare_filtered_receptance
from .spectrum import dwell_harmonics as dwell_harmonics
from .spectrum import excited_band as excited_band
from .spectrum import hum_lines as hum_lines
from .spectrum import integrate_acceleration as integrate_acceleration
from .spectrum import mains_collisions as mains_collisions
from .spectrum import measured_state as measured_state
from .spectrum import power_spectrum as power_spectrum
from .spectrum import receptance as receptance
from .spectrum import ringing_frequency as ringing_frequency
from .spectrum import zero_phase_butterworth as zero_phase_butterworth
