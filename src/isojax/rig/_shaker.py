"""The inertial shaker: what force it makes of a commanded sine."""

import math
from dataclasses import dataclass

from ._force_pieces import Chirp, Tones


@dataclass(frozen=True)
class Shaker:
    """A shaker with harmonic distortion whose force drops out near the resonance of the plant.

    The fundamental is level x (1 - dropout exp(-((f - dropout_frequency) / dropout_width)^2)); the harmonics
    are fixed shares of it.

    Args:
        second: second harmonic over the fundamental.
        second_phase: rad.
        third: third harmonic over the fundamental.
        third_phase: rad.
        dropout: largest share of the level that is lost.
        dropout_frequency: Hz.
        dropout_width: Hz.
    """

    second: float = 0.01
    second_phase: float = 0.7
    third: float = 0.006
    third_phase: float = 1.9
    dropout: float = 0.12
    dropout_frequency: float = 5.2
    dropout_width: float = 0.5

    @property
    def harmonics(self) -> tuple[tuple[int, float, float], ...]:
        """Order, ratio and phase of each harmonic that the shaker adds."""
        both = ((2, self.second, self.second_phase), (3, self.third, self.third_phase))
        return tuple(harmonic for harmonic in both if harmonic[1] != 0)

    def sine(self, level: float, frequency: float, start: float, stop: float) -> Tones:
        """Force of one dwell whose phase is 0 at its start (level in N, frequency in Hz, times in s)."""
        away = (frequency - self.dropout_frequency) / self.dropout_width
        amplitude = level * (1 - self.dropout * math.exp(-away * away))
        angular = 2 * math.pi * frequency
        return Tones(
            start,
            stop,
            start,
            (amplitude, *(ratio * amplitude for _, ratio, _ in self.harmonics)),
            (angular, *(order * angular for order, _, _ in self.harmonics)),
            (0.0, *(phase for _, _, phase in self.harmonics)),
        )

    def sweep(self, level: float, frequency: float, rate: float, start: float, stop: float) -> Chirp:
        """Force of a linear sweep (level in N, first frequency in Hz, rate in Hz/s, times in s)."""
        dip = (self.dropout, self.dropout_frequency, self.dropout_width)
        return Chirp(start, stop, start, frequency, rate, level, self.harmonics, dip)


EXAMPLE_SHAKER = Shaker()
"""The shaker of the project's example campaigns."""

IDEAL_SHAKER = Shaker(second=0.0, third=0.0, dropout=0.0)
"""A shaker that delivers the commanded force."""
