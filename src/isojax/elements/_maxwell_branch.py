"""Maxwell branch: relaxation."""

from typing import ClassVar

from .._parameters import parameter
from .._types import Internal, Lanes, Scalar
from ._element import AbstractElement, Group, Scales


class MaxwellBranch(AbstractElement):
    """A spring in series with a damper: stiffness that relaxes (second chamber, rubber).

    `f = K p`, `p' = v - p / tau`; adds `K (w tau)^2 / (1 + (w tau)^2)` to the stiffness and
    `K tau / (1 + (w tau)^2)` to the damping, at every amplitude alike.

    Attributes:
        stiffness: K [N/m].
        time_constant: tau [s].

    Source: Maxwell 1867; Pelz & Buttenbender 2004 for the two-chamber air spring that it stands for.
    """

    name: ClassVar[str] = "maxwell_branch"
    words: ClassVar[str] = "relaxation (Maxwell branch)"
    strength: ClassVar[str] = "stiffness"
    internal_states: ClassVar[int] = 1
    group: ClassVar[Group] = "Relaxation and further masses"

    stiffness: Scalar = parameter(symbol="K", unit="N/m", lower=0.0)
    time_constant: Scalar = parameter(symbol="tau", unit="s", lower=0.0)

    @classmethod
    def guess(cls, scales: Scales) -> "MaxwellBranch":
        return cls(0.0, 1.0 / scales.angular_frequency)

    @classmethod
    def grid(cls, scales: Scales) -> "tuple[MaxwellBranch, ...]":
        """See `AbstractElement.grid`: time constants on both sides of the excited band."""
        return tuple(cls(0.0, share / scales.angular_frequency) for share in (0.2, 0.5, 1.0, 2.0, 5.0))

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return scales.force / scales.displacement

    def force(self, x: Lanes, v: Lanes, s: Internal) -> Lanes:
        return self.stiffness * s[0]

    def state_rate(self, x: Lanes, v: Lanes, s: Internal) -> Internal:
        return (v - s[0] / self.time_constant,)
