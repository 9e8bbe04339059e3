"""Odd quadratic damper."""

from typing import ClassVar

import jax.numpy as jnp

from .._parameters import parameter
from .._types import Internal, Lanes, Scalar
from ._element import AbstractElement, Group, Scales


class AbsQuadraticDamping(AbstractElement):
    """Odd quadratic damper: turbulent orifice flow, or softening where negative.

    `c2 |v| v` [N].

    Attributes:
        coefficient: c2 [N s^2/m^2].

    Source: the paper, eq. (18); equivalent damping (8/3pi) c2 V, eq. (8).
    """

    name: ClassVar[str] = "abs_quadratic_damping"
    words: ClassVar[str] = "odd quadratic damping |v|v"
    strength: ClassVar[str] = "coefficient"
    signed: ClassVar[bool] = True
    group: ClassVar[Group] = "Dampers"

    coefficient: Scalar = parameter(symbol="c2", unit="N s^2/m^2")

    @classmethod
    def guess(cls, scales: Scales) -> "AbsQuadraticDamping":
        return cls(0.0)

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return scales.force / scales.velocity**2

    def force(self, x: Lanes, v: Lanes, s: Internal) -> Lanes:
        return self.coefficient * jnp.abs(v) * v

    def kinks(self, x: Lanes, v: Lanes, s: Internal) -> tuple[Lanes, ...]:
        return (v,)

    def force_beside(self, x: Lanes, v: Lanes, s: Internal, sides: tuple[Lanes, ...]) -> Lanes:
        return self.coefficient * sides[0] * v * v
