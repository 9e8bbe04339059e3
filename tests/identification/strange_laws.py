"""Laws of which the catalogue knows nothing, for the rig."""

from dataclasses import dataclass
from typing import ClassVar, no_type_check

import numpy as np

from isojax import rig

BASE = rig.base_laws(1.0805e6, -6.974e8, 2.51667e11, 1.027e4, -3.688e5, 5.3753e6)


@no_type_check
def _centre(x, v, z):
    return x


@no_type_check
def _turning(x, v, z):
    return v


@dataclass(frozen=True)
class Grip(rig.Law):
    """Damping that grows away from the centre: f = c |x| v."""

    name: ClassVar[str] = "grip"
    coefficient: float

    @property
    def switches(self):
        """The centre."""
        return (_centre,)

    @no_type_check
    def force(self, t, x, v, z, s):
        """Force in N; see `Law.force`."""
        return self.coefficient * s[0] * x * v


@dataclass(frozen=True)
class Governor(rig.Law):
    """A spring that stiffens with the speed: f = c x |v|."""

    name: ClassVar[str] = "governor"
    coefficient: float

    @property
    def switches(self):
        """The turning point."""
        return (_turning,)

    @no_type_check
    def force(self, t, x, v, z, s):
        """Force in N; see `Law.force`."""
        return self.coefficient * x * s[0] * v


@dataclass(frozen=True)
class Machine(rig.Law):
    """A machine on the same floor: f = A sin(w t), which no channel records."""

    name: ClassVar[str] = "machine"
    size: float
    angular: float

    @no_type_check
    def force(self, t, x, v, z, s):
        """Force in N; see `Law.force`."""
        return self.size * np.sin(self.angular * t)
