"""What the drive does between samples."""

from typing import ClassVar

import jax.numpy as jnp

from .._parameters import parameter
from .._types import Lanes, Scalar
from ._element import AbstractElement, Channels, Group, Scales

_ORDERS = ("hold_zero_order", "hold_linear", "hold_band_limited")


class InputHold(AbstractElement):
    """The drive runs between its samples otherwise than declared.

    `u + s (u_other - u)`: with s = 1 the other hold acted in place of the declared one. Its effect grows
    with frequency over sampling rate; between a zero-order hold and a straight line lies half a sample of
    delay.

    Attributes:
        share: s, 0 for the declared hold and 1 for the other; no hold gives more, the rest of its range is
            for the error of an estimate [1].
        order: which other: 0 constant until the next sample, 1 straight between samples, 2 band-limited [1].

    Source: Astrom & Wittenmark 1997, sec. 2.3; Pintelon & Schoukens 2012, sec. 13.2.
    """

    name: ClassVar[str] = "input_hold"
    words: ClassVar[str] = "another course of the drive between its samples"
    strength: ClassVar[str] = "share"
    channels: ClassVar[tuple[str, ...]] = _ORDERS
    group: ClassVar[Group] = "The drive and the floor"

    share: Scalar = parameter(symbol="s", unit="1", lower=0.0, upper=1.5)
    order: Scalar = parameter(symbol="n", unit="1", fitted=False)

    @classmethod
    def guess(cls, scales: Scales) -> "InputHold":
        return cls(0.0, 2.0)

    @classmethod
    def grid(cls, scales: Scales) -> "tuple[InputHold, ...]":
        """See `AbstractElement.grid`: each hold; the declared one changes nothing and is not seen."""
        return tuple(cls(0.0, order) for order in (0.0, 1.0, 2.0))

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return 1.0

    def channel_drive(self, channels: Channels) -> Lanes | float:
        kinds = [channels[name] for name in _ORDERS]
        other = jnp.where(self.order == 0.0, kinds[0], jnp.where(self.order == 1.0, kinds[1], kinds[2]))
        return self.share * other
