"""Bouc-Wen hysteresis."""

from typing import ClassVar

import jax.numpy as jnp

from .._parameters import parameter
from .._types import Internal, Lanes, Scalar
from ._element import AbstractElement, Group, Scales


class BoucWen(AbstractElement):
    """Bouc-Wen hysteresis: a spring whose force depends on the path, not on the rate.

    `f = K z`, `z' = v - beta |v| |z|^(n-1) z - gamma v |z|^n`.

    Dissipation over the visited loop is what makes a parameter set admissible, not `|gamma| <= beta`: the
    Bouc-Wen benchmark's own truth, beta 800 and gamma -1100, breaks that rule and takes energy in every loop.

    Attributes:
        stiffness: K [N/m].
        beta: size of the loop [1/m^n].
        gamma: its shape [1/m^n].
        exponent: n, sharpness of the knee; fitted only on request.

    Source: Bouc 1967; Wen 1976, J. Eng. Mech. 102:249; Ismail, Ikhouane & Rodellar 2009, eq. (2).
    """

    name: ClassVar[str] = "bouc_wen"
    words: ClassVar[str] = "Bouc-Wen hysteresis"
    strength: ClassVar[str] = "stiffness"
    internal_states: ClassVar[int] = 1
    substeps: ClassVar[int] = 2
    group: ClassVar[Group] = "Dry friction and hysteresis"

    stiffness: Scalar = parameter(symbol="K", unit="N/m", lower=0.0)
    beta: Scalar = parameter(symbol="beta", unit="1/m^n", lower=0.0)
    gamma: Scalar = parameter(symbol="gamma", unit="1/m^n")
    exponent: Scalar = parameter(symbol="n", unit="1", lower=0.5, upper=10.0, fitted=False)

    @classmethod
    def guess(cls, scales: Scales) -> "BoucWen":
        return cls(0.0, 1.0 / scales.displacement, -0.5 / scales.displacement, 1.0)

    @classmethod
    def grid(cls, scales: Scales) -> "tuple[BoucWen, ...]":
        """See `AbstractElement.grid`: softening and hardening loops, from slight to full."""
        return tuple(
            cls(0.0, size / scales.displacement, shape * size / scales.displacement, 1.0)
            for size in (0.2, 1.0, 5.0)
            for shape in (0.5, -0.9)
        )

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return scales.force / scales.displacement

    def unphysical_shape(self, displacement: float) -> str | None:
        """See `AbstractElement.unphysical_shape`: loads like a plain spring, and lets go at once on return.

        Loading follows `dz/dx = 1 - (beta + gamma) z^n`, the way back `1 + (beta - gamma) z^n`. Where beta
        and gamma all but cancel, nothing yields on the way out, and where the difference is large all is lost
        within a small part of the way back: no slip and no friction, but terms of opposite sign that fit
        noise.
        """
        power = displacement ** float(self.exponent)
        forth, back = (float(self.beta) + sign * float(self.gamma) for sign in (1.0, -1.0))
        if back * power > 10.0 and abs(forth) < 0.02 * back:
            return "has a beta and a gamma that cancel on loading and let go at once on return"
        return None

    def force(self, x: Lanes, v: Lanes, s: Internal) -> Lanes:
        return self.stiffness * s[0]

    def state_rate(self, x: Lanes, v: Lanes, s: Internal) -> Internal:
        (z,) = s
        # |z|^n has a NaN derivative in n at rest; the floor is far below any measured displacement.
        power = jnp.maximum(jnp.abs(z), 1e-30) ** self.exponent
        return (v - self.beta * jnp.abs(v) * power * jnp.sign(z) - self.gamma * v * power,)

    def kinks(self, x: Lanes, v: Lanes, s: Internal) -> tuple[Lanes, ...]:
        return (v, s[0])

    def state_rate_beside(self, x: Lanes, v: Lanes, s: Internal, sides: tuple[Lanes, ...]) -> Internal:
        forth, out = sides
        reach = out * s[0]
        # With n = 1 this is linear in z on either side of the kink; the floor acts on the other factor alone.
        power = reach * jnp.maximum(reach, 1e-30) ** (self.exponent - 1.0)
        return (v - self.beta * forth * v * power * out - self.gamma * v * power,)
