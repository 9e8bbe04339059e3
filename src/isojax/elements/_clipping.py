"""Saturation of the response channel."""

from typing import ClassVar

import jax.numpy as jnp

from .._parameters import parameter
from .._types import Internal, Lanes, Scalar
from ._base import AbstractElement, Group, LookAlike, Scales


class Clipping(AbstractElement):
    """The response channel saturates: what goes beyond a level is not recorded.

    `y -> y - share (y - clip(y, -L, L))`; share = 1 is a full stop at the level, less a channel that is only
    less sensitive beyond it. The bound leaves room above 1, so that a full stop has an error bar like any
    other number. The reading is integrated by nothing, so that its corners need no rounding.

    Attributes:
        share: of the reading beyond the level that is lost [1].
        level: L [SI unit of the output].

    Source: IEEE Std 1057-2017 on the range of digitisers.
    """

    name: ClassVar[str] = "clipping"
    words: ClassVar[str] = "saturation of the response channel"
    strength: ClassVar[str] = "share"
    group: ClassVar[Group] = "The response channel"
    look_alikes: ClassVar[tuple[LookAlike, ...]] = (
        LookAlike(
            ("end_stop",),
            "repeat the top level with the next larger range of the response channel: a stop stays, a "
            "clipped top does not",
        ),
    )

    share: Scalar = parameter(symbol="share", unit="1", lower=0.0, upper=1.5)
    level: Scalar = parameter(symbol="L", unit="SI unit of the output", lower=0.0)

    @classmethod
    def guess(cls, scales: Scales) -> "Clipping":
        return cls(0.0, 0.8 * max(scales.largest_reading, scales.reading))

    @classmethod
    def grid(cls, scales: Scales) -> "tuple[Clipping, ...]":
        """See `AbstractElement.grid`: levels just below the largest reading."""
        largest = max(scales.largest_reading, scales.reading)
        return tuple(cls(0.0, share * largest) for share in (0.98, 0.93, 0.85, 0.7))

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return 1.0

    def reading(self, y: Lanes, s: Internal) -> Lanes:
        return y - self.share * (y - jnp.clip(y, -self.level, self.level))
