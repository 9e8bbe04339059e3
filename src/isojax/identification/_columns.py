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

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._parameters import list_parameters, own_parameters
from ..models import RK4, Isolator, State
from ._batch import Batch, Prepared, workers
from ._families import Family, find_families, in_turn, stack_states
from ._information import STIFFNESS_SCALE_UNIT, Unknowns, has_stiffness_scale, share_lanes
from ._ports import port_columns
from ._slopes import Change, Slopes, cubic_middle, follow_path, nodes_of, slopes_along
from ._transitions import Transitions, respond_in_steps, transitions_along

_ENTRIES = 2e7
"""Numbers that one table of columns along the motion may hold."""

_ROOM = 120
"""Columns for which a table has room at least: few columns then share the compiled code of many."""

_TOGETHER = 24
"""Columns that one linear solve carries: the last one is filled up, so that all have one shape."""


@eqx.filter_jit
def _respond(
    by_state: tuple[Change, ...],
    forcing: Float[Array, "row column node lanes"],
    direct: Float[Array, "column time lanes"],
    starts: Float[Array, "state column lanes"],
    weight: Float[Array, "time lanes"],
    step: float,
) -> Float[Array, "lanes column time"]:
    """Solve `d' = A(t) d + b(t)` for some columns; between nodes A and b follow cubics through four.

    Returns:
        What the weighted reading does.
    """
    size = starts.shape[0]
    steps = forcing.shape[2] // weight.shape[0]
    slopes = jnp.stack([jnp.stack([entry.rates[row] for entry in by_state], 1) for row in range(size - 1)], 1)
    solver = RK4()

    def field(t: float, d: tuple[Array, ...], table: tuple[tuple[Array, ...], ...]) -> tuple[Array, ...]:
        place = round(2.0 * t)
        a, b = table[0][place], table[1][place]
        rows = [step * d[1]]
        for row in range(size - 1):
            rate = b[row]
            for column in range(size):
                rate = rate + a[row, column][None] * d[column]
            rows.append(step * rate)
        return tuple(rows)

    term = diffrax.ODETerm(field)  # pyright: ignore[reportArgumentType]

    def body(carry: tuple, ahead: tuple[Array, Array]) -> tuple[tuple, tuple[Array, ...]]:
        d, a, b = carry
        a, b = (a[0], a[1], a[2], ahead[0]), (b[0], b[1], b[2], ahead[1])
        table = (a[1], cubic_middle(*a), a[2]), (b[1], cubic_middle(*b), b[2])
        moved, *_ = solver.step(term, 0.0, 1.0, d, table, None, False)
        return (moved, a[1:], b[1:]), d

    def ahead(values: Array) -> Array:
        return jnp.concatenate([values[2:], values[-1:], values[-1:]])

    pushed = jnp.transpose(forcing, (2, 0, 1, 3))
    first = (slopes[0], slopes[0], slopes[1]), (pushed[0], pushed[0], pushed[1])
    start = (tuple(starts[index] for index in range(size)), *first)
    path = jax.lax.scan(body, start, (ahead(slopes), ahead(pushed)))[1]
    rows = sum(
        d[::steps] * entry.reading[::steps, None] for d, entry in zip(path, by_state, strict=True)
    ) + jnp.swapaxes(direct, 0, 1)
    return jnp.transpose(rows * weight[:, None], (2, 1, 0))


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
    lanes, nodes, time = scale.shape[0], path[0].shape[0], batch.measured.shape[0]
    step = prepared.sample_time * time / nodes
    table = np.empty((lanes, columns, time))
    weight = np.asarray(batch.weight)
    error = (np.asarray(batch.measured) - np.asarray(slopes.reading)[:: nodes // time]) * weight
    table[:, -1] = error.T

    by_step = None
    if model.splits:
        tables = (own.drive, own.drive_rate, own.channels)
        tables = jax.tree_util.tree_map(nodes_of, tables)
        by_step = transitions_along(model, layout.moving, scale, path, tables, prepared.quantity, step)
    group = _Group(size, nodes, time, lanes, by_step)
    for source in _sources(layout, prepared, batch, slopes, by_step, states[size:], columns, part):
        group.add(*source)
        if group.is_full:
            group.solve(table, slopes.states, batch.weight, step)
    for index in range(size):
        group.start(columns - 1 - size + index, index, np.asarray(scales[index]))
        if group.is_full:
            group.solve(table, slopes.states, batch.weight, step)
    group.solve(table, slopes.states, batch.weight, step)
    # A probe whose memory ran away is told by its infinite products.
    with np.errstate(over="ignore", invalid="ignore"):
        return table @ np.swapaxes(table, 1, 2)


def _sources(
    layout: _Layout,
    prepared: Prepared,
    batch: Batch,
    slopes: Slopes,
    by_step: Transitions | None,
    memories: State,
    columns: int,
    part: int,
) -> Iterator[tuple[int, np.ndarray, np.ndarray, np.ndarray | float]]:
    """Give each coefficient's column, change of the rates (row node lanes), of the reading (time lanes).

    Last comes what it does over a step (state node lanes), in place of the change of the rates, where the
    model's laws jump.
    """
    size = 2 + layout.model.internal_states
    steps = slopes.reading.shape[0] // batch.measured.shape[0]

    def ready(unit: float, change: Change) -> tuple[np.ndarray, np.ndarray]:
        forcing = unit * np.stack([np.asarray(row) for row in change.rates])
        return forcing, unit * np.asarray(change.reading)[::steps]

    def own(unit: float, change: Change, place: int) -> tuple[np.ndarray, np.ndarray, np.ndarray | float]:
        forcing, direct = ready(unit, change)
        if by_step is None:
            return forcing, direct, 0.0
        added = by_step.scale if place < 0 else by_step.parameters[:, place]
        return 0.0 * forcing, direct, unit * np.asarray(added)

    for place, (column, change) in enumerate(zip(layout.places[0], slopes.parameters, strict=True)):
        yield column, *own(layout.units[column], change, place)
    scaled = columns - 1 - size
    if scaled > len(layout.units):
        change = slopes.states[0] if slopes.scale is None else slopes.scale
        # A model without a spring has no stiffness to scale, whatever a probe would bring.
        unit = 0.0 if slopes.scale is None else STIFFNESS_SCALE_UNIT
        yield scaled - 1, *own(unit, change, -1)
    starts = stack_states(layout.families, layout.probes, memories)
    followed = {name: np.asarray(nodes_of(values)) for name, values in batch.channels.items()}
    step = prepared.sample_time / steps
    ports = {name: ready(1.0, change) for name, change in slopes.ports.items()}
    ends = np.cumsum([0, *(family.elements.internal_states for family in layout.families)])
    shares = dict(zip((family.places for family in layout.families), itertools.pairwise(ends), strict=True))
    for family in in_turn(layout.families, part):
        begin, end = shares[family.places]
        own_channels = {name: followed[name] for name in family.elements.channels}
        pushing = {name: jnp.asarray(_across_jumps(values)) for name, values in own_channels.items()}
        added = port_columns(family, slopes.motion._replace(channels=pushing), starts[begin:end], step)
        read = added
        if own_channels:
            # A reading is that of the sample itself, at whose beginning every hold agrees with the record.
            reading = {name: jnp.asarray(values[:, 0]) for name, values in own_channels.items()}
            read = port_columns(family, slopes.motion._replace(channels=reading), starts[begin:end], step)
        does = [(np.asarray(added[name]), np.asarray(read[name]), ports[name]) for name in added]
        for member, probe in enumerate(family.places):
            column = layout.places[1][probe]
            if column >= 0:
                unit = layout.units[column]
                forcing = sum(unit * values[member] * rates for values, _, (rates, _) in does)
                direct = sum(unit * values[member, ::steps] * reading for _, values, (_, reading) in does)
                yield column, np.asarray(forcing), np.asarray(direct), 0.0


def _across_jumps(values: Float[np.ndarray, "node 3 lanes"]) -> Float[np.ndarray, "node lanes"]:
    """Give a signal at the start of each step, where it jumps the mean of both sides.

    What another hold would give agrees with the record at every sample: all of it lies between them.
    """
    ended = np.concatenate([values[:1, 0], values[:-1, 2]])
    return 0.5 * (ended + values[:, 0])


class _Group:
    """Columns that wait for one linear solve."""

    def __init__(self, size: int, nodes: int, time: int, lanes: int, by_step: Transitions | None):
        self.forcing = np.zeros((size - 1, _TOGETHER, nodes, lanes))
        self.direct = np.zeros((_TOGETHER, time, lanes))
        self.starts = np.zeros((size, _TOGETHER, lanes))
        self.columns: list[int] = []
        self.by_step = by_step
        self.kicks = None if by_step is None else np.zeros((size, _TOGETHER, nodes, lanes))

    @property
    def is_full(self) -> bool:
        """Whether no more columns fit."""
        return len(self.columns) == _TOGETHER

    def add(
        self, column: int, forcing: np.ndarray, direct: np.ndarray, kick: np.ndarray | float = 0.0
    ) -> None:
        """Put a column that is pushed along the motion."""
        place = len(self.columns)
        self.forcing[:, place], self.direct[place], self.starts[:, place] = forcing, direct, 0.0
        if self.kicks is not None:
            self.kicks[:, place] = kick
        self.columns.append(column)

    def start(self, column: int, state: int, size: np.ndarray) -> None:
        """Put a column that starts elsewhere."""
        self.add(column, np.zeros(1), np.zeros(1))
        self.starts[state, len(self.columns) - 1] = size

    def solve(self, table: np.ndarray, by_state: tuple[Change, ...], weight: Array, step: float) -> None:
        """Solve, and put what the readings do into the table."""
        if self.columns:
            forcing, direct, starts = map(jnp.asarray, (self.forcing, self.direct, self.starts))
            if self.by_step is None:
                rows = _respond(by_state, forcing, direct, starts, weight, step)
            else:
                seen, kicks = tuple(entry.reading for entry in by_state), jnp.asarray(self.kicks)
                rows = respond_in_steps(self.by_step, seen, forcing, kicks, direct, starts, weight)
            table[:, self.columns] = np.asarray(rows)[:, : len(self.columns)]
        self.columns = []
