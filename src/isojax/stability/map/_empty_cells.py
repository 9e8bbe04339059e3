"""Empty cells of a map tried as single orbits: from their own starts, then from the cells beside."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int
from scipy.ndimage import distance_transform_edt

from ..._quick_jit import quick_jit
from ...models import Integrator, Isolator
from ..orbit import is_held, recorded_sine, settled
from ._batched_newton import (
    FOUND,
    NO_FURTHER_ORBIT,
    NOT_CONVERGED,
    STICKS,
    Found,
    blanked,
    padded,
)
from ._map_error import lanes_of
from ._map_method import MapMethod
from ._nodes import in_blocks
from ._single_orbits import single_orbits
from ._starts import Candidates, joined
from ._states_at_zero import states_at_zero
from ._surface import MapWindow

_TRIED = 128
"""Cells of an even sample of those left empty; where none of them can be filled, the others are not tried."""

_RETRIES = 8
"""Times at most that empty cells are tried from those next to them."""

_SAME = 1e-5
"""Distance of two orbits, over their size, up to which they are one."""

_READ_TWICE = 0.05
"""The same for two readings off the surface, over the distance of the maxima from which they are read."""

_STARTS_TOGETHER = 1024
"""Lanes of the compiled step from a start to t = 0."""

_NEIGHBOURING = 1e-3
"""Relative difference of the sizes of two motions up to which they are looked at as one."""


class Cells(NamedTuple):
    """Orbits of a map, a candidate each.

    Attributes:
        candidates: where each is sought.
        found: what was found.
        split: whether each is split at the kinks that the others share.
    """

    candidates: Candidates
    found: Found
    split: Bool[np.ndarray, " candidate"]


def fill_empty(model: Isolator, integrator: Integrator, half: bool, window: MapWindow, cells: Cells) -> Cells:
    """Fill cells in which no orbit was found, as far as single orbits are found there.

    Args:
        model: the isolator.
        integrator: steps and tolerances.
        half: whether symmetric orbits are closed over half a period.
        window: axes of the map.
        cells: the orbits.

    Returns:
        The orbits, with those that were lacking.
    """
    shape = len(window.amplitudes), len(window.frequencies)
    if (cells.found.code == FOUND).all() and np.sum(cells.candidates.order == 0) == shape[0] * shape[1]:
        return cells
    method = MapMethod(integrator, half, None, jnp.asarray(integrator.steps_a_period(model)))
    cells = _with_every_cell(cells, shape)
    candidates, found = cells.candidates, Found(*(np.array(values) for values in cells.found))
    split = cells.split.copy()
    place = candidates.force.astype(int) * shape[1] + candidates.frequency

    def lost_cells() -> np.ndarray:
        full = np.zeros(shape[0] * shape[1], bool)
        full[place[found.code == FOUND]] = True
        return np.flatnonzero(~full[place] & (candidates.order == 0) & (found.code != STICKS))

    lost = lost_cells()
    if model.slides and lost.size:
        push, rate = window.amplitudes[candidates.force[lost]], window.frequencies[candidates.frequency[lost]]
        found.code[lost[in_blocks(lambda *drive: _held(model, *drive), push, rate)]] = STICKS
    spreading = ("beside",) * _RETRIES
    spread = False
    for way in ("balance", *spreading, "settled", *spreading):
        lost = lost_cells()
        if not lost.size:
            break
        if way == "beside" and (spread or not (found.code == FOUND).any()):
            continue
        beside = None
        if way == "beside":
            beside = _beside(model, method, window, Cells(candidates, found, split), lost)
        filled = 0
        for some in _blocks(lost.size):
            push = window.amplitudes[candidates.force[lost[some]]]
            rate = window.frequencies[candidates.frequency[lost[some]]]
            starts = None if beside is None else beside[some]
            if way == "settled":
                starts = in_blocks(lambda *drive: _settled(model, integrator, *drive), push, rate)
            got = single_orbits(model, integrator, half, push, rate, starts)
            good = got.code == FOUND
            own = lost[some][good]
            for name in ("states", "direction", "multipliers", "radius", "response", "code"):
                getattr(found, name)[own] = getattr(got, name)[good]
            found.phases[own] = np.nan
            # What friction or a stop leaves inaccurate says so.
            found.code[lost[some][~good]] = got.code[~good]
            split[own], filled = False, filled + own.size
            if not filled:
                break
        spread = way != "balance" and not filled
    return Cells(candidates, found, split)


def without_repeats(
    model: Isolator, integrator: Integrator, half: bool, window: MapWindow, cells: Cells
) -> Cells:
    """Leave out orbits that are another one of their cell: two starts may lead to the same.

    Args:
        model: the isolator.
        integrator: steps and tolerances.
        half: whether symmetric orbits are closed over half a period.
        window: axes of the map.
        cells: the orbits.

    Returns:
        The orbits, each once.
    """
    candidates, found, split = cells
    if not candidates.order.any():
        return cells
    place = candidates.force.astype(int) * len(window.frequencies) + candidates.frequency
    good = np.flatnonzero(found.code == FOUND)
    good = good[np.bincount(place[good], minlength=1)[place[good]] > 1]
    if not good.size:
        return cells
    order = good[np.lexsort((found.response[good], place[good]))]
    size = found.response[order]
    close = (np.diff(place[order]) == 0) & (np.diff(size) <= _NEIGHBOURING * size[1:])
    # Runs of orbits of all but the same size in a cell; in each, every one is compared with every other.
    run = np.r_[0, np.cumsum(~close)] if order.size else np.zeros(0, int)
    lengths = np.bincount(run)[run] if order.size else run
    order, run = order[lengths > 1], run[lengths > 1]
    if not order.size:
        return cells
    method = MapMethod(integrator, half, None, jnp.asarray(integrator.steps_a_period(model)))
    states = states_of(model, method, window, cells, order)[:, :2]
    rate = 2.0 * np.pi * window.frequencies[candidates.frequency[order]]
    scale = found.response[order, None] * np.stack([np.ones_like(rate), rate], axis=1)
    gone = []
    for apart in range(1, int(lengths.max())):
        alike = run[:-apart] == run[apart:]
        # A motion of several maxima lies on the surface once for each of them: read off there, it is far more
        # alike than they are. Two orbits next to a fold differ as much as their maxima.
        one, other = order[:-apart], order[apart:]
        turns = np.abs(found.states[one, 0] - found.states[other, 0]) / found.response[other]
        both = split[one] & split[other]
        allowed = np.where(both, _READ_TWICE * turns, _SAME)
        alike &= np.all(np.abs(states[:-apart] - states[apart:]) <= allowed[:, None] * scale[apart:], axis=1)
        gone.append(np.maximum(order[:-apart], order[apart:])[alike])
    return Cells(candidates, blanked(found, np.concatenate(gone), NO_FURTHER_ORBIT), split)


@quick_jit
def _settled(model: Isolator, integrator: Integrator, push: Array, rate: Array) -> Array:
    return jax.vmap(lambda *drive: settled(model, integrator, *drive))(push, rate)


@quick_jit
def _held(model: Isolator, amplitude: Array, frequency: Array) -> Array:
    return jax.vmap(lambda push, rate: is_held(model, recorded_sine(model, push, rate)))(amplitude, frequency)


def _blocks(count: int) -> list[np.ndarray]:
    """Give places of an even sample, then those of the others."""
    first = np.unique(np.linspace(0, count - 1, min(count, _TRIED)).astype(int))
    others = np.setdiff1d(np.arange(count), first)
    return [first, others] if others.size else [first]


def _with_every_cell(cells: Cells, shape: tuple[int, int]) -> Cells:
    """Add the cells in which the surface holds no orbit."""
    candidates, found, split = cells
    has = np.zeros(shape, bool)
    has[candidates.force, candidates.frequency] = True
    force, column = (places.astype(np.int32) for places in np.nonzero(~has))
    if not force.size:
        return cells
    none = np.zeros(force.size, np.int32)
    added = Candidates(force, column, none, none)
    blank = {
        name: np.full((force.size, *values.shape[1:]), np.nan, values.dtype)
        for name, values in found._asdict().items()
        if name != "code"
    }
    missing = Found(**blank, code=np.full(force.size, NOT_CONVERGED, np.int8))
    return Cells(
        joined([candidates, added]),
        joined([found, missing]),
        np.concatenate([split, np.zeros(force.size, bool)]),
    )


def _beside(
    model: Isolator, method: MapMethod, window: MapWindow, cells: Cells, lost: Int[np.ndarray, " cell"]
) -> Float[np.ndarray, "cell state"]:
    """Give the states at t = 0 of the orbits in the cells next to some."""
    candidates, found, _ = cells
    holder = np.full((len(window.amplitudes), len(window.frequencies)), -1)
    good = np.flatnonzero((found.code == FOUND) & (candidates.order == 0))
    holder[candidates.force[good], candidates.frequency[good]] = good
    row, column = np.asarray(distance_transform_edt(holder < 0, return_distances=False, return_indices=True))
    own = candidates.force[lost], candidates.frequency[lost]
    source = holder[row[own], column[own]]
    return states_of(model, method, window, cells, source)


def states_of(
    model: Isolator, method: MapMethod, window: MapWindow, cells: Cells, picked: Int[np.ndarray, " orbit"]
) -> Float[np.ndarray, "orbit state"]:
    """Give the states of some orbits at t = 0 of the recorded drive."""
    states = []
    for begin in range(0, picked.size, _STARTS_TOGETHER):
        block = picked[begin : begin + _STARTS_TOGETHER]
        lanes = lanes_of(cells.found, cells.candidates, window, padded(block, _STARTS_TOGETHER))
        states.append(
            np.stack(states_at_zero(model, method, lanes._replace(phases=())), axis=-1)[: block.size]
        )
    return np.concatenate(states)
