"""Second mode: a mass on a spring, carried along."""

import math
from typing import ClassVar

from .._parameters import parameter
from .._types import Internal, Lanes, Scalar
from ._element import AbstractElement, Group, LookAlike, Scales


class SecondMode(AbstractElement):
    """A mass on a spring and damper of its own, carried by the isolated mass: a notch and a second peak.

    `x2'' = -w2^2 (x2 - x) - 2 zeta w2 (x2' - v)`, `f = m2 (w2^2 (x - x2) + 2 zeta w2 (v - x2'))`. The states
    are x2 and x2' in the coordinate of the isolator, so that no acceleration is needed; under base excitation
    that coordinate moves with the base, and the attached mass feels the base's acceleration as well. The mass
    m2 is in addition to the isolator's; far above the band it acts as added mass.

    Attributes:
        mass: m2 [kg].
        angular_frequency: w2, of the attached mass with the isolator held [rad/s].
        damping_ratio: zeta [1].

    Source: Den Hartog 1956, Mechanical Vibrations, sec. 3.2.
    """

    name: ClassVar[str] = "second_mode"
    words: ClassVar[str] = "second mode (attached mass on a spring)"
    strength: ClassVar[str] = "mass"
    internal_states: ClassVar[int] = 2
    group: ClassVar[Group] = "Relaxation and further masses"
    look_alikes: ClassVar[tuple[LookAlike, ...]] = (
        LookAlike(
            ("added_mass",),
            "extend the band upwards: a second mode ends in a notch, while a mass goes on with the square "
            "of the frequency",
        ),
    )

    mass: Scalar = parameter(symbol="m2", unit="kg", lower=0.0)
    angular_frequency: Scalar = parameter(symbol="w2", unit="rad/s", lower=0.0)
    damping_ratio: Scalar = parameter(symbol="zeta2", unit="1", lower=0.0)

    @classmethod
    def guess(cls, scales: Scales) -> "SecondMode":
        return cls(0.0, 1.3 * scales.angular_frequency, 0.05)

    @classmethod
    def grid(cls, scales: Scales) -> "tuple[SecondMode, ...]":
        """See `AbstractElement.grid`: within the band and beside it, wide enough that no mode falls between.

        No mode is so fast that steps of a sample no longer follow it.
        """
        fastest = 0.5 / scales.sample_time
        shares = {min(share, fastest / scales.angular_frequency): None for share in NATURAL}
        return tuple(cls(0.0, share * scales.angular_frequency, 0.06) for share in shares)

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return scales.mass

    def frequency(self) -> float:
        """Give the natural frequency of the attached mass with the isolator held [Hz]."""
        return float(self.angular_frequency) / (2.0 * math.pi)

    def force(self, x: Lanes, v: Lanes, s: Internal) -> Lanes:
        return self.mass * self._acceleration(x, v, s)

    def state_rate(self, x: Lanes, v: Lanes, s: Internal) -> Internal:
        return s[1], self._acceleration(x, v, s)

    def base_rate(self, a: Lanes, s: Internal) -> Internal:
        return 0.0 * s[0], 0.0 * s[1] - a

    def _acceleration(self, x: Lanes, v: Lanes, s: Internal) -> Lanes:
        w2 = self.angular_frequency
        return w2 * w2 * (x - s[0]) + 2.0 * self.damping_ratio * w2 * (v - s[1])


NATURAL = (0.5, 0.7, 0.78, 0.84, 0.9, 0.96, 1.03, 1.1, 1.18, 1.27, 1.4, 1.7, 2.5)
"""Natural frequencies of the grid over the centre of the excited band."""
