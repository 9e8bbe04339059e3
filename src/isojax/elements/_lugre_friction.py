"""LuGre friction."""

from typing import ClassVar

import jax.numpy as jnp

from .._parameters import parameter
from .._types import Internal, Lanes, Scalar
from ._element import AbstractElement, Group, Scales


class LugreFriction(AbstractElement):
    """LuGre friction: bristles that bend, slip, and slip more easily once they slide.

    `f = Fc (z + tau1 z')`, `z' = (v - |v| z / g(v)) / delta`, `g = 1 + r exp(-(v / vst)^2)`: the published
    law with its bristle deflection in units of `delta = Fc / sigma0`, so that it stays defined at Fc = 0;
    `r = Fs / Fc - 1`, `tau1 = sigma1 / sigma0`. Its viscous term is the damper's. With r = tau1 = 0 it is
    Dahl's friction, whose place it takes.

    The bristles relax at the rate `|v| / (delta g)`, far above the excited band where delta is small.

    Attributes:
        force_level: Fc, friction of fast sliding [N].
        presliding: delta, way within which the bristles bend [m].
        excess: r, share by which breaking away takes more than sliding [1].
        stribeck_velocity: vst, at which that excess has gone [m/s].
        bristle_time: tau1 [s]; it shows within the presliding only, and is fitted on request.

    Source: Canudas de Wit, Olsson, Astrom & Lischinsky 1995, IEEE Trans. Autom. Control 40:419, eqs. (1)-(5).
    """

    name: ClassVar[str] = "lugre_friction"
    words: ClassVar[str] = "LuGre friction (presliding and Stribeck effect)"
    strength: ClassVar[str] = "force_level"
    internal_states: ClassVar[int] = 1
    substeps: ClassVar[int] = 4
    absorbs: ClassVar[tuple[str, ...]] = ("dahl_friction",)
    group: ClassVar[Group] = "Dry friction and hysteresis"

    force_level: Scalar = parameter(symbol="Fc", unit="N", lower=0.0)
    presliding: Scalar = parameter(symbol="delta", unit="m", lower=0.0)
    excess: Scalar = parameter(symbol="r", unit="1", lower=0.0)
    stribeck_velocity: Scalar = parameter(symbol="vst", unit="m/s", lower=0.0)
    bristle_time: Scalar = parameter(symbol="tau1", unit="s", lower=0.0, fitted=False)

    @classmethod
    def guess(cls, scales: Scales) -> "LugreFriction":
        return cls._shaped(scales, 0.1, 0.3)

    @classmethod
    def grid(cls, scales: Scales) -> "tuple[LugreFriction, ...]":
        """See `AbstractElement.grid`: presliding below the motion, Stribeck velocity below its velocity."""
        return tuple(cls._shaped(scales, way, speed) for way in (0.05, 0.3) for speed in (0.1, 0.4))

    @classmethod
    def _shaped(cls, scales: Scales, way: float, speed: float) -> "LugreFriction":
        """Give the absent effect with shares of the motion; no way shorter than measurement resolves."""
        presliding = max((1.0 + way) * scales.velocity * scales.sample_time, way * scales.displacement)
        return cls(0.0, presliding, 0.5, speed * scales.velocity, 0.1 * presliding / scales.velocity)

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return scales.force

    def force(self, x: Lanes, v: Lanes, s: Internal) -> Lanes:
        return self._force(v, s[0], jnp.abs(v))

    def state_rate(self, x: Lanes, v: Lanes, s: Internal) -> Internal:
        return (self._rate(v, s[0], jnp.abs(v)),)

    def kinks(self, x: Lanes, v: Lanes, s: Internal) -> tuple[Lanes, ...]:
        return (v,)

    def force_beside(self, x: Lanes, v: Lanes, s: Internal, sides: tuple[Lanes, ...]) -> Lanes:
        return self._force(v, s[0], sides[0] * v)

    def state_rate_beside(self, x: Lanes, v: Lanes, s: Internal, sides: tuple[Lanes, ...]) -> Internal:
        return (self._rate(v, s[0], sides[0] * v),)

    def _rate(self, v: Lanes, z: Lanes, speed: Lanes) -> Lanes:
        limit = 1.0 + self.excess * jnp.exp(-((v / self.stribeck_velocity) ** 2))
        return (v - speed * z / limit) / self.presliding

    def _force(self, v: Lanes, z: Lanes, speed: Lanes) -> Lanes:
        return self.force_level * (z + self.bristle_time * self._rate(v, z, speed))
