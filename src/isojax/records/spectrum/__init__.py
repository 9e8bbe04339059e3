"""Spectra, harmonics, filters and integrals of one record.

In: a `Record` or its samples. Out: its excited band, the harmonics of its dwells, velocity and displacement,
lines of the mains, receptances.
Read `_basis.py`, `_dwell_end.py` and `_harmonics.py` (dwells) first, then `_filter.py`, `_noise_band.py` and
`_excited_band.py` (spectra), `_integrate.py`, `_mains.py` and `_filtered_receptance.py`.
"""

from ._basis import USABLE_SHARE as USABLE_SHARE
from ._basis import usable_orders as usable_orders
from ._basis import without as without
from ._dwell_end import MOST_HARMONICS as MOST_HARMONICS
from ._dwell_end import Rest as Rest
from ._dwell_end import dwell_rest as dwell_rest
from ._dwell_end import dwell_window as dwell_window
from ._excited_band import ExcitedBand as ExcitedBand
from ._excited_band import driven_range as driven_range
from ._excited_band import excited_band as excited_band
from ._excited_band import power_spectrum as power_spectrum
from ._excited_band import ringing_frequency as ringing_frequency
from ._excited_band import spectral_floor as spectral_floor
from ._filter import compensate_butterworth as compensate_butterworth
from ._filter import unsure_samples as unsure_samples
from ._filter import zero_phase_butterworth as zero_phase_butterworth
from ._filtered_receptance import FilterComparison as FilterComparison
from ._filtered_receptance import Receptance as Receptance
from ._filtered_receptance import compare_filtered_receptance as compare_filtered_receptance
from ._filtered_receptance import receptance as receptance
from ._harmonics import DwellHarmonics as DwellHarmonics
from ._harmonics import dwell_harmonics as dwell_harmonics
from ._harmonics import fit_harmonics as fit_harmonics
from ._harmonics import harmonic_basis as harmonic_basis
from ._harmonics import settled_window as settled_window
from ._integrate import integrate_acceleration as integrate_acceleration
from ._integrate import measured_state as measured_state
from ._integrate import shift_order as shift_order
from ._mains import HumLine as HumLine
from ._mains import MainsCollision as MainsCollision
from ._mains import hum_lines as hum_lines
from ._mains import mains_collisions as mains_collisions
from ._noise_band import NoiseBand as NoiseBand
