"""A cubic stiffness that follows the pressure in the chamber."""

from typing import ClassVar

from .._parameters import parameter
from .._types import Scalar
from . import _cubic_stiffness
from ._element import AbstractElement, Dependence, Group, Scales


class PressureCubicStiffness(AbstractElement):
    """The cubic stiffness follows the absolute pressure in the chamber, from record to record.

    `f = dk3 (r + b r^2) x^3`, `r = p/p0 - 1`; the cubic stiffness of the model is that at the reference p0.
    dk3 is k3 where the gas alone hardens, since each term of its force is proportional to p.

    Attributes:
        change: dk3, what the cubic stiffness would gain by a straight line where p is twice p0 [N/m^3].
        reference: p0, the mean over the fitted records [Pa].
        curvature: b, by which the change bends; 0 is a straight line [1].

    Source: Quaglia & Sorli 2001, Vehicle System Dynamics 35:443; recorded by `pressure` of [[record]].
    """

    name: ClassVar[str] = "pressure_cubic_stiffness"
    words: ClassVar[str] = "cubic stiffness that follows the chamber pressure"
    strength: ClassVar[str] = "change"
    signed: ClassVar[bool] = True
    needs: ClassVar[tuple[str, ...]] = ("cubic_stiffness",)
    channels: ClassVar[tuple[str, ...]] = ("pressure",)
    group: ClassVar[Group] = "Springs"

    change: Scalar = parameter(symbol="dk3", unit="N/m^3")
    reference: Scalar = parameter(symbol="p0", unit="Pa", lower=0.0, fitted=False)
    curvature: Scalar = parameter(symbol="b", unit="1", lower=-10.0, upper=10.0, fitted=False, default=0.0)

    @classmethod
    def guess(cls, scales: Scales) -> "PressureCubicStiffness":
        return cls(0.0, scales.pressure)

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return scales.force / scales.displacement**3

    def dependence(self) -> Dependence:
        return Dependence(
            "pressure", self.reference, _cubic_stiffness.CubicStiffness(self.change), self.curvature
        )
