"""Motion of the floor under the isolator."""

from typing import ClassVar

from .._parameters import parameter
from .._types import Lanes, Scalar
from ._element import AbstractElement, Channels, Group, Scales


class FloorMotion(AbstractElement):
    """The floor moves under the isolator: springs and dampers see the motion less that of the floor.

    With z = x - xb and a_b the measured acceleration of the floor, `m (z'' + T a_b) + sum of forces(z, z') =
    F`; an acceleration reading is the absolute one, z'' + T a_b, velocity and displacement are relative to
    the floor.

    Attributes:
        transmission: T, share of the measured motion that reaches the isolator; 1 as measured [1].

    Source: Rivin 2003, Passive Vibration Isolation, sec. 1.3; Harris & Piersol 2002, ch. 30.
    """

    name: ClassVar[str] = "floor_motion"
    words: ClassVar[str] = "motion of the floor"
    strength: ClassVar[str] = "transmission"
    signed: ClassVar[bool] = True
    channels: ClassVar[tuple[str, ...]] = ("floor",)
    group: ClassVar[Group] = "The drive and the floor"

    transmission: Scalar = parameter(symbol="T", unit="1")

    @classmethod
    def guess(cls, scales: Scales) -> "FloorMotion":
        return cls(0.0)

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        """See `AbstractElement.typical_strength`: as measured."""
        return 1.0

    def channel_base(self, channels: Channels) -> Lanes | None:
        return self.transmission * channels["floor"]
