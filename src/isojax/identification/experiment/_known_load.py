"""A static load of known size, as a planned test puts it on the isolator."""

from typing import ClassVar

from ..._parameters import parameter
from ..._types import Internal, Lanes, Scalar
from ...elements import AbstractElement, Scales


class KnownLoad(AbstractElement):
    """A weight hung on the isolator: no channel records it, and no error of a channel changes it.

    `-W` [N] on the side of the restoring forces. No effect that a model may lack, hence in no catalogue.

    Attributes:
        weight: W [N].

    Source: statics.
    """

    name: ClassVar[str] = "known_load"
    words: ClassVar[str] = "known static load"
    strength: ClassVar[str] = "weight"
    signed: ClassVar[bool] = True

    weight: Scalar = parameter(symbol="W", unit="N", fitted=False)

    @classmethod
    def guess(cls, scales: Scales) -> "KnownLoad":
        return cls(0.0)

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return scales.force

    def force(self, x: Lanes, v: Lanes, s: Internal) -> Lanes:
        return -self.weight + 0.0 * x
