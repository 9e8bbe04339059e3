"""A stiffness that drifts in the course of the test."""

from typing import ClassVar

from .._parameters import parameter
from .._types import Lanes, Scalar
from ._element import AbstractElement, Channels, Group, Scales


class StiffnessDrift(AbstractElement):
    """The linear stiffness changes steadily from the start of the test to its end (warming, leakage).

    `f = dk tau x` with tau the time of the test, 0 at its start and 1 at its end; the linear stiffness of
    the model is that at the start.

    Attributes:
        change: dk, stiffness at the end less that at the start [N/m].

    Source: frequency drift of resonance tests, Ewins 2000, sec. 3.
    """

    name: ClassVar[str] = "stiffness_drift"
    words: ClassVar[str] = "drift of the linear stiffness in the course of the test"
    strength: ClassVar[str] = "change"
    signed: ClassVar[bool] = True
    needs: ClassVar[tuple[str, ...]] = ("linear_stiffness",)
    channels: ClassVar[tuple[str, ...]] = ("clock",)
    group: ClassVar[Group] = "Springs"

    change: Scalar = parameter(symbol="dk", unit="N/m")

    @classmethod
    def guess(cls, scales: Scales) -> "StiffnessDrift":
        return cls(0.0)

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return scales.force / scales.displacement

    def channel_force(self, x: Lanes, v: Lanes, channels: Channels) -> Lanes | float:
        return self.change * channels["clock"] * x
