"""The contract of a test plan: it lists the trials to run, in the order of the test."""

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from ._force_pieces import ForcePiece
from ._shaker import Shaker

Direction = Literal["forward", "backward", "none"]
Role = Literal["fit", "holdout"]


@dataclass(frozen=True)
class Trial:
    """One record to be made.

    Args:
        name: file stem.
        pieces: the force, from the moment the plant is let go.
        seconds: length of the record, which starts at time 0.
        level: N (m for a free decay).
        direction: of the frequency over time.
        repeat: number of the repeat, from 0.
        role: whether the record may be used to fit.
        displacement: at which the plant is let go, m.
        schedule: start in s, frequency in Hz and cycles of each dwell.
        period: of a periodic force, s.
        settle: at the start of the record, s.
        pressure: in the chamber, Pa; None where it is not recorded.
    """

    name: str
    pieces: tuple[ForcePiece, ...]
    seconds: float
    level: float
    direction: Direction
    repeat: int
    role: Role
    displacement: float = 0.0
    schedule: tuple[tuple[float, float, float], ...] = ()
    period: float | None = None
    settle: float = 0.0
    pressure: float | None = None


class Plan(ABC):
    """A family of trials."""

    @abstractmethod
    def trials(self, shaker: Shaker, seed: int) -> tuple[Trial, ...]:
        """The trials in the order of the test; `seed` draws whatever is random in the drive."""


def roles(
    levels: tuple[float, ...], repeats: int, holdout_levels: tuple[float, ...], holdout_repeats: int
) -> Iterator[tuple[Role, float, int]]:
    """Role, level and number of repeats: the levels to fit, then the levels to hold out."""
    for level in levels:
        yield "fit", level, repeats
    for level in holdout_levels:
        yield "holdout", level, holdout_repeats
