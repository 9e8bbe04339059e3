"""Viscous laws: forces that vanish with the velocity."""

from dataclasses import dataclass
from typing import ClassVar, no_type_check

from ._law import Law, Switch, velocity


@dataclass(frozen=True)
class LinearDamping(Law):
    """f = c1 v, with c1 in N s/m."""

    name: ClassVar[str] = "linear_damping"
    coefficient: float

    @no_type_check
    def force(self, t, x, v, z, s):
        """Force in N; see `Law.force`."""
        return self.coefficient * v


@dataclass(frozen=True)
class AbsQuadraticDamping(Law):
    """f = c2 |v| v, with c2 in N s^2/m^2; kink in the second derivative at v = 0."""

    name: ClassVar[str] = "abs_quadratic_damping"
    coefficient: float

    @property
    def switches(self) -> tuple[Switch, ...]:
        """The turning point."""
        return (velocity,)

    @no_type_check
    def force(self, t, x, v, z, s):
        """Force in N; see `Law.force`."""
        return self.coefficient * s[0] * v * v


@dataclass(frozen=True)
class CubicDamping(Law):
    """f = c3 v^3, with c3 in N s^3/m^3."""

    name: ClassVar[str] = "cubic_damping"
    coefficient: float

    @no_type_check
    def force(self, t, x, v, z, s):
        """Force in N; see `Law.force`."""
        return self.coefficient * v * v * v


@dataclass(frozen=True)
class PositionDamping(Law):
    """f = c x^2 v, with c in N s/m^3: damping that grows away from the centre."""

    name: ClassVar[str] = "position_damping"
    coefficient: float

    @no_type_check
    def force(self, t, x, v, z, s):
        """Force in N; see `Law.force`."""
        return self.coefficient * x * x * v
