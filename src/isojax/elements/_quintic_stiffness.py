"""Quintic spring."""

from typing import ClassVar

from .._parameters import parameter
from .._types import Internal, Lanes, Scalar
from ._element import AbstractElement, Group, Scales


class QuinticStiffness(AbstractElement):
    """Quintic spring: hardening that sets in later than the cubic one.

    `k5 x^5` [N].

    Attributes:
        coefficient: k5 [N/m^5].

    Source: Nayfeh & Mook 1979, Nonlinear Oscillations, sec. 2.3; equivalent stiffness (5/8) k5 X^4.
    """

    name: ClassVar[str] = "quintic_stiffness"
    words: ClassVar[str] = "quintic spring"
    strength: ClassVar[str] = "coefficient"
    signed: ClassVar[bool] = True
    group: ClassVar[Group] = "Springs"

    coefficient: Scalar = parameter(symbol="k5", unit="N/m^5")

    @classmethod
    def guess(cls, scales: Scales) -> "QuinticStiffness":
        return cls(0.0)

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return scales.force / scales.displacement**5

    def force(self, x: Lanes, v: Lanes, s: Internal) -> Lanes:
        return self.coefficient * x**5
