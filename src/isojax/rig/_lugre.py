"""LuGre friction in its published form."""

from dataclasses import dataclass
from typing import ClassVar, no_type_check

import numpy as np

from ._law import Law, Switch, velocity


@dataclass(frozen=True)
class LugreFriction(Law):
    """LuGre friction: z' = v - sigma0 |v| z / g(v), f = sigma0 z + sigma1 z', no viscous term.

    g(v) = Fc + (Fs - Fc) exp(-(v / vs)^2).

    Args:
        limit: Fc, friction of fast sliding, N.
        breakaway: Fs, friction of slow sliding, N.
        speed: vs, Stribeck velocity, m/s.
        stiffness: sigma0, of the bristles, N/m.
        damping: sigma1, of the bristles, N s/m.
    """

    name: ClassVar[str] = "lugre_friction"
    inner: ClassVar[int] = 1
    limit: float
    breakaway: float
    speed: float
    stiffness: float
    damping: float = 0.0

    @property
    def switches(self) -> tuple[Switch, ...]:
        """The turning point."""
        return (velocity,)

    @no_type_check
    def force(self, t, x, v, z, s):
        """Force in N; see `Law.force`."""
        return self.stiffness * z[0] + self.damping * self.rate(t, x, v, z, s)[0]

    @no_type_check
    def rate(self, t, x, v, z, s):
        """Rate of the bristles' deflection, m/s."""
        sliding = self.limit + (self.breakaway - self.limit) * np.exp(-((v / self.speed) ** 2))
        return (v - self.stiffness * s[0] * v * z[0] / sliding,)
