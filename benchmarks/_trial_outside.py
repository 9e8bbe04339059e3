"""Force laws that the catalogue lacks, for the blind trial: none may be passed off as a known effect."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, no_type_check

import numpy as np

from _trial_effects import Motion, log_uniform
from isojax.rig import Law


@no_type_check
def _velocity(x, v, z):
    return v


@no_type_check
def _forward(x, v, z):
    return x


@dataclass(frozen=True)
class Detent(Law):
    """Magnets along the path: f = A sin(x / l)."""

    name: ClassVar[str] = "detent"
    force_level: float
    length: float

    @no_type_check
    def force(self, t, x, v, z, s):
        """Force in N; see `Law.force`."""
        return self.force_level * np.sin(x / self.length)


@dataclass(frozen=True)
class WedgeFriction(Law):
    """Friction that grows with the way from the centre: f = A |x / l|^1.5 sign(v), without stiction."""

    name: ClassVar[str] = "wedge_friction"
    force_level: float
    length: float

    @property
    def switches(self):
        """The turning point."""
        return (_velocity,)

    @no_type_check
    def force(self, t, x, v, z, s):
        """Force in N; see `Law.force`."""
        return self.force_level * abs(x / self.length) ** 1.5 * s[0]


@dataclass(frozen=True)
class PressureRipple(Law):
    """Supply pressure that pulsates: f = k x cos(w t + p)."""

    name: ClassVar[str] = "pressure_ripple"
    stiffness: float
    angular: float
    phase: float

    @no_type_check
    def force(self, t, x, v, z, s):
        """Force in N; see `Law.force`."""
        return self.stiffness * x * np.cos(self.angular * t + self.phase)


@dataclass(frozen=True)
class CheckValve(Law):
    """Flow that is throttled one way only: f = c v^2 for v > 0."""

    name: ClassVar[str] = "check_valve"
    coefficient: float

    @property
    def switches(self):
        """The turning point."""
        return (_velocity,)

    @no_type_check
    def force(self, t, x, v, z, s):
        """Force in N; see `Law.force`."""
        return 0.5 * (1.0 + s[0]) * self.coefficient * v * v


@dataclass(frozen=True)
class Linkage(Law):
    """Centrifugal force of a linkage: f = a x v^2."""

    name: ClassVar[str] = "linkage"
    coefficient: float

    @no_type_check
    def force(self, t, x, v, z, s):
        """Force in N; see `Law.force`."""
        return self.coefficient * x * v * v


@dataclass(frozen=True)
class Machine(Law):
    """A machine on the same floor: f = A sin(w t + p), which no channel records."""

    name: ClassVar[str] = "machine"
    force_level: float
    angular: float
    phase: float

    @no_type_check
    def force(self, t, x, v, z, s):
        """Force in N; see `Law.force`."""
        return self.force_level * np.sin(self.angular * t + self.phase)


@dataclass(frozen=True)
class OneSidedFriction(Law):
    """A seal that drags on one side of the centre only: f = A sign(v) x / l for x > 0, without stiction."""

    name: ClassVar[str] = "one_sided_friction"
    force_level: float
    length: float

    @property
    def switches(self):
        """The turning point and the centre."""
        return (_velocity, _forward)

    @no_type_check
    def force(self, t, x, v, z, s):
        """Force in N; see `Law.force`."""
        return 0.5 * (1.0 + s[1]) * self.force_level * x / self.length * s[0]


OUTSIDE: dict[str, Callable[[np.random.Generator, Motion, float], Law]] = {
    "detent": lambda draw, motion, force: Detent(force, motion.displacement * log_uniform(draw, 0.1, 0.3)),
    "wedge_friction": lambda draw, motion, force: WedgeFriction(force, motion.displacement),
    "pressure_ripple": lambda draw, motion, force: PressureRipple(
        force / motion.displacement,
        2.0 * math.pi * float(draw.uniform(0.3, 1.7)),
        float(draw.uniform(0.0, 2.0 * math.pi)),
    ),
    "check_valve": lambda draw, motion, force: CheckValve(
        force / (motion.displacement * motion.angular) ** 2
    ),
    "linkage": lambda draw, motion, force: Linkage(
        float(draw.choice([-1.0, 1.0])) * 3.0 * force / (motion.displacement**3 * motion.angular**2)
    ),
    "machine": lambda draw, motion, force: Machine(
        force, 2.0 * math.pi * float(draw.uniform(7.5, 22.0)), float(draw.uniform(0.0, 2.0 * math.pi))
    ),
    "one_sided_friction": lambda draw, motion, force: OneSidedFriction(force, motion.displacement),
}
"""Laws by name: (random numbers, motion without the law, largest force in N) gives the law."""
