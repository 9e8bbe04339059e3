"""Free gap."""

from typing import ClassVar

import jax
import jax.numpy as jnp

from .._parameters import parameter
from .._types import Internal, Lanes, Scalar
from . import _end_stop
from ._element import AbstractElement, Group, LookAlike, Scales


class Freeplay(AbstractElement):
    """Free gap in the spring: within it, part of the stiffness is missing.

    `-K clip(x, -g, g)` [N] beside the linear spring, which then has `k1 - K` within the gap and `k1 x
    -+ K g` beyond it; K = k1 is a gap without any spring. The corners are rounded: `clip` is `w ln[(1 + e^((x
    + g)/w)) / (1 + e^((x - g)/w))] - g`, with the declared regularising width w; records and orbits are
    split there instead.

    With a free linear spring it is exactly the class of the two-sided end stop, of equal K, g and w: `K x - K
    clip(x, -g, g)` is that stop, and the two linear springs differ by K. No record separates them; a look at
    the rig does, or the stiffness at motion smaller than the gap known beforehand.

    Attributes:
        lost_stiffness: K, missing within the gap [N/m].
        gap: g, half of the free way [m].
        width: w [m].

    Source: Tustin 1947, J. IEE 94 IIA:143 (backlash); Comparin & Singh 1989, J. Sound Vib. 134:259, with
    its describing function.
    """

    name: ClassVar[str] = "freeplay"
    words: ClassVar[str] = "free gap (freeplay)"
    strength: ClassVar[str] = "lost_stiffness"
    needs: ClassVar[tuple[str, ...]] = ("linear_stiffness",)
    substeps: ClassVar[int] = 4
    seldom: ClassVar[bool] = True
    group: ClassVar[Group] = "Springs"
    look_alikes: ClassVar[tuple[LookAlike, ...]] = (
        LookAlike(
            ("end_stop",),
            "look at the rig, or measure the linear stiffness at motion smaller than the gap: a stiffness "
            "added beyond a gap and one that is missing within it give the same records",
            exact=True,
            beside=("linear_stiffness",),
        ),
    )

    lost_stiffness: Scalar = parameter(symbol="K", unit="N/m", lower=0.0)
    gap: Scalar = parameter(symbol="g", unit="m", lower=0.0)
    width: Scalar = parameter(symbol="w", unit="m", lower=0.0, fitted=False)

    @classmethod
    def guess(cls, scales: Scales) -> "Freeplay":
        """See `AbstractElement.guess`: corners like those of an end stop, 0.5 % of the motion.

        The motion covers no more than two widths in an integration step; a corner spans about six.
        """
        return cls._placed(scales, 0.35)

    @classmethod
    def grid(cls, scales: Scales) -> "tuple[Freeplay, ...]":
        """See `AbstractElement.grid`: so dense that a gap between two of them looks much like one."""
        return tuple(cls._placed(scales, share) for share in GAPS)

    @classmethod
    def _placed(cls, scales: Scales, share: float) -> "Freeplay":
        """Give the absent effect with a gap of a share of the motion."""
        way = scales.velocity * scales.sample_time / cls.substeps
        width = max(0.005 * scales.displacement, 0.5 * way)
        return cls(0.0, share * scales.displacement, width)

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return scales.force / scales.displacement

    def twins(self) -> tuple[AbstractElement, ...]:
        """See `AbstractElement.twins`: the two-sided stop, whose linear spring is softer by K."""
        return (_end_stop.EndStop(self.lost_stiffness, self.gap, 0.0, self.width),)

    def force(self, x: Lanes, v: Lanes, s: Internal) -> Lanes:
        beyond = jax.nn.softplus((x + self.gap) / self.width) - jax.nn.softplus((x - self.gap) / self.width)
        return -self.lost_stiffness * (self.width * beyond - self.gap)

    def corners(self, x: Lanes, v: Lanes, s: Internal) -> tuple[Lanes, ...]:
        return x - self.gap, x + self.gap

    def sharp_force(
        self, x: Lanes, v: Lanes, s: Internal, direction: Lanes, sides: tuple[Lanes, ...]
    ) -> Lanes:
        clipped = jnp.where(sides[0] > 0.0, self.gap, jnp.where(sides[1] > 0.0, x, -self.gap))
        return -self.lost_stiffness * clipped


GAPS = (0.06, 0.1, 0.15, 0.22, 0.3, 0.4, 0.5, 0.6, 0.7, 0.85, 1.0, 1.2)
"""Gaps of the grid over the amplitude of the motion."""
