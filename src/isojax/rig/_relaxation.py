"""Relaxation: a spring in series with a dashpot."""

from dataclasses import dataclass
from typing import ClassVar, no_type_check

from ._law import Law


@dataclass(frozen=True)
class MaxwellBranch(Law):
    """Maxwell branch beside the isolator: p' = v - p / tau, f = K p.

    Args:
        stiffness: K, N/m.
        time_constant: tau, s.
    """

    name: ClassVar[str] = "maxwell_branch"
    inner: ClassVar[int] = 1
    stiffness: float
    time_constant: float

    @no_type_check
    def force(self, t, x, v, z, s):
        """Force in N; see `Law.force`."""
        return self.stiffness * z[0]

    @no_type_check
    def rate(self, t, x, v, z, s):
        """Rate of the spring's extension, m/s."""
        return (v - z[0] / self.time_constant,)
