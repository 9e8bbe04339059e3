"""Gas spring."""

from typing import ClassVar

import jax.numpy as jnp

from .._parameters import parameter
from .._types import Internal, Lanes, Scalar
from ._element import AbstractElement, Group, LookAlike, Scales

SOLID = 0.1
"""Share of the gas length below which the law is carried on by its parabola: no such bellows is built."""


class PolytropicGas(AbstractElement):
    """Gas spring: a closed gas volume that is compressed one way and expands the other.

    `P0 A [(1 - x / L)^-n - 1]` [N] where positive displacement compresses it (side +1), mirrored where
    negative displacement does (side -1). With `k = n P0 A / L` it is `k x + k (n + 1) x^2 / (2 L) + k (n +
    1)(n + 2) x^3 / (6 L^2)` and on: curvature and hardening are tied, which a free polynomial does not tie.
    Beyond nine tenths of L the law goes on as the parabola that touches it there, so that a search that
    strays meets numbers.

    Attributes:
        preload: P0 A, absolute pressure times area at rest [N].
        gas_length: L, gas volume over area at rest [m].
        exponent: n [1], 1 where heat flows freely, 1.4 for air where none does; fitted only on request, for
            it differs from a change of L only in the fourth order of x / L.
        side: +1 compressed by positive displacement, -1 by negative [1]; declared, not fitted.

    Source: Quaglia & Sorli 2001, Vehicle System Dynamics 35:443; Nieto et al. 2008, J. Sound Vib. 313:290.
    """

    name: ClassVar[str] = "polytropic_gas"
    words: ClassVar[str] = "gas spring (polytropic)"
    strength: ClassVar[str] = "preload"
    group: ClassVar[Group] = "Springs"
    look_alikes: ClassVar[tuple[LookAlike, ...]] = (
        LookAlike(
            ("quadratic_stiffness",),
            "repeat at three times the top level: gas hardens with the cube of the motion, by a coefficient"
            " tied to that of its square, while a parabola goes on as it is",
        ),
    )

    preload: Scalar = parameter(symbol="P0 A", unit="N", lower=0.0)
    gas_length: Scalar = parameter(symbol="L", unit="m", lower=0.0)
    exponent: Scalar = parameter(symbol="n", unit="1", lower=0.9, upper=1.8, fitted=False)
    side: Scalar = parameter(symbol="side", unit="1", fitted=False)

    @classmethod
    def guess(cls, scales: Scales) -> "PolytropicGas":
        return cls(0.0, 10.0 * scales.displacement, 1.4, 1.0)

    @classmethod
    def grid(cls, scales: Scales) -> "tuple[PolytropicGas, ...]":
        """See `AbstractElement.grid`: strong and slight compression, slow and fast, either way round."""
        return tuple(
            cls(0.0, length * scales.displacement, exponent, side)
            for length in (5.0, 15.0)
            for exponent in (1.0, 1.4)
            for side in (1.0, -1.0)
        )

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        """See `AbstractElement.typical_strength`: that of the guess, whose stiffness is n P0 A / L."""
        return scales.force * 10.0 / 1.4

    def force(self, x: Lanes, v: Lanes, s: Internal) -> Lanes:
        left = 1.0 - self.side * x / self.gas_length
        gas = jnp.maximum(left, SOLID)
        # Taylor's parabola about `gas`, which is the law itself wherever gas is left.
        beyond, n = gas - left, self.exponent
        pressure = gas**-n
        slope, bend = n * pressure / gas, n * (n + 1.0) * pressure / gas**2
        return self.side * self.preload * (pressure - 1.0 + slope * beyond + 0.5 * bend * beyond**2)
