"""A damping that follows the pressure in the chamber."""

from typing import ClassVar

from .._parameters import parameter
from .._types import Scalar
from . import _linear_damping
from ._element import AbstractElement, Dependence, Group, LookAlike, Scales


class PressureDamping(AbstractElement):
    """The linear damping follows the absolute pressure in the chamber, from record to record.

    `f = dc (r + b r^2) v`, `r = p/p0 - 1`; the damping of the model is that at the reference p0.
    The flow through an orifice between chambers, and so its loss, changes with the density of the gas.

    Attributes:
        change: dc, what the damping would gain by a straight line where p is twice p0 [N s/m].
        reference: p0, the mean over the fitted records [Pa].
        curvature: b, by which the change bends; 0 is a straight line [1].

    Source: Erin, Wilson & Zapfe 1998, J. Sound Vib. 218:81; recorded by `pressure` of [[record]].
    """

    name: ClassVar[str] = "pressure_damping"
    words: ClassVar[str] = "linear damping that follows the chamber pressure"
    strength: ClassVar[str] = "change"
    signed: ClassVar[bool] = True
    needs: ClassVar[tuple[str, ...]] = ("linear_damping",)
    channels: ClassVar[tuple[str, ...]] = ("pressure",)
    group: ClassVar[Group] = "Dampers"
    look_alikes: ClassVar[tuple[LookAlike, ...]] = (
        LookAlike(
            ("damping_drift",),
            "repeat the first pressure at the end of the test: a drift does not go back with it",
        ),
        LookAlike(
            ("temperature_damping",),
            "change the pressure at one temperature: only the one that is changed moves the damping",
        ),
    )

    change: Scalar = parameter(symbol="dc", unit="N s/m")
    reference: Scalar = parameter(symbol="p0", unit="Pa", lower=0.0, fitted=False)
    curvature: Scalar = parameter(symbol="b", unit="1", lower=-10.0, upper=10.0, fitted=False, default=0.0)

    @classmethod
    def guess(cls, scales: Scales) -> "PressureDamping":
        return cls(0.0, scales.pressure)

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return scales.force / scales.velocity

    def dependence(self) -> Dependence:
        return Dependence(
            "pressure", self.reference, _linear_damping.LinearDamping(self.change), self.curvature
        )
