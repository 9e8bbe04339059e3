"""Delay of the drive."""

from typing import ClassVar

from .._parameters import parameter
from .._types import Lanes, Scalar
from ._element import AbstractElement, Group, LookAlike, Scales


class InputDelay(AbstractElement):
    """The force acts later than it was recorded (converter, filter, or clock skew).

    The force that acts at t is the one recorded at t - tau.

    Attributes:
        delay: tau [s].

    Source: the apparent damping tau (k - m w^2) changes sign at resonance (Pintelon & Schoukens 2012, sec.
        13.2).
    """

    name: ClassVar[str] = "input_delay"
    words: ClassVar[str] = "delay between the force and the response channel"
    strength: ClassVar[str] = "delay"
    signed: ClassVar[bool] = True
    group: ClassVar[Group] = "The drive and the floor"
    look_alikes: ClassVar[tuple[LookAlike, ...]] = (
        LookAlike(
            ("maxwell_branch", "added_mass", "dual_chamber", "fractional_damping"),
            "extend the band to twice the resonance: a delay's apparent damping changes sign at the "
            "resonance and grows above it, that of a relaxation does not",
        ),
    )

    delay: Scalar = parameter(symbol="tau", unit="s")

    @classmethod
    def guess(cls, scales: Scales) -> "InputDelay":
        return cls(0.0)

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return 1.0 / scales.angular_frequency

    def shift(self) -> Lanes | float:
        return self.delay
