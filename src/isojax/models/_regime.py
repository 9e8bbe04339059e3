"""Which piece of each sharp law acts."""

from typing import NamedTuple

from jaxtyping import Array, Bool

from .._types import Lanes


class Regime(NamedTuple):
    """Where a motion stands among the pieces of laws that jump or bend.

    Attributes:
        direction: +1 or -1, that of the sliding; 0 where dry friction holds the mass.
        corners: +1 or -1, side of each of the isolator's corners.
    """

    direction: Lanes
    corners: tuple[Lanes, ...]

    @property
    def is_held(self) -> Bool[Array, "..."]:
        """Whether dry friction holds the mass: displacement and velocity then stay."""
        return self.direction == 0.0
