"""Gaps: springs with a corner where a stop is met or play is taken up."""

from dataclasses import dataclass
from typing import ClassVar, no_type_check

from ._law import Law, Switch


@dataclass(frozen=True)
class _Edge:
    """Zero where the plant passes a place, m."""

    place: float

    @no_type_check
    def __call__(self, x, v, z):
        return x - self.place


@dataclass(frozen=True)
class EndStop(Law):
    """Stop with a sharp corner: a spring of its own from the gap on.

    Args:
        stiffness: of the stop, N/m.
        gap: free way up to it, m.
        side: 0 a stop on either side, +1 on that of positive displacement alone, -1 on the other alone.

    Raises:
        ValueError: if `side` is none of these.
    """

    name: ClassVar[str] = "end_stop"
    stiffness: float
    gap: float
    side: float = 0.0

    def __post_init__(self) -> None:
        if self.side not in (-1.0, 0.0, 1.0):
            raise ValueError(f"Argument `side` must be -1, 0 or 1, but is {self.side}.")

    @property
    def switches(self) -> tuple[Switch, ...]:
        """The places of the two corners, met or not."""
        return _Edge(self.gap), _Edge(-self.gap)

    @no_type_check
    def force(self, t, x, v, z, s):
        """Force in N; see `Law.force`."""
        met_up = 0.5 * (1.0 + s[0]) if self.side >= 0 else 0.0
        met_down = 0.5 * (1.0 - s[1]) if self.side <= 0 else 0.0
        return self.stiffness * (met_up * (x - self.gap) + met_down * (x + self.gap))


@dataclass(frozen=True)
class Freeplay(Law):
    """Play in a spring of the plant: up to the gap its stiffness is missing, from there on its way.

    Args:
        stiffness: of the spring that has the play and that another law gives without it, N/m.
        gap: play to either side, m.
    """

    name: ClassVar[str] = "freeplay"
    stiffness: float
    gap: float

    @property
    def switches(self) -> tuple[Switch, ...]:
        """The two ends of the play."""
        return _Edge(self.gap), _Edge(-self.gap)

    @no_type_check
    def force(self, t, x, v, z, s):
        """Force in N; see `Law.force`."""
        beyond = 0.5 * (s[0] + s[1])
        taken = beyond * self.gap + (1.0 - beyond * beyond) * x
        return -self.stiffness * taken
