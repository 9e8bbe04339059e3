"""Hum of the mains on the response channel."""

from typing import ClassVar

import jax.numpy as jnp

from .._parameters import parameter
from .._types import Lanes, Scalar
from ._element import AbstractElement, Channels, Group, Scales


class MainsHum(AbstractElement):
    """A line of the mains frequency on the response channel, not locked to the drive.

    `y -> y + A cos(2 pi f t + phase)`. Each record has a phase of its own, which is read off its output.

    Attributes:
        amplitude: A, alike in all records [SI unit of the output].
        frequency: f, of the mains, 50 or 60 [Hz].

    Source: Ott 2009, sec. 3.
    """

    name: ClassVar[str] = "mains_hum"
    words: ClassVar[str] = "mains hum on the response channel"
    strength: ClassVar[str] = "amplitude"
    channels: ClassVar[tuple[str, ...]] = ("hum_50", "hum_60")
    phased: ClassVar[bool] = True
    group: ClassVar[Group] = "The response channel"

    amplitude: Scalar = parameter(symbol="A", unit="SI unit of the output", lower=0.0)
    frequency: Scalar = parameter(symbol="f", unit="Hz", lower=0.0, fitted=False)

    @classmethod
    def guess(cls, scales: Scales) -> "MainsHum":
        return cls(0.0, 50.0)

    @classmethod
    def grid(cls, scales: Scales) -> "tuple[MainsHum, ...]":
        """See `AbstractElement.grid`: the two mains frequencies."""
        return tuple(cls(0.0, frequency) for frequency in (50.0, 60.0))

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return scales.reading

    def channel_reading(self, channels: Channels) -> Lanes | float:
        line = jnp.where(self.frequency == 60.0, channels["hum_60"], channels["hum_50"])
        return self.amplitude * line
