"""Fractional damping."""

import math
from typing import ClassVar

import jax.numpy as jnp

from .._parameters import parameter
from .._types import Internal, Lanes, Scalar
from ._element import AbstractElement, Group, LookAlike, Scales

BRANCHES = 6


class FractionalDamping(AbstractElement):
    """Fractional derivative of the displacement: loss and stiffness that rise with a power of frequency.

    `f = C D^alpha x`, `0 < alpha < 1`, of dynamic stiffness `C (i w)^alpha`. From

        (i w)^alpha = sin(pi alpha) / pi  integral of s^alpha  i w / (s + i w)  d(ln s),

    by the trapezoidal rule at equal steps h of ln s: Maxwell branches of rates `s_j` from `lowest` to
    `highest` and stiffnesses `C sin(pi alpha) / pi h s_j^alpha`. The nodes below act as a spring and those
    above as a dashpot; both are geometric series and are summed, so that alpha towards 0 is a spring and
    alpha towards 1 a damper. With the band that `guess` sets, from a fortieth of the excited frequency to
    twelve times it, the dynamic stiffness is right within 0.9 % from half to twice that frequency and within
    1.5 % over the decade about it (tests/elements/test_memory.py). More is stiffer than it is worth: the fast
    end limits the steps of a period.

    Attributes:
        coefficient: C [N s^alpha/m].
        order: alpha [1].
        lowest: rate of the slowest branch, declared [rad/s].
        highest: rate of the fastest branch, declared [rad/s].

    Source: Bagley & Torvik 1983, AIAA J. 21:741, for the law; Papoulia, Panoskaltsis, Kurup & Korovajchuk
        2010, Rheol. Acta 49:381, for the branches.
    """

    name: ClassVar[str] = "fractional_damping"
    words: ClassVar[str] = "fractional damping (rubber)"
    strength: ClassVar[str] = "coefficient"
    internal_states: ClassVar[int] = BRANCHES
    group: ClassVar[Group] = "Dampers"
    look_alikes: ClassVar[tuple[LookAlike, ...]] = (
        LookAlike(
            ("maxwell_branch", "dual_chamber"),
            "widen the band to more than a decade: rubber follows one power of frequency, a relaxation has "
            "one time constant",
        ),
    )

    coefficient: Scalar = parameter(symbol="C", unit="N s^alpha/m", lower=0.0)
    order: Scalar = parameter(symbol="alpha", unit="1", lower=0.02, upper=0.98)
    lowest: Scalar = parameter(symbol="wl", unit="rad/s", lower=0.0, fitted=False)
    highest: Scalar = parameter(symbol="wh", unit="rad/s", lower=0.0, fitted=False)

    @classmethod
    def guess(cls, scales: Scales) -> "FractionalDamping":
        return cls._of_order(scales, 0.4)

    @classmethod
    def grid(cls, scales: Scales) -> "tuple[FractionalDamping, ...]":
        """See `AbstractElement.grid`: from nearly elastic to nearly viscous."""
        return tuple(cls._of_order(scales, order) for order in (0.2, 0.4, 0.7))

    @classmethod
    def _of_order(cls, scales: Scales, order: float) -> "FractionalDamping":
        """Give the absent effect with its band about the excited one, no faster than steps of a sample take.

        The limit of the Runge-Kutta step is 2.78 decays a step; faster nodes belong to the dashpot.
        """
        highest = min(12.0 * scales.angular_frequency, 2.0 / scales.sample_time)
        return cls(0.0, order, scales.angular_frequency / 40.0, highest)

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return scales.force / (scales.displacement * math.sqrt(scales.angular_frequency))

    def _step(self) -> Lanes:
        return jnp.log(self.highest / self.lowest) / (BRANCHES - 1)

    def _rate_of(self, branch: int) -> Lanes:
        return self.lowest * jnp.exp(branch * self._step())

    def force(self, x: Lanes, v: Lanes, s: Internal) -> Lanes:
        step, alpha = self._step(), self.order
        total = self.lowest**alpha / jnp.expm1(alpha * step) * x
        total = total + self.highest ** (alpha - 1.0) / jnp.expm1((1.0 - alpha) * step) * v
        for branch, extension in enumerate(s):
            total = total + self._rate_of(branch) ** alpha * extension
        return self.coefficient * jnp.sin(jnp.pi * alpha) / jnp.pi * step * total

    def state_rate(self, x: Lanes, v: Lanes, s: Internal) -> Internal:
        return tuple(v - self._rate_of(branch) * extension for branch, extension in enumerate(s))
