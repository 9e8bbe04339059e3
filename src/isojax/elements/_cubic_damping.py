"""Cubic damper."""

from typing import ClassVar

from .._parameters import parameter
from .._types import Internal, Lanes, Scalar
from ._element import AbstractElement, Group, Scales


class CubicDamping(AbstractElement):
    """Cubic damper.

    `c3 v^3` [N].

    Attributes:
        coefficient: c3 [N s^3/m^3].

    Source: the paper, eq. (18); equivalent damping (3/4) c3 V^2, eq. (8).
    """

    name: ClassVar[str] = "cubic_damping"
    words: ClassVar[str] = "cubic damping"
    strength: ClassVar[str] = "coefficient"
    signed: ClassVar[bool] = True
    group: ClassVar[Group] = "Dampers"

    coefficient: Scalar = parameter(symbol="c3", unit="N s^3/m^3")

    @classmethod
    def guess(cls, scales: Scales) -> "CubicDamping":
        return cls(0.0)

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return scales.force / scales.velocity**3

    def force(self, x: Lanes, v: Lanes, s: Internal) -> Lanes:
        return self.coefficient * v * v * v
