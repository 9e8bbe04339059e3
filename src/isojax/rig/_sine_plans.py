"""Sine tests: stepped and swept, up and down in frequency."""

from dataclasses import dataclass

import numpy as np

from ._plan import Direction, Plan, Trial, roles
from ._shaker import Shaker


@dataclass(frozen=True)
class SteppedSine(Plan):
    """Dwells of whole cycles, one after the other without a pause, so that the phase is continuous.

    Args:
        levels: force amplitudes to fit, N.
        frequencies: of the forward direction, Hz.
        cycles: whole cycles of each dwell.
        directions: "forward" takes the frequencies as they come, "backward" the other way round.
        repeats: of each level and direction.
        holdout_levels: force amplitudes that are held out, N.
        holdout_repeats: of each held-out level and direction.
    """

    levels: tuple[float, ...]
    frequencies: tuple[float, ...]
    cycles: int = 20
    directions: tuple[Direction, ...] = ("forward", "backward")
    repeats: int = 1
    holdout_levels: tuple[float, ...] = ()
    holdout_repeats: int = 1

    def trials(self, shaker: Shaker, seed: int) -> tuple[Trial, ...]:
        """One trial for each level, direction and repeat; nothing in it is random."""
        trials = []
        for role, level, repeats in roles(
            self.levels, self.repeats, self.holdout_levels, self.holdout_repeats
        ):
            for direction in self.directions:
                frequencies = self.frequencies if direction != "backward" else self.frequencies[::-1]
                edges = np.concatenate([[0.0], np.cumsum([self.cycles / f for f in frequencies])]).tolist()
                pieces = tuple(
                    shaker.sine(level, f, start, stop)
                    for f, start, stop in zip(frequencies, edges[:-1], edges[1:], strict=True)
                )
                schedule = tuple(
                    (start, float(f), float(self.cycles))
                    for f, start in zip(frequencies, edges[:-1], strict=True)
                )
                for repeat in range(repeats):
                    name = f"{role}_{level:g}N_{direction}_{repeat}"
                    trials.append(
                        Trial(name, pieces, edges[-1], level, direction, repeat, role, schedule=schedule)
                    )
        return tuple(trials)


@dataclass(frozen=True)
class SweptSine(Plan):
    """Linear sweeps.

    Args:
        levels: force amplitudes to fit, N.
        lowest: Hz.
        highest: Hz.
        rate: Hz/s, positive; "backward" sweeps run from the highest frequency down.
        directions: of the sweeps.
        repeats: of each level and direction.
        holdout_levels: force amplitudes that are held out, N.
        holdout_repeats: of each held-out level and direction.
    """

    levels: tuple[float, ...]
    lowest: float
    highest: float
    rate: float = 0.05
    directions: tuple[Direction, ...] = ("forward", "backward")
    repeats: int = 1
    holdout_levels: tuple[float, ...] = ()
    holdout_repeats: int = 1

    def trials(self, shaker: Shaker, seed: int) -> tuple[Trial, ...]:
        """One trial for each level, direction and repeat; nothing in it is random."""
        seconds = (self.highest - self.lowest) / self.rate
        trials = []
        for role, level, repeats in roles(
            self.levels, self.repeats, self.holdout_levels, self.holdout_repeats
        ):
            for direction in self.directions:
                first, rate = (
                    (self.highest, -self.rate) if direction == "backward" else (self.lowest, self.rate)
                )
                pieces = (shaker.sweep(level, first, rate, 0.0, seconds),)
                for repeat in range(repeats):
                    name = f"{role}_{level:g}N_sweep_{direction}_{repeat}"
                    trials.append(Trial(name, pieces, seconds, level, direction, repeat, role))
        return tuple(trials)
