"""Dry friction."""

from typing import ClassVar

import jax.numpy as jnp

from .._parameters import parameter
from .._types import Internal, Lanes, Scalar
from ._element import AbstractElement, Group, LookAlike, Scales


class CoulombFriction(AbstractElement):
    """Dry friction: a constant force against the motion.

    `Fc sign(v)` [N] in records and orbits, which are split where the mass reverses, sticks and breaks loose;
    `Fc tanh(v / vs)` where a smooth law is needed, with a declared regularising width vs that is no physical
    number. Of a motion of velocity amplitude V that loses `pi^2/24 (vs/V)^2` of the dissipation, and `0.25
    vs/V` of the mean square force goes amiss near the reversals.

    Attributes:
        force_level: Fc [N].
        width: vs [m/s].

    Source: Coulomb 1785; equivalent damping 4 Fc/(pi omega X), Den Hartog 1931.
    """

    name: ClassVar[str] = "coulomb_friction"
    words: ClassVar[str] = "dry (Coulomb) friction"
    strength: ClassVar[str] = "force_level"
    substeps: ClassVar[int] = 4
    slides: ClassVar[bool] = True
    group: ClassVar[Group] = "Dry friction and hysteresis"
    look_alikes: ClassVar[tuple[LookAlike, ...]] = (
        LookAlike(
            ("dahl_friction", "bouc_wen", "lugre_friction"),
            "repeat at a third of the lowest level: presliding turns friction into stiffness there, while "
            "dry friction keeps its force",
            among=True,
        ),
    )

    force_level: Scalar = parameter(symbol="Fc", unit="N", lower=0.0)
    width: Scalar = parameter(symbol="vs", unit="m/s", lower=0.0, fitted=False)

    @classmethod
    def guess(cls, scales: Scales) -> "CoulombFriction":
        """See `AbstractElement.guess`: a fiftieth of the slowest motion, but no less than steps resolve.

        A fiftieth loses 2e-4 of the dissipation where it matters most. Half of the change of velocity in one
        integration step h must fit in, else the law is sampled, not integrated. Nor is the width less than
        `F h / (2 m)`, with the drive F: a mass held by a friction as large as the drive then moves with the
        rate `F / (m vs) = 2 / h`, inside the limit 2.78 / h of the Runge-Kutta step.
        """
        step = scales.sample_time / cls.substeps
        resolved = 0.5 * step * max(scales.acceleration, scales.force / scales.mass)
        return cls(0.0, max(0.02 * scales.slowest_velocity, resolved))

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return scales.force

    def force(self, x: Lanes, v: Lanes, s: Internal) -> Lanes:
        return self.force_level * jnp.tanh(v / self.width)

    def sharp_force(
        self, x: Lanes, v: Lanes, s: Internal, direction: Lanes, sides: tuple[Lanes, ...]
    ) -> Lanes:
        return self.force_level * direction
