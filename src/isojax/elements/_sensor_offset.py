"""Offset of the response channel."""

from typing import ClassVar

from .._parameters import parameter
from .._types import Internal, Lanes, Scalar
from ._element import AbstractElement, Group, Scales


class SensorOffset(AbstractElement):
    """A constant adds to the reading.

    `y -> y + y0`.

    Attributes:
        offset: y0 [SI unit of the output].

    Source: zero error of a linear transducer.
    """

    name: ClassVar[str] = "sensor_offset"
    words: ClassVar[str] = "offset of the response channel"
    strength: ClassVar[str] = "offset"
    signed: ClassVar[bool] = True
    group: ClassVar[Group] = "The response channel"
    freed_by: ClassVar[str] = "output.offset_free"
    starts_at_mean: ClassVar[bool] = True

    offset: Scalar = parameter(symbol="y0", unit="SI unit of the output")

    @classmethod
    def guess(cls, scales: Scales) -> "SensorOffset":
        return cls(0.0)

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return scales.reading

    def reading(self, y: Lanes, s: Internal) -> Lanes:
        return y + self.offset
