"""Broadband and transient tests: random-phase multisine, impulse, free decay."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ._force_pieces import Tones
from ._plan import Plan, Trial, roles
from ._shaker import Shaker


@dataclass(frozen=True)
class Multisine(Plan):
    """Random-phase multisines with a flat spectrum; each repeat has phases of its own.

    Args:
        levels: rms forces to fit, N.
        lowest: Hz.
        highest: Hz.
        period: s; the lines are multiples of 1 / period.
        periods: periods in a record; the first one is declared as settling.
        lines: "odd" takes odd multiples only, "full" all.
        repeats: realisations of each level.
        holdout_levels: rms forces that are held out, N.
        holdout_repeats: realisations of each held-out level.
    """

    levels: tuple[float, ...]
    lowest: float
    highest: float
    period: float = 8.0
    periods: int = 3
    lines: Literal["odd", "full"] = "odd"
    repeats: int = 1
    holdout_levels: tuple[float, ...] = ()
    holdout_repeats: int = 1

    def trials(self, shaker: Shaker, seed: int) -> tuple[Trial, ...]:
        """One trial for each level and realisation; the shaker follows the drive exactly."""
        orders = np.arange(math.ceil(self.lowest * self.period), math.floor(self.highest * self.period) + 1)
        orders = orders[orders % 2 == 1] if self.lines == "odd" else orders
        angular = tuple((2 * np.pi * orders / self.period).tolist())
        seconds = self.period * self.periods
        trials = []
        for role, level, repeats in roles(
            self.levels, self.repeats, self.holdout_levels, self.holdout_repeats
        ):
            amplitudes = (level * math.sqrt(2 / orders.size),) * orders.size
            for repeat in range(repeats):
                draw = np.random.default_rng([seed, 1, len(trials)])
                phases = tuple(draw.uniform(0, 2 * np.pi, orders.size).tolist())
                pieces = (Tones(0.0, seconds, 0.0, amplitudes, angular, phases),)
                trials.append(
                    Trial(
                        f"{role}_{level:g}N_multisine_{repeat}",
                        pieces,
                        seconds,
                        level,
                        "none",
                        repeat,
                        role,
                        period=self.period,
                        settle=self.period,
                    )
                )
        return tuple(trials)


@dataclass(frozen=True)
class Impulse(Plan):
    """Hammer blows: half-sine pulses on the plant at rest.

    Args:
        levels: peak forces to fit, N.
        width: of the pulse, s.
        seconds: length of a record; the blow falls a tenth of a second after its start.
        repeats: of each level.
        holdout_levels: peak forces that are held out, N.
        holdout_repeats: of each held-out level.
    """

    levels: tuple[float, ...]
    width: float = 0.05
    seconds: float = 5.0
    repeats: int = 1
    holdout_levels: tuple[float, ...] = ()
    holdout_repeats: int = 1

    def trials(self, shaker: Shaker, seed: int) -> tuple[Trial, ...]:
        """One trial for each level and repeat; nothing in it is random."""
        start, stop = 0.1, 0.1 + self.width
        trials = []
        for role, level, repeats in roles(
            self.levels, self.repeats, self.holdout_levels, self.holdout_repeats
        ):
            blow = Tones(start, stop, start, (level,), (math.pi / self.width,), (0.0,))
            pieces = (Tones(0.0, start), blow, Tones(stop, self.seconds))
            for repeat in range(repeats):
                name = f"{role}_{level:g}N_impulse_{repeat}"
                trials.append(Trial(name, pieces, self.seconds, level, "none", repeat, role))
        return tuple(trials)


@dataclass(frozen=True)
class FreeDecay(Plan):
    """Releases from a held displacement; a record starts `after` seconds after the release.

    Args:
        levels: displacements to fit, m.
        seconds: length of a record.
        after: s; long enough for the anti-alias filter not to see the release.
        repeats: of each level.
        holdout_levels: displacements that are held out, m.
        holdout_repeats: of each held-out level.
    """

    levels: tuple[float, ...]
    seconds: float = 5.0
    after: float = 0.1
    repeats: int = 1
    holdout_levels: tuple[float, ...] = ()
    holdout_repeats: int = 1

    def trials(self, shaker: Shaker, seed: int) -> tuple[Trial, ...]:
        """One trial for each level and repeat; nothing in it is random."""
        trials = []
        for role, level, repeats in roles(
            self.levels, self.repeats, self.holdout_levels, self.holdout_repeats
        ):
            pieces = (Tones(-self.after, self.seconds),)
            for repeat in range(repeats):
                name = f"{role}_{1e3 * level:g}mm_decay_{repeat}"
                trials.append(
                    Trial(name, pieces, self.seconds, level, "none", repeat, role, displacement=level)
                )
        return tuple(trials)
