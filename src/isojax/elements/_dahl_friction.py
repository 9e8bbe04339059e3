"""Dahl's friction."""

from typing import ClassVar

import jax.numpy as jnp

from .._parameters import parameter
from .._types import Internal, Lanes, Scalar
from ._element import AbstractElement, Group, Scales


class DahlFriction(AbstractElement):
    """Dahl's friction: a spring at small motion that slips at large motion; hysteresis without a time scale.

    `f = Fd w`, `w' = (v - |v| w) / xd`: Dahl's `z' = sigma (v - |v| z / Fd)`, `f = z`, with `w = z / Fd` and
    the presliding displacement `xd = Fd / sigma`, so that the law stays defined at Fd = 0.

    Attributes:
        force_level: Fd [N].
        presliding: xd [m].

    Source: Dahl 1968, Aerospace Corp. TOR-0158(3107-18)-1; 1976, AIAA J. 14:1675, eq. (3) with exponent 1.
    """

    name: ClassVar[str] = "dahl_friction"
    words: ClassVar[str] = "presliding (Dahl) friction"
    strength: ClassVar[str] = "force_level"
    internal_states: ClassVar[int] = 1
    substeps: ClassVar[int] = 2
    group: ClassVar[Group] = "Dry friction and hysteresis"

    force_level: Scalar = parameter(symbol="Fd", unit="N", lower=0.0)
    presliding: Scalar = parameter(symbol="xd", unit="m", lower=0.0)

    @classmethod
    def guess(cls, scales: Scales) -> "DahlFriction":
        return cls(0.0, 0.3 * scales.displacement)

    @classmethod
    def grid(cls, scales: Scales) -> "tuple[DahlFriction, ...]":
        """See `AbstractElement.grid`: presliding from a thirtieth of the motion to all of it.

        It is never less than the way covered in a sample, which the measurement could not resolve.
        """
        smallest = scales.velocity * scales.sample_time
        return tuple(cls(0.0, max(smallest, share * scales.displacement)) for share in (0.03, 0.1, 0.3, 1.0))

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return scales.force

    def force(self, x: Lanes, v: Lanes, s: Internal) -> Lanes:
        return self.force_level * s[0]

    def state_rate(self, x: Lanes, v: Lanes, s: Internal) -> Internal:
        return ((v - jnp.abs(v) * s[0]) / self.presliding,)

    def kinks(self, x: Lanes, v: Lanes, s: Internal) -> tuple[Lanes, ...]:
        return (v,)

    def state_rate_beside(self, x: Lanes, v: Lanes, s: Internal, sides: tuple[Lanes, ...]) -> Internal:
        return ((v - sides[0] * v * s[0]) / self.presliding,)
