"""Dry friction with an exact sign law: the plant sticks where the remaining force stays within its limit."""

from dataclasses import dataclass
from typing import ClassVar, no_type_check

import numpy as np

from ._law import Law, Switch, velocity


@dataclass(frozen=True)
class CoulombFriction(Law):
    """Friction of a constant force in N: f = Fc sign(v) while sliding, any |f| <= Fc while stuck."""

    name: ClassVar[str] = "coulomb_friction"
    limit: float

    @property
    def switches(self) -> tuple[Switch, ...]:
        """The turning point."""
        return (velocity,)

    @property
    def holding(self) -> tuple[float, float]:
        """The friction interval at rest, N."""
        return -self.limit, self.limit

    @no_type_check
    def force(self, t, x, v, z, s):
        """Sliding force in N; see `Law.force`."""
        return self.limit * s[0]


@dataclass(frozen=True)
class AsymmetricFriction(Law):
    """Difference between the two directions, beside symmetrical friction: f = dF while sliding, in N.

    Friction of Fc and this one together resist sliding with Fc + dF up and Fc - dF down, and hold any force
    between the two at rest.
    """

    name: ClassVar[str] = "asymmetric_friction"
    difference: float

    @property
    def switches(self) -> tuple[Switch, ...]:
        """The turning point."""
        return (velocity,)

    @property
    def holding(self) -> tuple[float, float]:
        """What the interval at rest moves by, N."""
        return self.difference, self.difference

    @no_type_check
    def force(self, t, x, v, z, s):
        """Sliding force in N; see `Law.force`."""
        return self.difference * s[0] * s[0]


@dataclass(frozen=True)
class StribeckFriction(Law):
    """Friction that falls with speed: f = F [1 + r exp(-(v / vst)^2)] sign(v), any |f| <= F (1 + r) at rest.

    Args:
        limit: F, sliding friction, N.
        excess: r, share by which breakaway exceeds it.
        speed: vst, m/s.
    """

    name: ClassVar[str] = "stribeck_friction"
    limit: float
    excess: float
    speed: float

    @property
    def switches(self) -> tuple[Switch, ...]:
        """The turning point."""
        return (velocity,)

    @property
    def holding(self) -> tuple[float, float]:
        """The friction interval at rest, N."""
        breakaway = self.limit * (1.0 + self.excess)
        return -breakaway, breakaway

    @no_type_check
    def force(self, t, x, v, z, s):
        """Sliding force in N; see `Law.force`."""
        share = v / self.speed
        return s[0] * self.limit * (1.0 + self.excess * np.exp(-share * share))
