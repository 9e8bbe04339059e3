"""Offset of the drive channel."""

from typing import ClassVar

from .._parameters import parameter
from .._types import Lanes, Scalar
from ._element import AbstractElement, Group, Scales


class InputOffset(AbstractElement):
    """A constant adds to the recorded drive: preload, zero of the load cell, weight along a tilted motion.

    `F -> F + F0`; a tilt by the angle a gives `F0 = m g sin(a)`.

    Attributes:
        offset: F0 [N, or m/s^2 for base excitation].

    Source: zero error of a linear transducer.
    """

    name: ClassVar[str] = "input_offset"
    words: ClassVar[str] = "offset of the force channel"
    strength: ClassVar[str] = "offset"
    signed: ClassVar[bool] = True
    group: ClassVar[Group] = "The drive and the floor"
    freed_by: ClassVar[str] = "input.offset_free"

    offset: Scalar = parameter(symbol="F0", unit="SI unit of the input")

    @classmethod
    def guess(cls, scales: Scales) -> "InputOffset":
        return cls(0.0)

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return scales.force

    def drive(self, u: Lanes, u_rate: Lanes) -> tuple[Lanes, Lanes]:
        return u + self.offset, u_rate
