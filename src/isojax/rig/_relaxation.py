"""Relaxation: a spring in series with a dashpot, and a whole spectrum of them."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, no_type_check

import numpy as np

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


@dataclass(frozen=True)
class FractionalDamping(Law):
    """Fractional derivative of the displacement: f = C D^alpha x.

    From (i w)^alpha = sin(pi alpha)/pi times the integral of s^(alpha-1) i w / (s + i w) over all relaxation
    rates s: Gauss-Legendre nodes in ln s from 0.02 to 600 rad/s, and for each end what has the same first two
    terms as the integral beyond it: a branch for the slow one, a dashpot and a (negative) mass for the fast
    one, whose branch would only make the equations stiff. Good to 2e-3 from 0.3 to 20 Hz
    (tests/rig/test_rig_memory.py).

    Args:
        coefficient: C, N s^alpha/m.
        order: alpha, between 0 and 1.
    """

    name: ClassVar[str] = "fractional_damping"
    inner: ClassVar[int] = 13
    coefficient: float
    order: float

    @cached_property
    def _spectrum(self) -> tuple[list[float], list[float], float, float]:
        """Rates, 1/s, and stiffnesses, N/m, of the branches; dashpot, N s/m, and mass, kg, of the end."""
        lowest, highest, order = 0.02, 600.0, self.order
        middle, reach = 0.5 * math.log(highest * lowest), 0.5 * math.log(highest / lowest)
        nodes, weights = np.polynomial.legendre.leggauss(self.inner - 1)
        whole = self.coefficient * math.sin(math.pi * order) / math.pi
        rates = np.exp(middle + reach * nodes)
        slow, fast = lowest * order / (1 + order), highest * (2 - order) / (1 - order)
        dashpot = whole * highest ** (order - 1) / (1 - order)
        shares = whole * reach * weights * rates**order
        return (
            [slow, *rates.tolist()],
            [whole * lowest**order / order, *shares.tolist()],
            dashpot,
            -dashpot / fast,
        )

    @property
    def inertia(self) -> float:
        """Mass that stands for the second term of the fast end, kg."""
        return self._spectrum[3]

    @no_type_check
    def force(self, t, x, v, z, s):
        """Force in N; see `Law.force`."""
        _, shares, dashpot, _ = self._spectrum
        return dashpot * v + sum(share * extension for share, extension in zip(shares, z, strict=True))

    @no_type_check
    def rate(self, t, x, v, z, s):
        """Rates of the springs' extensions, m/s."""
        return tuple(v - rate * extension for rate, extension in zip(self._spectrum[0], z, strict=True))
