"""End stop."""

from typing import ClassVar

import jax
import jax.numpy as jnp

from .._parameters import parameter
from .._types import Internal, Lanes, Scalar
from ._element import AbstractElement, Group, Scales


class EndStop(AbstractElement):
    """End stop: a further spring that is met beyond a gap, on both sides or on one.

    `K [(1 + side) u(x - g) - (1 - side) u(-x - g)]` [N] with the rounded ramp `u(d) = w ln(1 + exp(d / w))`,
    which is max(d, 0) but for a corner of width w: a declared regularising width, not a physical number. The
    rounding of a corner of the stiffness k takes in `pi^2/12 k w^2` of energy on either side of it. Records
    and orbits are split at the corner and have the ramp itself. K is the mean of the two stops; with side = 0
    each has K, with side = +1 only positive displacement meets one, of 2 K. The side is fitted, for a search
    that starts on the wrong one must find its way.

    With a free linear spring a stop with side = 0 is exactly the class of a free gap: `K x - K clip(x, -g,
    g)` is this law, so that "K more beyond g" and "K less within g" differ by what is called the linear
    spring. A look at the rig separates them, or a linear spring that is known beforehand.

    Attributes:
        stiffness: K, mean of the two stops [N/m].
        gap: g, free way up to it [m].
        side: 0 alike on both sides, +1 met by positive displacement alone, -1 by negative alone [1].
        width: w [m].

    Source: Shaw & Holmes 1983, J. Sound Vib. 90:129, for the piecewise linear law.
    """

    name: ClassVar[str] = "end_stop"
    words: ClassVar[str] = "end stop"
    strength: ClassVar[str] = "stiffness"
    substeps: ClassVar[int] = 4
    group: ClassVar[Group] = "Springs"

    stiffness: Scalar = parameter(symbol="K", unit="N/m", lower=0.0)
    gap: Scalar = parameter(symbol="g", unit="m", lower=0.0)
    side: Scalar = parameter(symbol="side", unit="1", lower=-1.0, upper=1.0)
    width: Scalar = parameter(symbol="w", unit="m", lower=0.0, fitted=False)

    @classmethod
    def guess(cls, scales: Scales) -> "EndStop":
        """See `AbstractElement.guess`: a corner of 0.5 % of the motion, but one that steps resolve.

        The motion covers no more than two widths in an integration step; the corner spans about six.
        """
        return cls._placed(scales, 0.7, 0.0)

    @classmethod
    def grid(cls, scales: Scales) -> "tuple[EndStop, ...]":
        """See `AbstractElement.grid`: from met by all but small motion to met by its peaks alone.

        So dense that a gap between two of them looks much like one. A start on one side leaves a little of
        the other, for at the very bound nothing would move.
        """
        return tuple(cls._placed(scales, share, side) for side in (0.0, 0.8, -0.8) for share in GAPS)

    @classmethod
    def _placed(cls, scales: Scales, share: float, side: float) -> "EndStop":
        """Give the absent effect with a gap of a share of the motion."""
        way = scales.velocity * scales.sample_time / cls.substeps
        width = max(0.005 * scales.displacement, 0.5 * way)
        return cls(0.0, share * scales.displacement, side, width)

    @classmethod
    def typical_strength(cls, scales: Scales) -> float:
        return scales.force / scales.displacement

    def force(self, x: Lanes, v: Lanes, s: Internal) -> Lanes:
        above = self.width * jax.nn.softplus((x - self.gap) / self.width)
        below = self.width * jax.nn.softplus((-x - self.gap) / self.width)
        return self.stiffness * ((1.0 + self.side) * above - (1.0 - self.side) * below)

    def corners(self, x: Lanes, v: Lanes, s: Internal) -> tuple[Lanes, ...]:
        return x - self.gap, -x - self.gap

    def sharp_force(
        self, x: Lanes, v: Lanes, s: Internal, direction: Lanes, sides: tuple[Lanes, ...]
    ) -> Lanes:
        above = jnp.where(sides[0] > 0.0, x - self.gap, 0.0)
        below = jnp.where(sides[1] > 0.0, -x - self.gap, 0.0)
        return self.stiffness * ((1.0 + self.side) * above - (1.0 - self.side) * below)


GAPS = (0.3, 0.4, 0.5, 0.6, 0.7, 0.85, 1.0, 1.2)
"""Gaps of the grid over the amplitude of the motion."""
