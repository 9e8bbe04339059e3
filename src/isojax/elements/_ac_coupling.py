"""AC coupling of the response channel."""

import math
from typing import ClassVar

from .._parameters import parameter
from .._types import Internal, Lanes, Scalar
from ._element import AbstractElement, Group, LookAlike, Scales


class AcCoupling(AbstractElement):
    """The response channel passes no constant: a first-order high-pass of the reading.

    `y -> y - wc s`, `s' = y - (wc + wl) s`, `wc = 2 pi fc`, `wl = 2 pi fl`: the response
    `(i w + wl) / (i w + wc + wl)`, a high-pass `i w / (i w + wc)` but for the declared leak fl. Without it s
    would be the plain integral of the reading where the effect is absent, and grow from any constant in it.
    In the excited band the leak adds `-fc fl / f^2` to the gain, which a fit puts into other coefficients:
    less than 1e-3 of a cubic stiffness with fl a 500th of the excited frequency, which forgets within some
    hundred cycles.

    Attributes:
        corner: fc [Hz].
        leak: fl, declared [Hz]; 0 for the plain high-pass.

    Source: Horowitz & Hill 2015, The Art of Electronics, sec. 1.7.1.
    """

    name: ClassVar[str] = "ac_coupling"
    words: ClassVar[str] = "AC coupling of the response channel"
    strength: ClassVar[str] = "corner"
    internal_states: ClassVar[int] = 1
    group: ClassVar[Group] = "The response channel"
    look_alikes: ClassVar[tuple[LookAlike, ...]] = (
        LookAlike(
            ("input_delay",),
            "extend the band downwards: the lead of an AC coupling grows there, the phase of a delay "
            "vanishes",
        ),
    )

    corner: Scalar = parameter(symbol="fc", unit="Hz", lower=0.0)
    leak: Scalar = parameter(symbol="fl", unit="Hz", lower=0.0, fitted=False)

    @classmethod
    def guess(cls, scales: Scales) -> "AcCoupling":
        return cls(0.0, 0.002 * scales.angular_frequency / (2.0 * math.pi))

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return scales.angular_frequency / (2.0 * math.pi)

    def reading(self, y: Lanes, s: Internal) -> Lanes:
        return y - 2.0 * math.pi * self.corner * s[0]

    def reading_rate(self, y: Lanes, s: Internal) -> Internal:
        return (y - 2.0 * math.pi * (self.corner + self.leak) * s[0],)
