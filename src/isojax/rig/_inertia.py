"""Mass that moves with the plant and is not declared."""

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
