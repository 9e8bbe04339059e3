"""Hysteresis: forces that remember the path, not the speed."""

from dataclasses import dataclass
from typing import ClassVar, no_type_check

from ._law import Law, Switch, velocity


@no_type_check
def _memory(x, v, z):
    return z[0]


@dataclass(frozen=True)
class DahlFriction(Law):
    """Dahl's presliding friction: z' = sigma (v - |v| z / Fd), f = z.

    Args:
        limit: Fd, friction force that is reached after long sliding, N.
        stiffness: sigma, stiffness at the start of a reversal, N/m.
    """

    name: ClassVar[str] = "dahl_friction"
    inner: ClassVar[int] = 1
    limit: float
    stiffness: float

    @property
    def switches(self) -> tuple[Switch, ...]:
        """The turning point."""
        return (velocity,)

    @no_type_check
    def force(self, t, x, v, z, s):
        """Force in N; see `Law.force`."""
        return z[0]

    @no_type_check
    def rate(self, t, x, v, z, s):
        """Rate of the friction force, N/s."""
        return (self.stiffness * (v - s[0] * v * z[0] / self.limit),)


@dataclass(frozen=True)
class BoucWen(Law):
    """Bouc-Wen hysteresis: z' = v - beta |v| |z|^(n-1) z - gamma v |z|^n, f = K z.

    Args:
        stiffness: K, N/m.
        beta: m^-n.
        gamma: m^-n.
        exponent: n >= 1.
    """

    name: ClassVar[str] = "bouc_wen"
    inner: ClassVar[int] = 1
    stiffness: float
    beta: float
    gamma: float
    exponent: float = 1.0

    def __post_init__(self) -> None:
        if self.exponent < 1:
            raise ValueError(f"Argument `exponent` must be at least 1, but it is {self.exponent}.")

    @property
    def switches(self) -> tuple[Switch, ...]:
        """The turning point, and the zero of the hysteretic state."""
        return velocity, _memory

    @no_type_check
    def force(self, t, x, v, z, s):
        """Force in N; see `Law.force`."""
        return self.stiffness * z[0]

    @no_type_check
    def rate(self, t, x, v, z, s):
        """Rate of the hysteretic displacement, m/s."""
        if self.exponent == 1:
            side, power = s[1], s[1] * z[0]
        else:
            side, power = (z[0] > 0) * 2.0 - 1.0, abs(z[0]) ** self.exponent
        return (v - (self.beta * s[0] * side + self.gamma) * v * power,)
