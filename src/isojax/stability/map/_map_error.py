"""How well a map is integrated, from a sample of its cells, and how many steps it takes."""

import math
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Int

from ..orbit import Sine
from ._batched_newton import CELLS_TOGETHER, FOUND, FULLY_CLOSED, SAMPLED, CellSolver, Found
from ._grids import LEAST_SLOPE
from ._map_method import Lane
from ._single_orbits import SingleOrbits
from ._starts import Candidates
from ._surface import MapWindow

_MARGIN = 1.25
"""On the largest error of a sample: the worst cell of a map is seldom in it."""

_DOUBLINGS = 3
"""Trials with twice the steps where some orbits were not found."""


class SampledError(NamedTuple):
    """What a sample of cells says of a map.

    Attributes:
        error: largest error of a multiplier, with a margin for the cells that the sample lacks; NaN where
            there is no cell to compare.
        unconfirmed: places of the sampled orbits that finer steps did not find, so that nothing is known of
            their error.
    """

    error: float
    unconfirmed: Int[np.ndarray, " orbit"]


def sampled_error(
    solver: CellSolver | SingleOrbits, candidates: Candidates, found: Found, window: MapWindow
) -> SampledError:
    """Give the integration error of multipliers, from a sample of cells solved with finer steps.

    The distance of a multiplier from the finer ones is their characteristic polynomial there over its slope.
    The slope counts as 0.1 at least: where two multipliers all but coincide they separate like the square
    root of any error, and their distance would say more of the place than of the integration.

    Args:
        solver: confirms orbits.
        candidates: of the map.
        found: their orbits.
        window: of the map.

    Returns:
        The error, and the orbits of the sample that it says nothing of.
    """
    good = np.flatnonzero(found.code == FOUND)
    if not good.size:
        return SampledError(math.nan, good)
    picked = good[np.unique(np.linspace(0, good.size - 1, SAMPLED).astype(int))]
    finer = solver.confirmed(lanes_of(found, candidates, window, picked), picked.size)
    distance = np.abs(found.multipliers[picked][:, :, None] - finer.multipliers[:, None, :])
    distance.sort(axis=2)
    nearest, others = distance[..., 0], distance[..., 1:]
    ratio = np.prod(others, axis=-1) / np.maximum(np.prod(others, axis=-1), LEAST_SLOPE)
    known = finer.code == FOUND
    largest = float((nearest * ratio)[known].max()) if known.any() else math.nan
    return SampledError(_MARGIN * largest, picked[~known])


def solved_sample(solver: CellSolver, some: Candidates, limit: float | None = None) -> Found:
    """Give the orbits of a sample.

    Args:
        solver: that of the map.
        some: the sample.
        limit: see `CellSolver.improve`.

    Returns:
        Its orbits.
    """

    def solved(block: slice) -> Found:
        return solver(Candidates(*(values[block] for values in some)), CELLS_TOGETHER, limit)

    return solver.in_blocks(solved, some.force.size)


def steps_needed(solver: CellSolver, candidates: Candidates, window: MapWindow) -> int:
    """Give the steps a period at which the multipliers of a map are as good as its integrator promises.

    From a sample of orbits and the order of the integrator: the error falls with the fourth power.
    """
    integrator = solver.method.integrator
    picked = np.unique(np.linspace(0, candidates.force.size - 1, SAMPLED).astype(int))
    some = Candidates(*(values[picked] for values in candidates))
    taken = integrator.steps_per_period
    found = solved_sample(solver, some, FULLY_CLOSED)
    for _ in range(_DOUBLINGS):
        if (found.code == FOUND).all():
            break
        # Where the motion is too fast for the steps there is no orbit, and no error to go by.
        solver, taken = eqx.tree_at(lambda it: it.method, solver, solver.method.finer(2)), 2 * taken
        found = solved_sample(solver, some, FULLY_CLOSED)
    error = sampled_error(solver, some, found, window).error
    if not error > 0.0:
        return integrator.steps_per_period
    return steps_for(taken, error, integrator.map_error)


def steps_for(taken: int, error: float, goal: float) -> int:
    """Give the steps a period with which an error becomes another, which falls with the fourth power.

    Args:
        taken: steps a period of the error.
        error: of a sample of multipliers.
        goal: the error wanted.

    Returns:
        Steps, an even number.
    """
    times = min(max((error / goal) ** 0.25, 0.5), 128.0)
    return 2 * math.ceil(0.5 * taken * times)


def lanes_of(found: Found, candidates: Candidates, window: MapWindow, picked: np.ndarray) -> Lane:
    """Give orbits that were found as starts."""
    push = window.amplitudes[candidates.force[picked]]
    sine, cosine = (jnp.asarray(push * part) for part in found.direction[picked].T)
    drive = Sine(sine, cosine, jnp.asarray(window.frequencies[candidates.frequency[picked]]))
    state, phases = (tuple(jnp.asarray(values[picked].T)) for values in (found.states, found.phases))
    return Lane(state, drive, phases, jnp.asarray(found.response[picked]))
