"""A damping that follows the temperature."""

from typing import ClassVar

from .._parameters import parameter
from .._types import Scalar
from . import _linear_damping
from ._element import AbstractElement, Dependence, Group, LookAlike, Scales


class TemperatureDamping(AbstractElement):
    """The linear damping follows the absolute temperature, from record to record.

    `f = dc (r + b r^2) v`, `r = T/T0 - 1`; the damping of the model is that at the reference T0.
    dc is negative for oil and for rubber near its glass transition, positive for gas.

    Attributes:
        change: dc, what the damping would gain by a straight line where T is twice T0 [N s/m].
        reference: T0, the mean over the fitted records [K].
        curvature: b, by which the change bends; 0 is a straight line [1].

    Source: Jones 2001, Handbook of Viscoelastic Vibration Damping; recorded by `temperature` of [[record]].
    """

    name: ClassVar[str] = "temperature_damping"
    words: ClassVar[str] = "linear damping that follows the temperature"
    strength: ClassVar[str] = "change"
    signed: ClassVar[bool] = True
    needs: ClassVar[tuple[str, ...]] = ("linear_damping",)
    channels: ClassVar[tuple[str, ...]] = ("temperature",)
    group: ClassVar[Group] = "Dampers"
    look_alikes: ClassVar[tuple[LookAlike, ...]] = (
        LookAlike(
            ("damping_drift",),
            "repeat the first temperature at the end of the test: a drift does not go back with it",
        ),
    )

    change: Scalar = parameter(symbol="dc", unit="N s/m")
    reference: Scalar = parameter(symbol="T0", unit="K", lower=0.0, fitted=False)
    curvature: Scalar = parameter(symbol="b", unit="1", lower=-10.0, upper=10.0, fitted=False, default=0.0)

    @classmethod
    def guess(cls, scales: Scales) -> "TemperatureDamping":
        return cls(0.0, scales.temperature)

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return scales.force / scales.velocity

    def dependence(self) -> Dependence:
        return Dependence(
            "temperature", self.reference, _linear_damping.LinearDamping(self.change), self.curvature
        )
