"""Elastic laws: forces that depend on the displacement alone."""

from dataclasses import dataclass, replace
from typing import ClassVar, no_type_check

from ._law import Law, Switch, displacement


@dataclass(frozen=True)
class LinearStiffness(Law):
    """f = k1 x, with k1 in N/m."""

    name: ClassVar[str] = "linear_stiffness"
    coefficient: float

    @no_type_check
    def force(self, t, x, v, z, s):
        """Force in N; see `Law.force`."""
        return self.coefficient * x

    @no_type_check
    def drifted(self, scale):
        """The spring with its stiffness multiplied by `scale`."""
        return replace(self, coefficient=self.coefficient * scale)


@dataclass(frozen=True)
class AbsQuadraticStiffness(Law):
    """f = k2 |x| x, with k2 in N/m^2; kink in the second derivative at x = 0."""

    name: ClassVar[str] = "abs_quadratic_stiffness"
    coefficient: float

    @property
    def switches(self) -> tuple[Switch, ...]:
        """The centre."""
        return (displacement,)

    @no_type_check
    def force(self, t, x, v, z, s):
        """Force in N; see `Law.force`."""
        return self.coefficient * s[0] * x * x


@dataclass(frozen=True)
class CubicStiffness(Law):
    """f = k3 x^3, with k3 in N/m^3."""

    name: ClassVar[str] = "cubic_stiffness"
    coefficient: float

    @no_type_check
    def force(self, t, x, v, z, s):
        """Force in N; see `Law.force`."""
        return self.coefficient * x * x * x


@dataclass(frozen=True)
class QuadraticStiffness(Law):
    """f = q x^2, with q in N/m^2: an asymmetric spring."""

    name: ClassVar[str] = "quadratic_stiffness"
    coefficient: float

    @no_type_check
    def force(self, t, x, v, z, s):
        """Force in N; see `Law.force`."""
        return self.coefficient * x * x


@dataclass(frozen=True)
class QuinticStiffness(Law):
    """f = k5 x^5, with k5 in N/m^5."""

    name: ClassVar[str] = "quintic_stiffness"
    coefficient: float

    @no_type_check
    def force(self, t, x, v, z, s):
        """Force in N; see `Law.force`."""
        square = x * x
        return self.coefficient * square * square * x
