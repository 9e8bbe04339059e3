"""Many columns at once: how readings answer small forces, from one simulation and one linear solve.

The derivatives of `information` cost a full step of the model a column. For dozens of absent effects the
motion is simulated once; what each effect would add is worked out along it, all samples at once; and one
linear, time-varying solve, which knows nothing of the effects, carries all columns. Compiled code depends on
the model, on the kind of an effect, or on neither, and never on which effects ride along with which model.
"""

import itertools
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._parameters import list_parameters, own_parameters
from ..models import Isolator, State
from ._batch import Batch, Prepared, workers
from ._families import Family, find_families, in_turn, stack_states
from ._information import STIFFNESS_SCALE_UNIT, Unknowns, has_stiffness_scale, share_lanes
from ._ports import port_columns
from ._slopes import Change, Slopes, cubic_middle, follow_path, sample_stages, slopes_along

_ENTRIES = 2e7
"""Numbers that one table of columns along the motion may hold."""

_ROOM = 120
"""Columns for which a table has room at least: few columns then share the compiled code of many."""

_TOGETHER = 24
"""Columns that one linear solve carries: the last one is filled up, so that all have one shape."""


_Matrix = list[list[Array]]


def _product(left: _Matrix, right: _Matrix) -> _Matrix:
    """Multiply small matrices whose entries are series: written out, so that all of it is one pass."""
    columns = list(zip(*right, strict=True))
    return [
        [sum((a * b for a, b in zip(row, column, strict=True)), jnp.zeros(())) for column in columns]
        for row in left
    ]


def _sum(*terms: tuple[float, _Matrix]) -> _Matrix:
    """Add small matrices, the first number of each term times its matrix."""
    size = range(len(terms[0][1]))
    return [[sum((f * m[row][column] for f, m in terms), jnp.zeros(())) for column in size] for row in size]


def _around(values: Float[Array, "time ..."]) -> tuple[Array, Array, Array, Array]:
    """Give the values at the samples before and at the start of each step, at its end and after that."""
    time = values.shape[0]
    padded = jnp.concatenate([values[:1], values, values[-1:], values[-1:]])
    before, now, ahead, after = (padded[first : first + time] for first in range(4))
    return before, now, ahead, after


@eqx.filter_jit
def _propagate(by_state: tuple[Change, ...], step: float) -> tuple[_Matrix, _Matrix, _Matrix]:
    """Give what a Runge-Kutta step makes of a small change of the states, of pushes at its start and middle.

    The step of a linear equation `d' = A(t) d + b(t)` is linear: `d+ = F d + G0 b + Gm bm + h/6 b+`, with A
    between samples on the cubic through four.

    Returns:
        F, G0, Gm: rows of columns of series over (time, lanes).
    """
    size = len(by_state)
    still = jnp.zeros_like(by_state[0].rates[0])
    one = [[still + float(row == column) for column in range(size)] for row in range(size)]
    start = [one[1], *([entry.rates[row] for entry in by_state] for row in range(size - 1))]
    around = [[_around(entry) for entry in row] for row in start]
    middle = [[cubic_middle(*four) for four in row] for row in around]
    end = [[four[2] for four in row] for row in around]
    k2 = _product(middle, _sum((1.0, one), (0.5 * step, start)))
    k3 = _product(middle, _sum((1.0, one), (0.5 * step, k2)))
    k4 = _product(end, _sum((1.0, one), (step, k3)))
    sixth = step / 6.0
    forward = _sum((1.0, one), (sixth, start), (2.0 * sixth, k2), (2.0 * sixth, k3), (sixth, k4))
    twice = _product(middle, middle)
    by_start = _sum(
        (sixth, one),
        (sixth * step, middle),
        (0.5 * sixth * step**2, twice),
        (0.25 * sixth * step**3, _product(end, twice)),
    )
    by_middle = _sum(
        (4.0 * sixth, one),
        (sixth * step, middle),
        (sixth * step, end),
        (0.5 * sixth * step**2, _product(end, middle)),
    )
    return forward, by_start, by_middle


@eqx.filter_jit
def _respond(
    propagation: tuple[_Matrix, _Matrix, _Matrix],
    readings: tuple[Float[Array, "time lanes"], ...],
    forcing: Float[Array, "row time column lanes"],
    direct: Float[Array, "time column lanes"],
    starts: Float[Array, "state column lanes"],
    weight: Float[Array, "time lanes"],
    step: float,
) -> Float[Array, "time column lanes"]:
    """Solve `d' = A(t) d + b(t)` for some columns; between samples b follows cubics through four.

    Returns:
        What the weighted reading does.
    """
    forward, by_start, by_middle = propagation
    size = starts.shape[0]
    around = [_around(row) for row in forcing]
    now, ahead = [four[1] for four in around], [four[2] for four in around]
    middle = [cubic_middle(*four) for four in around]
    # The first row, the velocity, is not pushed.
    pushed = []
    for row in range(size):
        parts = [by_start[row][column][:, None] * now[column - 1] for column in range(1, size)]
        parts += [by_middle[row][column][:, None] * middle[column - 1] for column in range(1, size)]
        parts += [step / 6.0 * ahead[row - 1]] if row else []
        pushed.append(sum(parts, start=jnp.zeros(())))

    def body(d: tuple[Array, ...], table: tuple[_Matrix, list[Array]]) -> tuple[tuple, tuple[Array, ...]]:
        f, g = table
        moved = tuple(
            sum((f[row][column][None] * d[column] for column in range(size)), start=g[row])
            for row in range(size)
        )
        return moved, d

    start = tuple(starts[index] for index in range(size))
    path = jax.lax.scan(body, start, (forward, pushed))[1]
    rows = sum(d * reading[:, None] for d, reading in zip(path, readings, strict=True)) + direct
    return rows * weight[:, None]


