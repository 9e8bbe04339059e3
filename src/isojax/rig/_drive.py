"""Drives that are not what their record says: with harmonics of their own, or held between samples."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

from ._force_pieces import ForcePiece, Line
from ._instruments import Instrument


@dataclass(frozen=True)
class DriveHarmonics(Instrument):
    """The acting force holds one harmonic more than the recorded one, whose fundamental is A cos(theta).

    It is share A cos(order theta + phase).

    Args:
        share: of the fundamental.
        phase: rad.
        order: of the harmonic.
    """

    name: ClassVar[str] = "drive_harmonics"
    share: float
    phase: float = 0.0
    order: float = 3.0

    def acting(self, pieces: Sequence[ForcePiece], rate: float) -> Sequence[ForcePiece]:
        """The pieces with one more harmonic each; see `ForcePiece.with_harmonic`."""
        return [piece.with_harmonic(round(self.order), self.share, self.phase) for piece in pieces]


@dataclass(frozen=True)
class InputHold(Instrument):
    """The acting force runs from sample to sample of the recorded one, which is band-limited.

    Args:
        order: 0 to hold each sample until the next one, 1 to run straight to the next one.
    """

    name: ClassVar[str] = "input_hold"
    order: float = 0.0

    def acting(self, pieces: Sequence[ForcePiece], rate: float) -> Sequence[ForcePiece]:
        """One line a sample; samples fall on multiples of 1 / rate."""
        held: list[ForcePiece] = []
        place, last = 0, pieces[-1]
        first = math.floor(pieces[0].start * rate)
        values: list[float] = []
        for number in range(first, math.ceil(last.stop * rate) + 1):
            instant = number / rate
            while place < len(pieces) - 1 and instant >= pieces[place].stop:
                place += 1
            inside = pieces[place].start <= instant < last.stop
            force: Any = pieces[place].force(instant) if inside else 0.0
            values.append(float(force))
        for step, (value, following) in enumerate(itertools.pairwise(values)):
            start = max((first + step) / rate, pieces[0].start)
            stop = min((first + step + 1) / rate, last.stop)
            slope = (following - value) * rate if self.order else 0.0
            if stop > start:
                held.append(Line(start, stop, (first + step) / rate, value, slope))
        return held
