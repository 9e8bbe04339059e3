"""Dry friction that differs between the two directions: the part beyond the symmetrical one."""

from typing import ClassVar

import jax.numpy as jnp

from .._parameters import parameter
from .._types import Internal, Lanes, Scalar
from . import _coulomb_friction
from ._element import AbstractElement, Group, LookAlike, Scales


class AsymmetricFriction(AbstractElement):
    """Direction-dependent dry friction: half the difference between the two directions.

    `dF tanh(v / vs)^2` [N]; meant beside `Fc tanh(v / vs)`, with which it is `Fc + dF` against positive
    motion and `Fc - dF` against negative motion; |dF| <= Fc is what takes energy in both. vs is the declared
    regularising width of dry friction; records and orbits are split at reversals instead. In a motion that
    never rests it is a constant force but for the instants of reversal, and so all but exactly an offset of
    the drive.

    Attributes:
        difference: dF [N].
        width: vs [m/s].

    Source: Armstrong-Helouvry, Dupont & Canudas de Wit 1994, Automatica 30:1083; Janot, Gautier & Brunot
    2019 (EMPS), whose offset is this.
    """

    name: ClassVar[str] = "asymmetric_friction"
    words: ClassVar[str] = "direction-dependent friction"
    strength: ClassVar[str] = "difference"
    needs: ClassVar[tuple[str, ...]] = ("coulomb_friction",)
    signed: ClassVar[bool] = True
    substeps: ClassVar[int] = 4
    slides: ClassVar[bool] = True
    group: ClassVar[Group] = "Dry friction and hysteresis"
    look_alikes: ClassVar[tuple[LookAlike, ...]] = (
        LookAlike(
            ("input_offset",),
            "read the force channel with the exciter uncoupled: its offset is still there, and friction is "
            "not",
        ),
    )

    difference: Scalar = parameter(symbol="dF", unit="N")
    width: Scalar = parameter(symbol="vs", unit="m/s", lower=0.0, fitted=False)

    @classmethod
    def guess(cls, scales: Scales) -> "AsymmetricFriction":
        """See `AbstractElement.guess`: as wide as dry friction, beside which it stands."""
        return cls(0.0, _coulomb_friction.CoulombFriction.guess(scales).width)

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return scales.force

    def force(self, x: Lanes, v: Lanes, s: Internal) -> Lanes:
        return self.difference * jnp.tanh(v / self.width) ** 2

    def sharp_force(
        self, x: Lanes, v: Lanes, s: Internal, direction: Lanes, sides: tuple[Lanes, ...]
    ) -> Lanes:
        return self.difference * direction**2
