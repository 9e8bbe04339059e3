"""Dry friction with an exact sign law: the plant sticks where the remaining force stays within its limit."""

from dataclasses import dataclass
from typing import ClassVar, no_type_check

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
