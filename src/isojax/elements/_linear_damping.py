"""Viscous damper."""

from typing import ClassVar

from .._parameters import parameter
from .._types import Internal, Lanes, Scalar
from ._element import AbstractElement, Group, Scales


class LinearDamping(AbstractElement):
    """Viscous damper.

    `c1 v` [N].

    Attributes:
        coefficient: c1 [N s/m].

    Source: the paper, eq. (4).
    """

    name: ClassVar[str] = "linear_damping"
    words: ClassVar[str] = "viscous damping"
    strength: ClassVar[str] = "coefficient"
    signed: ClassVar[bool] = False
    group: ClassVar[Group] = "Dampers"
    proportional_to: ClassVar[str] = "velocity"

    coefficient: Scalar = parameter(symbol="c1", unit="N s/m")

    @classmethod
    def guess(cls, scales: Scales) -> "LinearDamping":
        return cls(0.0)

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return scales.force / scales.velocity

    def force(self, x: Lanes, v: Lanes, s: Internal) -> Lanes:
        return self.coefficient * v
