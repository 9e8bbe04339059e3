"""Odd quadratic spring."""

from typing import ClassVar

import jax.numpy as jnp

from .._parameters import parameter
from .._types import Internal, Lanes, Scalar
from ._element import AbstractElement, Group, Scales


class AbsQuadraticStiffness(AbstractElement):
    """Odd quadratic spring: softening or hardening proportional to the amplitude.

    `k2 |x| x` [N].

    Attributes:
        coefficient: k2 [N/m^2].

    Source: the paper, eq. (13); equivalent stiffness (8/3pi) k2 X, eq. (7).
    """

    name: ClassVar[str] = "abs_quadratic_stiffness"
    words: ClassVar[str] = "odd quadratic spring |x|x"
    strength: ClassVar[str] = "coefficient"
    signed: ClassVar[bool] = True
    group: ClassVar[Group] = "Springs"

    coefficient: Scalar = parameter(symbol="k2", unit="N/m^2")

    @classmethod
    def guess(cls, scales: Scales) -> "AbsQuadraticStiffness":
        return cls(0.0)

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return scales.force / scales.displacement**2

    def force(self, x: Lanes, v: Lanes, s: Internal) -> Lanes:
        return self.coefficient * jnp.abs(x) * x

    def kinks(self, x: Lanes, v: Lanes, s: Internal) -> tuple[Lanes, ...]:
        return (x,)

    def force_beside(self, x: Lanes, v: Lanes, s: Internal, sides: tuple[Lanes, ...]) -> Lanes:
        return self.coefficient * sides[0] * x * x
