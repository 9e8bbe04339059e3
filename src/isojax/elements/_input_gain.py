"""Gain of the drive channel."""

from typing import ClassVar

from .._parameters import parameter
from .._types import Lanes, Scalar
from ._element import AbstractElement, Group, LookAlike, Scales


class InputGain(AbstractElement):
    """The force that acts is (1 + g) times the recorded one.

    `F -> (1 + g) F`.

    Attributes:
        deviation: g [1].

    Source: calibration error of a linear transducer.
    """

    name: ClassVar[str] = "input_gain"
    words: ClassVar[str] = "gain error of the force channel"
    strength: ClassVar[str] = "deviation"
    signed: ClassVar[bool] = True
    group: ClassVar[Group] = "The drive and the floor"
    freed_by: ClassVar[str] = "input.gain_free"
    look_alikes: ClassVar[tuple[LookAlike, ...]] = (
        LookAlike(
            ("sensor_gain",),
            "calibrate either channel against another instrument: in no motion of the isolator do their "
            "gains differ",
        ),
    )

    deviation: Scalar = parameter(symbol="g", unit="1", lower=-0.99)

    @classmethod
    def guess(cls, scales: Scales) -> "InputGain":
        return cls(0.0)

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return 1.0

    def drive(self, u: Lanes, u_rate: Lanes) -> tuple[Lanes, Lanes]:
        return (1.0 + self.deviation) * u, (1.0 + self.deviation) * u_rate
