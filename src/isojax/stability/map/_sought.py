"""Which orbits a map is to hold, and by what each is found: read off the surface, or by Newton's method."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool

from ...models import Integrator, Isolator
from ._batched_newton import SAMPLED, CellSolver, cell_solvers, lanes_of
from ._map_error import sampled_error, solved_sample
from ._map_method import MapMethod
from ._reader import SurfaceReader
from ._single_orbits import SingleOrbits
from ._starts import Candidates, find_candidates
from ._surface import MapWindow, Surface, find_surface

_POOL = 1 << 15
"""Orbits among which those of a sample are chosen."""

_KNOWN_TO, _KNOWN_SHARE = 1e-3, 0.1
"""Error of multipliers up to which a surface does for the chances of a map; the same as a share of what
multipliers are away from where an orbit changes its stability."""


class MapRun(NamedTuple):
    """How a map is made; see the arguments of `stability_map`."""

    coexisting: bool
    integrator: Integrator | None
    chunk: int
    folder: Path | None
    progress: Callable[[str], None] | None
    devices: Any


class Group(NamedTuple):
    """Orbits that are found in the same way.

    Attributes:
        name: "read" off the surface; by Newton's method, "split" at kinks or "whole"; or "single" orbits.
        solver: what finds them.
        candidates: the orbits.
    """

    name: str
    solver: CellSolver | SurfaceReader | SingleOrbits
    candidates: Candidates


class Sought(NamedTuple):
    """What is to be found.

    Attributes:
        surface: orbits over displacement and frequency.
        groups: all orbits, by how they are found; none is empty.
        reading_error: largest error of multipliers read off in a sample of cells, also where it is too large
            for any to be read off; NaN without a sample.
        tabled: whether the invariants of the surface give all multipliers, and it has no steps.
    """

    surface: Surface
    groups: tuple[Group, ...]
    reading_error: float
    tabled: bool

    @property
    def reads(self) -> bool:
        """Whether any orbits are read off the surface."""
        return any(group.name == "read" for group in self.groups)

    @property
    def known_parts(self) -> Bool[np.ndarray, "frequency part"]:
        """Whether the surface says well enough of the orbits of a part how probable they are."""
        column, part = np.indices(self.surface.error.shape)
        distance = self.surface.distance(column.ravel(), part.ravel()).reshape(column.shape)
        enough = np.maximum(_KNOWN_TO, _KNOWN_SHARE * distance)
        # Where the size of a motion cannot be read off it has several maxima, and as many places there.
        return self.tabled & self.surface.sized & (self.surface.error <= enough)

    @property
    def known_columns(self) -> Bool[np.ndarray, " frequency"]:
        """Whether the surface says so of every orbit of a frequency."""
        columns, known = np.full(len(self.surface.frequencies), self.tabled), self.known_parts
        for _, _, candidates in self.groups:
            columns[candidates.frequency[~known[candidates.frequency, candidates.part]]] = False
        return columns

    def with_steps(self, steps: int) -> "Sought":
        """Give the same with other steps a period of Newton's method.

        Args:
            steps: of orbits that are split; the others take four times as many.

        Returns:
            What is to be found.
        """
        groups = tuple(
            Group(name, solver.with_steps(steps) if isinstance(solver, CellSolver) else solver, candidates)
            for name, solver, candidates in self.groups
        )
        return self._replace(groups=groups)


def seek(
    model: Isolator,
    integrator: Integrator,
    half: bool,
    window: MapWindow,
    goal: float,
    run: MapRun,
    start_steps: int,
) -> Sought:
    """Find which orbits a window of force and frequency holds, and by what each is to be found.

    Orbits are read off the surface where its nodes say that this is exact enough, and only if a sample of
    them then agrees with Newton's method and steps several times finer.

    Args:
        model: the isolator.
        integrator: steps a period.
        half: whether to use the half-period map.
        window: of the map.
        goal: error of multipliers read off down to which nodes are added.
        run: how the map is made.
        start_steps: most steps a period of the orbits from which the others start.

    Returns:
        What is to be found.

    Raises:
        ValueError: if there is no orbit anywhere.
    """
    surface = find_surface(model, integrator, half, window, goal, start_steps)
    candidates = find_candidates(surface, window.amplitudes, run.coexisting)
    if not candidates.force.size:
        raise ValueError("No orbit was found anywhere in the window. Widen `amplitudes` or `frequencies`.")
    split, whole = cell_solvers(model, integrator, half, surface, window.amplitudes, run.devices)
    reader = SurfaceReader(half, split.surface, split.sharding)
    unsplit = MapMethod(integrator, half, None, split.method.steps)
    single = SingleOrbits(model, unsplit, split.surface, split.sharding)
    judge = single if model.slides else split
    expected = surface.error[candidates.frequency, candidates.part]
    # Under harmonics of the drive another of several maxima becomes the largest. The surface has a step
    # there, gives starts that may be no maxima, and neither the numbers nor the order of kinks of the orbit.
    tabled = model.internal_states == 0 and not model.harmonics
    read, error = np.full(expected.shape, tabled), math.nan
    read &= expected <= integrator.map_error
    if read.any():
        places = _sample(surface, candidates, np.flatnonzero(read))
        some = _chosen(candidates, places)
        # In the lanes of the map, which then compiles nothing more.
        by_reading = reader(some, max(lanes_of(int(np.count_nonzero(read)), run.chunk), SAMPLED))
        error, unconfirmed = sampled_error(judge, some, by_reading, window)
        # What finer steps do not find is solved for itself, and judged again.
        read[places[unconfirmed]] = False
        allowed = integrator.map_error
        if not (error <= allowed or model.slides):  # single orbits take the steps that they need
            allowed = 2.0 * sampled_error(split, some, solved_sample(split, some), window).error
        if not error <= allowed:
            read = np.zeros_like(read)
    if read.all():
        return Sought(surface, (Group("read", reader, candidates),), error, tabled)
    shared = surface.shared[candidates.frequency, candidates.part] & (not model.harmonics)
    ways = (("read", reader, read), ("split", split, shared & ~read), ("whole", whole, ~shared & ~read))
    if model.splits:
        # Where sharp laws give each orbit events of its own, no compiled step serves all.
        ways = (("read", reader, read), ("single", single, ~read))
    groups = tuple(Group(name, way, _chosen(candidates, own)) for name, way, own in ways if own.any())
    return Sought(surface, groups, error, tabled)


def _sample(surface: Surface, candidates: Candidates, known: np.ndarray) -> np.ndarray:
    """Give places of a sample: by the largest expected error, next to folds, and evenly."""
    # Of a long list, one in so many; but all where orbits coexist.
    kept = np.zeros(candidates.order.size, bool)
    kept[known[:: max(1, known.size // _POOL)]] = True
    kept[known] |= candidates.order[known] > 0
    known = np.flatnonzero(kept)
    column, part = candidates.frequency[known], candidates.part[known]
    count = min(SAMPLED // 3, known.size)
    ends = surface.forces.ends[column, part], surface.forces.ends[column, part + 1]
    # Next to a fold the force hardly changes along a part, and any error is seen through a lens.
    flat = np.abs(np.log(ends[1] / ends[0]))
    picked = [
        np.argpartition(surface.error[column, part], known.size - count)[known.size - count :],
        np.argpartition(flat, count - 1)[:count],
        np.linspace(0, known.size - 1, count).astype(int),
    ]
    return known[np.unique(np.concatenate(picked))]


def _chosen(candidates: Candidates, which: Bool[np.ndarray, " candidate"] | np.ndarray) -> Candidates:
    """Give some of the candidates."""
    if which.dtype == bool and which.all():
        return candidates
    return Candidates(*(values[which] for values in candidates))
