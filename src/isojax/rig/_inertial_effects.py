"""Mass that moves with the plant and is not declared: rigidly, or on a spring of its own."""

import math
from dataclasses import dataclass
from typing import ClassVar, no_type_check

from ._law import Law


@dataclass(frozen=True)
class AddedMass(Law):
    """Mass in kg (signed) on top of the declared one."""

    name: ClassVar[str] = "added_mass"
    mass: float

    @property
    def inertia(self) -> float:
        """The mass, kg."""
        return self.mass

    @no_type_check
    def force(self, t, x, v, z, s):
        """No force: the mass acts through `inertia`."""
        return 0.0


@dataclass(frozen=True)
class SecondMode(Law):
    """Mass on a spring and a dashpot of its own, carried by the plant; states: spring extension, speed.

    Args:
        mass: kg.
        frequency: natural frequency with the plant held, Hz.
        ratio: damping ratio with the plant held.
    """

    name: ClassVar[str] = "second_mode"
    inner: ClassVar[int] = 2
    speeds: ClassVar[tuple[int, ...]] = (1,)
    mass: float
    frequency: float
    ratio: float

    @property
    def _pair(self) -> tuple[float, float]:
        """Stiffness in N/m and damping in N s/m."""
        stiffness = self.mass * (2 * math.pi * self.frequency) ** 2
        return stiffness, 2 * self.ratio * math.sqrt(stiffness * self.mass)

    @no_type_check
    def force(self, t, x, v, z, s):
        """Force in N of the stretched spring and dashpot; see `Law.force`."""
        stiffness, damping = self._pair
        return stiffness * z[0] + damping * (v - z[1])

    @no_type_check
    def rate(self, t, x, v, z, s):
        """Rate of the extension, m/s, and acceleration of the mass, m/s^2."""
        return v - z[1], self.force(t, x, v, z, s) / self.mass
