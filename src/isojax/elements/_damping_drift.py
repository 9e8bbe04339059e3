"""A damping that drifts in the course of the test."""

from typing import ClassVar

from .._parameters import parameter
from .._types import Lanes, Scalar
from ._element import AbstractElement, Channels, Group, Scales


class DampingDrift(AbstractElement):
    """The linear damping changes steadily from the start of the test to its end (a fluid or a rubber warms).

    `f = dc tau v` with tau the time of the test, 0 at its start and 1 at its end; the linear damping of the
    model is that at the start.

    Attributes:
        change: dc, damping at the end less that at the start [N s/m].

    Source: damping over temperature, Jones 2001, Handbook of Viscoelastic Vibration Damping.
    """

    name: ClassVar[str] = "damping_drift"
    words: ClassVar[str] = "drift of the linear damping in the course of the test"
    strength: ClassVar[str] = "change"
    signed: ClassVar[bool] = True
    needs: ClassVar[tuple[str, ...]] = ("linear_damping",)
    channels: ClassVar[tuple[str, ...]] = ("clock",)
    group: ClassVar[Group] = "Dampers"

    change: Scalar = parameter(symbol="dc", unit="N s/m")

    @classmethod
    def guess(cls, scales: Scales) -> "DampingDrift":
        return cls(0.0)

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return scales.force / scales.velocity

    def channel_force(self, x: Lanes, v: Lanes, channels: Channels) -> Lanes | float:
        return self.change * channels["clock"] * v
