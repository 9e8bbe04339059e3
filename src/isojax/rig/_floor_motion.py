"""A floor that moves under the plant."""

import math
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import ClassVar, no_type_check

import numpy as np

from ._law import Law

_TONES = 60


@dataclass(frozen=True)
class FloorMotion(Law):
    """The floor moves at random: tones of equal size and random phase, one from each of 60 equal bands.

    Springs and dampers stand between the plant and the floor. The acceleration that reaches the plant is
    `transmission` times the one at the sensor on the floor. Displacement and velocity of the plant are
    counted from the floor, its acceleration is the absolute one.

    Args:
        transmission: over what the sensor on the floor shows.
        level: rms acceleration at the sensor, m/s^2.
        lowest: lowest frequency, Hz.
        highest: highest frequency, Hz.
        measured: whether the records hold what the sensor shows.
    """

    name: ClassVar[str] = "floor_motion"
    moves_floor: ClassVar[bool] = True
    transmission: float
    level: float
    lowest: float = 1.0
    highest: float = 20.0
    measured: bool = True
    _tones: tuple[tuple[float, float], ...] | None = field(default=None, repr=False)

    @no_type_check
    def placed(self, stretch, draw):
        """The floor in one record, where it moves as the record's random numbers say."""
        width = (self.highest - self.lowest) / _TONES
        frequency = self.lowest + width * (np.arange(_TONES) + draw.uniform(0, 1, _TONES))
        phase = draw.uniform(0, 2 * np.pi, _TONES)
        tones = zip((2 * np.pi * frequency).tolist(), phase.tolist(), strict=True)
        return replace(self, _tones=tuple(tones))

    @no_type_check
    def tones(self):
        """Amplitude at the sensor, m/s^2, angular frequency and phase of each cosine.

        Raises:
            ValueError: if the floor has no record that it moves in.
        """
        if self._tones is None:
            raise ValueError("A FloorMotion must be placed in a record before it moves; `rig.run` does that.")
        size = self.level * math.sqrt(2 / _TONES)
        return [(size, *tone) for tone in self._tones]

    @no_type_check
    def floor(self, t):
        """Acceleration under the plant, m/s^2."""
        return self.transmission * self._shown(t)

    @no_type_check
    def floor_sensor(self, t):
        """What the sensor shows, m/s^2; None where nothing is measured."""
        return self._shown(t) if self.measured else None

    @cached_property
    @no_type_check
    def _columns(self):
        """Amplitudes, angular frequencies and phases, an array each."""
        return tuple(np.array(self.tones()).T.copy())

    @no_type_check
    def _shown(self, t):
        if isinstance(t, np.ndarray):
            return sum((a * np.cos(w * t + p) for a, w, p in self.tones()), 0.0)
        # The integrator asks for one instant at a time: all tones at once take a quarter of one by one.
        size, angular, phase = self._columns
        return float(size.dot(np.cos(angular * t + phase)))

    @no_type_check
    def force(self, t, x, v, z, s):
        """No force: the floor acts through `floor`."""
        return 0.0