class _Layout(NamedTuple):
    """Which columns there are.

    Attributes:
        model: the carried elements alone.
        families: the absent effects, kind by kind.
        probes: the absent effects.
        moving: parameters of the model with a column.
        units: size of one unit of each column but those of the states.
        places: column of each of `moving`, of each probe (-1 without one).
    """

    model: Isolator
    families: tuple[Family, ...]
    probes: tuple[Any, ...]
    moving: tuple[int, ...]
    units: tuple[float, ...]
    places: tuple[tuple[int, ...], tuple[int, ...]]


def _layout(unknowns: Unknowns, carried: int) -> _Layout:
    whole = unknowns.model
    model = Isolator(whole.mass, whole.elements[:carried], whole.excitation)
    probes = whole.elements[carried:]
    places = [int(np.flatnonzero(column)[0]) for column in unknowns.directions.T]
    units = [float(unknowns.directions[place, index]) for index, place in enumerate(places)]
    known = len(list_parameters(model))
    owner = np.repeat(np.arange(len(probes)), [len(own_parameters(probe)) for probe in probes])
    of_probe = [-1] * len(probes)
    for column, place in enumerate(places):
        if place >= known:
            of_probe[owner[place - known]] = column
    own = [column for column, place in enumerate(places) if place < known]
    moving = tuple(places[column] for column in own)
    return _Layout(model, find_families(probes), probes, moving, tuple(units), (tuple(own), tuple(of_probe)))


