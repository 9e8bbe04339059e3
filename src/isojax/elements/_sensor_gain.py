"""Gain of the response channel."""

from typing import ClassVar

from .._parameters import parameter
from .._types import Internal, Lanes, Scalar
from ._element import AbstractElement, Group, Scales


class SensorGain(AbstractElement):
    """The reading is (1 + g) times the motion.

    `y -> (1 + g) y`.

    Attributes:
        deviation: g [1].

    Source: calibration error of a linear transducer.
    """

    name: ClassVar[str] = "sensor_gain"
    words: ClassVar[str] = "gain error of the response channel"
    strength: ClassVar[str] = "deviation"
    signed: ClassVar[bool] = True
    group: ClassVar[Group] = "The response channel"

    deviation: Scalar = parameter(symbol="g", unit="1", lower=-0.99)

    @classmethod
    def guess(cls, scales: Scales) -> "SensorGain":
        return cls(0.0)

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return 1.0

    def reading(self, y: Lanes, s: Internal) -> Lanes:
        return (1.0 + self.deviation) * y
