"""Dry friction that falls with speed."""

from typing import ClassVar

import jax.numpy as jnp

from .._parameters import parameter
from .._types import Internal, Lanes, Scalar
from . import _coulomb_friction
from ._element import AbstractElement, Group, Scales


class StribeckFriction(AbstractElement):
    """Stribeck friction: dry friction that is larger at low speed and falls to its sliding value.

    `F [1 + r exp(-(v / vst)^2)] tanh(v / vs)` [N]: breakaway at `F (1 + r)`, sliding at F. It is the whole
    law and contains dry friction (r = 0), whose place it takes. vs is the declared regularising width of dry
    friction; records and orbits are split at reversals instead.

    Attributes:
        force_level: F, sliding friction [N].
        excess: r, share by which breakaway exceeds it [1].
        stribeck_velocity: vst, where the excess has fallen to 1/e [m/s].
        width: vs [m/s].

    Source: Stribeck 1902; Bo & Pavelescu 1982, Wear 82:277, with exponent 2 as in Armstrong-Helouvry 1991;
    Canudas de Wit et al. 1995, IEEE Trans. Automatic Control 40:419.
    """

    name: ClassVar[str] = "stribeck_friction"
    words: ClassVar[str] = "falling (Stribeck) friction"
    strength: ClassVar[str] = "force_level"
    substeps: ClassVar[int] = 4
    slides: ClassVar[bool] = True
    absorbs: ClassVar[tuple[str, ...]] = ("coulomb_friction",)
    group: ClassVar[Group] = "Dry friction and hysteresis"

    force_level: Scalar = parameter(symbol="F", unit="N", lower=0.0)
    excess: Scalar = parameter(symbol="r", unit="1", lower=0.0)
    stribeck_velocity: Scalar = parameter(symbol="vst", unit="m/s", lower=0.0)
    width: Scalar = parameter(symbol="vs", unit="m/s", lower=0.0, fitted=False)

    @classmethod
    def guess(cls, scales: Scales) -> "StribeckFriction":
        return cls._shaped(scales, 1.0, 0.3)

    @classmethod
    def grid(cls, scales: Scales) -> "tuple[StribeckFriction, ...]":
        """See `AbstractElement.grid`: a slight and a strong fall, over the low, middle and whole speed."""
        return tuple(cls._shaped(scales, excess, share) for share in (0.1, 0.3, 1.0) for excess in (0.5, 2.0))

    @classmethod
    def _shaped(cls, scales: Scales, excess: float, share: float) -> "StribeckFriction":
        """Give the absent effect that falls over a share of the speed, but over no less than three widths."""
        width = _coulomb_friction.CoulombFriction.guess(scales).width
        return cls(0.0, excess, jnp.hypot(3.0 * width, share * scales.velocity), width)

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return scales.force

    def force(self, x: Lanes, v: Lanes, s: Internal) -> Lanes:
        return self._size(v) * jnp.tanh(v / self.width)

    def sharp_force(
        self, x: Lanes, v: Lanes, s: Internal, direction: Lanes, sides: tuple[Lanes, ...]
    ) -> Lanes:
        return self._size(v) * direction

    def _size(self, v: Lanes) -> Lanes:
        """Give the size of the force at a speed [N]."""
        return self.force_level * (1.0 + self.excess * jnp.exp(-((v / self.stribeck_velocity) ** 2)))
