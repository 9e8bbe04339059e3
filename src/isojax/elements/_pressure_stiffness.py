"""A stiffness that follows the pressure in the chamber."""

from typing import ClassVar

from .._parameters import parameter
from .._types import Scalar
from . import _linear_stiffness
from ._element import AbstractElement, Dependence, Group, LookAlike, Scales


class PressureStiffness(AbstractElement):
    """The linear stiffness follows the absolute pressure in the chamber, from record to record.

    `f = dk (r + b r^2) x`, `r = p/p0 - 1`; the stiffness of the model is that at the reference p0.
    dk is k where the whole stiffness is that of the gas, `k = n p A^2/V`, and less beside other springs.

    Attributes:
        change: dk, what the stiffness would gain by a straight line where p is twice p0 [N/m].
        reference: p0, the mean over the fitted records [Pa].
        curvature: b, by which the change bends; 0 is a straight line [1].

    Source: Quaglia & Sorli 2001, Vehicle System Dynamics 35:443; recorded by `pressure` of [[record]].
    """

    name: ClassVar[str] = "pressure_stiffness"
    words: ClassVar[str] = "linear stiffness that follows the chamber pressure"
    strength: ClassVar[str] = "change"
    signed: ClassVar[bool] = True
    needs: ClassVar[tuple[str, ...]] = ("linear_stiffness",)
    channels: ClassVar[tuple[str, ...]] = ("pressure",)
    group: ClassVar[Group] = "Springs"
    look_alikes: ClassVar[tuple[LookAlike, ...]] = (
        LookAlike(
            ("stiffness_drift",),
            "repeat the first pressure at the end of the test: a drift does not go back with it",
        ),
        LookAlike(
            ("temperature_stiffness",),
            "change the pressure at one temperature: only the one that is changed moves the stiffness",
        ),
    )

    change: Scalar = parameter(symbol="dk", unit="N/m")
    reference: Scalar = parameter(symbol="p0", unit="Pa", lower=0.0, fitted=False)
    curvature: Scalar = parameter(symbol="b", unit="1", lower=-10.0, upper=10.0, fitted=False, default=0.0)

    @classmethod
    def guess(cls, scales: Scales) -> "PressureStiffness":
        return cls(0.0, scales.pressure)

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return scales.force / scales.displacement

    def dependence(self) -> Dependence:
        return Dependence(
            "pressure", self.reference, _linear_stiffness.LinearStiffness(self.change), self.curvature
        )
