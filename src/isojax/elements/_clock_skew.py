"""Clocks of the two channels that run at different rates."""

from typing import ClassVar

from .._parameters import parameter
from .._types import Lanes, Scalar
from ._element import AbstractElement, Group, LookAlike, Scales


class ClockSkew(AbstractElement):
    """The clock of the response channel runs faster than that of the force: a delay that grows with time.

    The force that acts at t is the one recorded at t / (1 + s), with t the time since the start of the file
    on the clock of the response channel. No record says which of the two clocks is right: by that of the
    force the coefficients differ by shares of 2 s at most.

    Attributes:
        rate: s [ppm].

    Source: offset and skew of two clocks, Mills 2006, Computer Network Time Synchronization.
    """

    name: ClassVar[str] = "clock_skew"
    words: ClassVar[str] = "skew between the clocks of the force and the response channel"
    strength: ClassVar[str] = "rate"
    signed: ClassVar[bool] = True
    channels: ClassVar[tuple[str, ...]] = ("elapsed",)
    group: ClassVar[Group] = "The drive and the floor"
    look_alikes: ClassVar[tuple[LookAlike, ...]] = (
        LookAlike(
            ("input_delay", "stiffness_drift"),
            "repeat one level in a record of twice the length: a skew starts each record at zero delay and "
            "ends the longer one at twice the delay; a delay is the same all along, and a drift goes on from "
            "record to record",
            among=True,
        ),
    )

    rate: Scalar = parameter(symbol="s", unit="ppm")

    @classmethod
    def guess(cls, scales: Scales) -> "ClockSkew":
        return cls(0.0)

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return 1e6 / (60.0 * scales.angular_frequency)

    def skew(self) -> Lanes | float:
        return 1e-6 * self.rate / (1.0 + 1e-6 * self.rate)
