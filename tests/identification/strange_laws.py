"""Laws of which the catalogue knows nothing, for the rig."""

import bisect
from dataclasses import dataclass, replace
from typing import ClassVar, no_type_check

import numpy as np

from isojax import rig

BASE = rig.base_laws(1.0805e6, -6.974e8, 2.51667e11, 1.027e4, -3.688e5, 5.3753e6)


@no_type_check
def _centre(x, v, z):
    return x


@no_type_check
def _turning(x, v, z):
    return v


@dataclass(frozen=True)
class Grip(rig.Law):
    """Damping that grows away from the centre: f = c |x| v."""

    name: ClassVar[str] = "grip"
    coefficient: float

    @property
    def switches(self):
        """The centre."""
        return (_centre,)

    @no_type_check
    def force(self, t, x, v, z, s):
        """Force in N; see `Law.force`."""
        return self.coefficient * s[0] * x * v


@dataclass(frozen=True)
class Governor(rig.Law):
    """A spring that stiffens with the speed: f = c x |v|."""

    name: ClassVar[str] = "governor"
    coefficient: float

    @property
    def switches(self):
        """The turning point."""
        return (_turning,)

    @no_type_check
    def force(self, t, x, v, z, s):
        """Force in N; see `Law.force`."""
        return self.coefficient * x * s[0] * v


@dataclass(frozen=True)
class Machine(rig.Law):
    """A machine on the same floor: f = A sin(w t), which no channel records."""

    name: ClassVar[str] = "machine"
    size: float
    angular: float

    @no_type_check
    def force(self, t, x, v, z, s):
        """Force in N; see `Law.force`."""
        return self.size * np.sin(self.angular * t)


@dataclass(frozen=True)
class RestlessSpring(rig.Law):
    """A spring that is another in each dwell: f = k d x, with a d of its own for each stretch of a record.

    Args:
        stiffness: k, N/m.
        spread: standard deviation of d.
        edges: for each record the share of the test at which it begins, and where its dwells begin, s.
        deviations: d of the record's dwells; drawn when the law is placed.
    """

    name: ClassVar[str] = "restless_spring"
    stiffness: float
    spread: float
    edges: tuple[tuple[float, tuple[float, ...]], ...]
    starts: tuple[float, ...] = ()
    deviations: tuple[float, ...] = ()

    @classmethod
    def of(cls, plan, stiffness, spread, seed, bench):
        """The spring in the dwells of a plan."""
        trials = plan.trials(bench.shaker, seed)
        ends = np.cumsum([0.0, *(trial.seconds for trial in trials)])
        shares = (ends / ends[-1]).tolist()
        edges = tuple(
            (share, tuple(start for start, _, _ in trial.schedule))
            for share, trial in zip(shares, trials, strict=False)
        )
        return cls(stiffness, spread, edges)

    @no_type_check
    def placed(self, stretch, draw):
        """The spring in one record."""
        starts = next(starts for share, starts in self.edges if abs(share - stretch.begin) < 1e-12)
        drawn = self.spread * draw.standard_normal(len(starts))
        return replace(self, starts=starts, deviations=tuple(drawn.tolist()))

    @no_type_check
    def force(self, t, x, v, z, s):
        """Force in N; see `Law.force`."""
        if not isinstance(t, np.ndarray):
            return self.stiffness * self.deviations[max(bisect.bisect_right(self.starts, t) - 1, 0)] * x
        place = np.clip(np.searchsorted(self.starts, t, side="right") - 1, 0, len(self.starts) - 1)
        return self.stiffness * np.asarray(self.deviations)[place] * x


@dataclass(frozen=True)
class Detent(rig.Law):
    """Magnets along the path: f = A sin(x / l)."""

    name: ClassVar[str] = "detent"
    force_level: float
    length: float

    @no_type_check
    def force(self, t, x, v, z, s):
        """Force in N; see `Law.force`."""
        return self.force_level * np.sin(x / self.length)
