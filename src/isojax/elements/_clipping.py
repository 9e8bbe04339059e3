"""Saturation of the response channel."""

from typing import ClassVar

import jax.numpy as jnp

from .._parameters import parameter
from .._types import Internal, Lanes, Scalar
from ._element import AbstractElement, Group, LookAlike, Scales


class Clipping(AbstractElement):
    """The response channel saturates: what goes beyond either end of its range is not recorded.

    `y -> y - share (y - clip(y, -L, U))`; share = 1 is a full stop at the ends, less a channel that is only
    less sensitive beyond them. The bound leaves room above 1, so that a full stop has an error bar like any
    other number. The range of an amplifier with a bias has its ends at unlike distances from zero, and one of
    them may never be reached: that one is then not determined. The reading is integrated by nothing, so that
    its corners need no rounding.

    Attributes:
        share: of the reading beyond the range that is lost [1].
        upper: U, end of the range above zero [SI unit of the output].
        lower: L, end of the range below zero, as a positive number [SI unit of the output].

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
    upper: Scalar = parameter(symbol="U", unit="SI unit of the output", lower=0.0)
    lower: Scalar = parameter(symbol="L", unit="SI unit of the output", lower=0.0)

    @classmethod
    def guess(cls, scales: Scales) -> "Clipping":
        end = 0.8 * max(scales.largest_reading, scales.reading)
        return cls(0.0, end, end)

    @classmethod
    def grid(cls, scales: Scales) -> "tuple[Clipping, ...]":
        """See `AbstractElement.grid`: ends just below the largest reading, alike or one out of reach."""
        largest = max(scales.largest_reading, scales.reading)
        alike = ((share, share) for share in (0.98, 0.93, 0.85, 0.7))
        ends = (*alike, (0.93, 2.0), (2.0, 0.93), (0.7, 2.0), (2.0, 0.7))
        return tuple(cls(0.0, upper * largest, lower * largest) for upper, lower in ends)

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return 1.0

    def reading(self, y: Lanes, s: Internal) -> Lanes:
        return y - self.share * (y - jnp.clip(y, -self.lower, self.upper))
