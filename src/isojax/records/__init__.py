"""What was measured: campaign.toml, readers of data files, dwells, spectra and the noise estimate."""

from ._band import Band as Band
from ._band import excited_band as excited_band
from ._band import power_spectrum as power_spectrum
from ._campaign import Campaign as Campaign
from ._campaign import Filter as Filter
from ._campaign import InputChannel as InputChannel
from ._campaign import OutputChannel as OutputChannel
from ._filter import zero_phase_butterworth as zero_phase_butterworth
from ._harmonics import DwellHarmonics as DwellHarmonics
from ._harmonics import dwell_harmonics as dwell_harmonics
from ._health import DataHealth as DataHealth
from ._health import data_health as data_health
from ._integrate import integrate_acceleration as integrate_acceleration
from ._integrate import measured_state as measured_state
from ._kind import detect_kind as detect_kind
from ._noise import NoiseEstimate as NoiseEstimate
from ._noise import estimate_noise as estimate_noise
from ._read import read_campaign as read_campaign
from ._receptance import FilterComparison as FilterComparison
from ._receptance import Receptance as Receptance
from ._receptance import compare_filtered_receptance as compare_filtered_receptance
from ._receptance import receptance as receptance
from ._record import Dwell as Dwell
from ._record import Record as Record
from ._segment import segment_dwells as segment_dwells
