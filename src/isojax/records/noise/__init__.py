"""The noise of the output channel, and the health of the data.

In: a `Campaign`. Out: the rms and colour of its output noise, and what the reader must know of the
data: dwells that never settled, brief blows, differences between repeats, a resonance peak in the scatter,
spikes. Read `_noise.py` first, then `_scatter.py`, `_levels.py`, `_colour.py`, `_spectral_noise.py` and
`_repeats.py`; `_residual_noise.py`, `_noise_peak.py`, `_spike_counts.py`, `_clipped_share.py` and
`_health.py` after them.
"""

from ._clipped_share import clipped_share as clipped_share
from ._colour import Colour as Colour
from ._health import DataHealth as DataHealth
from ._health import brief_blows as brief_blows
from ._health import data_health as data_health
from ._noise import NoiseEstimate as NoiseEstimate
from ._noise import estimate_noise as estimate_noise
from ._noise_peak import NoisePeak as NoisePeak
from ._noise_peak import noise_peak as noise_peak
from ._residual_noise import quieter_noise as quieter_noise
from ._residual_noise import residual_noise as residual_noise
from ._spike_counts import Spikes as Spikes
from ._spike_counts import spikes as spikes
