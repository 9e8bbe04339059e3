"""isojax.records.noise."""

from ._health import DataHealth as DataHealth
from ._health import brief_blows as brief_blows
from ._health import data_health as data_health
from ._noise import NoiseEstimate as NoiseEstimate
from ._noise import estimate_noise as estimate_noise
from ._noise_peak import NoisePeak as NoisePeak
from ._noise_peak import noise_peak as noise_peak
