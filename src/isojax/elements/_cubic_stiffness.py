"""Cubic spring."""

from typing import ClassVar

from .._parameters import parameter
from .._types import Internal, Lanes, Scalar
from ._element import AbstractElement, Group, Scales


class CubicStiffness(AbstractElement):
    """Cubic spring.

    `k3 x^3` [N].

    Attributes:
        coefficient: k3 [N/m^3].

    Source: the paper, eq. (13); equivalent stiffness (3/4) k3 X^2, eq. (7).
    """

    name: ClassVar[str] = "cubic_stiffness"
    words: ClassVar[str] = "cubic spring"
    strength: ClassVar[str] = "coefficient"
    signed: ClassVar[bool] = True
    group: ClassVar[Group] = "Springs"

    coefficient: Scalar = parameter(symbol="k3", unit="N/m^3")

    @classmethod
    def guess(cls, scales: Scales) -> "CubicStiffness":
        return cls(0.0)

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return scales.force / scales.displacement**3

    def force(self, x: Lanes, v: Lanes, s: Internal) -> Lanes:
        return self.coefficient * x * x * x