def column_information(
    unknowns: Unknowns, carried: int, prepared: Prepared
) -> Float[np.ndarray, "lanes column column"]:
    """Give the information matrix of each segment, absent effects among the columns.

    The columns are those of `information`; each direction must move one parameter alone. Elements beyond the
    carried ones are at zero strength: their memories follow the motion and do not act back, so that only
    their strengths have columns and only the carried states have initial values to eliminate.

    Args:
        unknowns: where the simulation stands and its directions.
        carried: count of elements that move the state.
        prepared: the segments.

    Returns:
        A^T A of each lane, lanes first.
    """
    parts = len(prepared.batches)
    layout = _layout(unknowns, carried)
    size = 2 + layout.model.internal_states
    columns = len(layout.units) + int(has_stiffness_scale(unknowns.model)) + size + 1

    def one(part: int) -> np.ndarray:
        batch = prepared.batches[part].following(unknowns.model)
        scale = share_lanes(unknowns.stiffness_scale[None], part, parts)[0]
        states = share_lanes(unknowns.states, part, parts)
        scales = share_lanes(unknowns.state_scales[:size], part, parts)
        lanes = scale.shape[0]
        # A table of all columns along all lanes may not fit the memory: a few lanes at a time.
        blocks = -(-lanes // max(1, int(_ENTRIES / (batch.drive.shape[0] * max(columns, _ROOM)))))
        width = -(-lanes // blocks)
        done = []
        for first in range(0, lanes, width):
            chosen = np.minimum(np.arange(first, first + width), lanes - 1)
            some = jax.tree_util.tree_map(
                lambda values, chosen=chosen: values[..., chosen], (batch, scale, states, scales)
            )
            done.append(_block(layout, prepared, columns, part, *some)[: lanes - first])
        return np.concatenate(done)

    with ThreadPoolExecutor(workers()) as pool:
        return np.concatenate(list(pool.map(one, range(parts))))


def _block(
    layout: _Layout,
    prepared: Prepared,
    columns: int,
    part: int,
    batch: Batch,
    scale: Array,
    states: State,
    scales: State,
) -> Float[np.ndarray, "lanes column column"]:
    """Work out the columns of a few lanes, and multiply them out."""
    model, size = layout.model, 2 + layout.model.internal_states
    own = batch.following(model)
    path = follow_path(model, scale, states[:size], own, prepared.quantity, prepared.sample_time)
    slopes = slopes_along(model, layout.moving, scale, path, own, prepared.quantity)
    lanes, time, step = scale.shape[0], batch.measured.shape[0], prepared.sample_time
    table = np.empty((lanes, columns, time))
    weight = np.asarray(batch.weight)
    error = (np.asarray(batch.measured) - np.asarray(slopes.reading)) * weight
    table[:, -1] = error.T

    group = _Group(slopes.states, batch.weight, step)
    for column, forcing, direct in _sources(layout, prepared, batch, slopes, states[size:], columns, part):
        group.add(column, forcing, direct)
        if group.is_full:
            group.solve(table)
    for index in range(size):
        group.start(columns - 1 - size + index, index, np.asarray(scales[index]))
        if group.is_full:
            group.solve(table)
    group.solve(table)
    # A probe whose memory ran away is told by its infinite products.
    with np.errstate(over="ignore", invalid="ignore"):
        return table @ np.swapaxes(table, 1, 2)


def _sources(
    layout: _Layout,
    prepared: Prepared,
    batch: Batch,
    slopes: Slopes,
    memories: State,
    columns: int,
    part: int,
) -> Iterator[tuple[int, np.ndarray, np.ndarray]]:
    """Give each coefficient's column, change of the rates (row time lanes), of the reading (time lanes)."""
    size = 2 + layout.model.internal_states

    def ready(unit: float, change: Change) -> tuple[np.ndarray, np.ndarray]:
        forcing = unit * np.stack([np.asarray(row) for row in change.rates])
        return forcing, unit * np.asarray(change.reading)

    for column, change in zip(layout.places[0], slopes.parameters, strict=True):
        yield column, *ready(layout.units[column], change)
    scaled = columns - 1 - size
    if scaled > len(layout.units):
        change = slopes.states[0] if slopes.scale is None else slopes.scale
        # A model without a spring has no stiffness to scale, whatever a probe would bring.
        unit = 0.0 if slopes.scale is None else STIFFNESS_SCALE_UNIT
        yield scaled - 1, *ready(unit, change)
    step = prepared.sample_time
    starts = stack_states(layout.families, layout.probes, memories)
    followed = {name: np.asarray(sample_stages(values)) for name, values in batch.channels.items()}
    ports = {name: ready(1.0, change) for name, change in slopes.ports.items()}
    ends = np.cumsum([0, *(family.elements.internal_states for family in layout.families)])
    own = dict(zip((family.places for family in layout.families), itertools.pairwise(ends), strict=True))
    for family in in_turn(layout.families, part):
        begin, end = own[family.places]
        own_channels = {name: followed[name] for name in family.elements.channels}
        pushing = {name: jnp.asarray(_across_jumps(values)) for name, values in own_channels.items()}
        added = port_columns(family, slopes.motion._replace(channels=pushing), starts[begin:end], step)
        read = added
        if own_channels:
            # A reading is that of the sample itself, at whose beginning every hold agrees with the record.
            reading = {name: jnp.asarray(values[:, 0]) for name, values in own_channels.items()}
            seen = slopes.motion._replace(channels=reading)
            read = port_columns(family, seen, starts[begin:end], step)
        does = [(np.asarray(added[name]), np.asarray(read[name]), ports[name]) for name in added]
        for member, probe in enumerate(family.places):
            column = layout.places[1][probe]
            if column >= 0:
                unit = layout.units[column]
                forcing = sum(unit * values[member] * rates for values, _, (rates, _) in does)
                direct = sum(unit * values[member] * reading for _, values, (_, reading) in does)
                yield column, np.asarray(forcing), np.asarray(direct)


def _across_jumps(values: Float[np.ndarray, "time 3 lanes"]) -> Float[np.ndarray, "time lanes"]:
    """Give a signal at each sample, where it jumps the mean of both sides.

    What another hold would give agrees with the record at every sample: all of it lies between them.
    """
    ended = np.concatenate([values[:1, 0], values[:-1, 2]])
    return 0.5 * (ended + values[:, 0])


class _Group:
    """Columns that wait for one linear solve."""

    def __init__(self, by_state: tuple[Change, ...], weight: Array, step: float):
        self.weight, self.step = weight, step
        self.propagation = _propagate(by_state, step)
        self.readings = tuple(entry.reading for entry in by_state)
        size, (time, lanes) = len(by_state), weight.shape
        self.forcing = np.zeros((size - 1, time, _TOGETHER, lanes))
        self.direct = np.zeros((time, _TOGETHER, lanes))
        self.starts = np.zeros((size, _TOGETHER, lanes))
        self.columns: list[int] = []

    @property
    def is_full(self) -> bool:
        """Whether no more columns fit."""
        return len(self.columns) == _TOGETHER

    def add(self, column: int, forcing: np.ndarray, direct: np.ndarray) -> None:
        """Put a column that is pushed along the motion."""
        place = len(self.columns)
        self.forcing[:, :, place], self.direct[:, place], self.starts[:, place] = forcing, direct, 0.0
        self.columns.append(column)

    def start(self, column: int, state: int, size: np.ndarray) -> None:
        """Put a column that starts elsewhere."""
        self.add(column, np.zeros(1), np.zeros(1))
        self.starts[state, len(self.columns) - 1] = size

    def solve(self, table: np.ndarray) -> None:
        """Solve, and put what the readings do into the table."""
        if self.columns:
            forcing, direct, starts = map(jnp.asarray, (self.forcing, self.direct, self.starts))
            rows = _respond(self.propagation, self.readings, forcing, direct, starts, self.weight, self.step)
            # Turned here, and not in compiled code, which takes four times as long.
            table[:, self.columns] = np.asarray(rows).transpose(2, 1, 0)[:, : len(self.columns)]
        self.columns = []
