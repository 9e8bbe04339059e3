"""A stiffness that follows the temperature."""

from typing import ClassVar

from .._parameters import parameter
from .._types import Scalar
from . import _linear_stiffness
from ._element import AbstractElement, Dependence, Group, LookAlike, Scales


class TemperatureStiffness(AbstractElement):
    """The linear stiffness follows the absolute temperature, from record to record.

    `f = dk (r + b r^2) x`, `r = T/T0 - 1`; the stiffness of the model is that at the reference T0.
    Rubber far above its glass transition stiffens in proportion to T, near it it softens much faster.

    Attributes:
        change: dk, what the stiffness would gain by a straight line where T is twice T0 [N/m].
        reference: T0, the mean over the fitted records [K].
        curvature: b, by which the change bends; 0 is a straight line [1].

    Source: Ferry 1980, Viscoelastic Properties of Polymers, ch. 11; recorded by `temperature` of [[record]].
    """

    name: ClassVar[str] = "temperature_stiffness"
    words: ClassVar[str] = "linear stiffness that follows the temperature"
    strength: ClassVar[str] = "change"
    signed: ClassVar[bool] = True
    needs: ClassVar[tuple[str, ...]] = ("linear_stiffness",)
    channels: ClassVar[tuple[str, ...]] = ("temperature",)
    group: ClassVar[Group] = "Springs"
    look_alikes: ClassVar[tuple[LookAlike, ...]] = (
        LookAlike(
            ("stiffness_drift",),
            "repeat the first temperature at the end of the test: a drift does not go back with it",
        ),
    )

    change: Scalar = parameter(symbol="dk", unit="N/m")
    reference: Scalar = parameter(symbol="T0", unit="K", lower=0.0, fitted=False)
    curvature: Scalar = parameter(symbol="b", unit="1", lower=-10.0, upper=10.0, fitted=False, default=0.0)

    @classmethod
    def guess(cls, scales: Scales) -> "TemperatureStiffness":
        return cls(0.0, scales.temperature)

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return scales.force / scales.displacement

    def dependence(self) -> Dependence:
        return Dependence(
            "temperature", self.reference, _linear_stiffness.LinearStiffness(self.change), self.curvature
        )
