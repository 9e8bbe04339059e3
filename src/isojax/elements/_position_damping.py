"""Damping that grows with displacement."""

from typing import ClassVar

from .._parameters import parameter
from .._types import Internal, Lanes, Scalar
from ._element import AbstractElement, Group, Scales


class PositionDamping(AbstractElement):
    """Damping that grows with the square of the displacement.

    `c x^2 v` [N].

    Attributes:
        coefficient: c [N s/m^3].

    Source: van der Pol 1926; energy per cycle proportional to X^4 omega.
    """

    name: ClassVar[str] = "position_damping"
    words: ClassVar[str] = "amplitude-dependent damping x^2 v"
    strength: ClassVar[str] = "coefficient"
    signed: ClassVar[bool] = False
    group: ClassVar[Group] = "Dampers"

    coefficient: Scalar = parameter(symbol="c", unit="N s/m^3")

    @classmethod
    def guess(cls, scales: Scales) -> "PositionDamping":
        return cls(0.0)

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return scales.force / (scales.displacement**2 * scales.velocity)

    def force(self, x: Lanes, v: Lanes, s: Internal) -> Lanes:
        return self.coefficient * x * x * v
