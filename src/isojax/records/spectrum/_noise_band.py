"""The band that the noise of a channel fills: up to half the rate, or up to a declared filter's cut-off."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from ..._show import shown
from .._campaign import Filter
from ._filter import LEAST_GAIN

_FREQUENCIES = 4096
"""Frequencies over which the power gain is averaged."""


@shown
@dataclass(frozen=True)
class NoiseBand:
    """White noise, or white noise that a declared filter has shaped.

    Attributes:
        rate: Samples per second [Hz].
        filter: The filter of the channel, or None.
    """

    rate: float
    filter: Filter | None = None

    @property
    def highest(self) -> float:
        """Frequency up to which the noise reaches [Hz]: half the rate, or the filter's cut-off."""
        nyquist = 0.5 * self.rate
        return nyquist if self.filter is None else min(self.filter.cutoff_hz, nyquist)

    @property
    def as_filed(self) -> "NoiseBand":
        """The band in the file, before the reader did anything."""
        done = self.filter is not None and self.filter.applied
        return NoiseBand(self.rate, replace(self.filter, compensate=False) if self.filter and done else None)

    def power_gain(self, frequency: Float[np.ndarray, " frequency"]) -> Float[np.ndarray, " frequency"]:
        """Gives the power gain of the filter: `1 / (1 + (w / wc)^(2 n))`, `w = tan(pi f / rate)`.

        Squared for the reader's filter, which runs forwards and backwards and so acts twice. The filter of
        the test rig is assumed to be digital and to have run once, since a filter before the converter
        would not shape the noise. Where the reader has compensated it, the gain is 1 as far as that reaches.

        Args:
            frequency: From 0 to half the rate [Hz].

        Returns:
            Power gain, 1 at zero frequency.

        Source: Oppenheim & Schafer 2010, Discrete-Time Signal Processing, sec. 7.2 (bilinear transformation).
        """
        if self.filter is None or self.filter.cutoff_hz >= 0.5 * self.rate:
            return np.ones_like(frequency)
        warped = np.tan(np.pi * np.minimum(frequency / self.rate, 0.5 - 1e-9))
        ratio = warped / np.tan(np.pi * self.filter.cutoff_hz / self.rate)
        # Capped, so that no power overflows near half the rate, where the gain is zero anyway.
        once = 1.0 / (1.0 + np.minimum(ratio, 1e6) ** np.minimum(2 * self.filter.order, 50))
        if self.filter.compensate:
            return (once / np.maximum(once, LEAST_GAIN**2)) ** 2
        return once if self.filter.applied else once**2

    @property
    def share(self) -> float:
        """Noise bandwidth over half the rate: mean square of filtered over that of unfiltered white noise.

        It is also the share of independent samples: N samples of such noise, weighed by the white noise of
        the same density, have the expected chi-square `share N`.
        """
        middles = (np.arange(_FREQUENCIES) + 0.5) * (0.5 * self.rate / _FREQUENCIES)
        return float(np.mean(self.power_gain(middles)))
