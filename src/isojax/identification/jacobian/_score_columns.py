"""Many columns at once: how readings answer small forces, from one simulation and one linear solve.

The derivatives of `information` cost a full step of the model a column. For dozens of absent effects the
motion is simulated once; what each effect would add is worked out along it, all samples at once; and one
linear, time-varying solve, which knows nothing of the effects, carries all columns. The motion is that of
the fit's own solver; the solve along it takes one step for each sample.
Compiled code depends on the model, on the kind of an effect, or on neither, and never on which effects ride
along with which model.
"""

import dataclasses
import itertools
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..._cores import give_memory_back
from ..._parameters import list_parameters, own_parameters
from ..._types import Scalar, on_device
from ...models import Isolator, State
from ._batch import Batch, Prepared, workers
from ._effect_inputs import input_columns
from ._families import ElementFamily, find_families, in_turn, stack_states
from ._information import find_stepping
from ._propagation import Propagation, propagate, respond
from ._slopes import Change, Slopes, impulse_at_samples, sample_stages, slopes_along
from ._transitions import Transitions, transitions_along
from ._unknowns import STIFFNESS_SCALE_UNIT, Lanes, Unknowns, has_stiffness_scale
from ._whitening import whitened_products

_ENTRIES = 6e6
"""Numbers that one table of columns along the motion may hold."""

_LEAST_COLUMNS = 160
"""Columns for which a table has room at least: absent effects and free force laws, however many, then share
compiled code."""

SCORE_PIECES = 10
"""Pieces of a lane over which the scatter of scores is seen."""

_BY_STAGE = ("drive", "drive_rate", "channels")
"""Fields of a batch that have a value at each stage of a sample's steps."""

_TOGETHER = 24
"""Columns that one linear solve carries: the last one is filled up, so that all have one shape."""


class Followed(NamedTuple):
    """What a filter makes of the records, in the place of a simulation.

    Attributes:
        path: states before each sample is seen.
        gains: by which it corrects each state by an innovation, the random force last.
        memory: of the random force: its correlation from sample to sample.
        error: innovations [SI unit of the output].
        weight: of each, one over its standard deviation.
        piece: which piece of its record each sample belongs to.
    """

    path: State
    gains: State
    memory: float
    error: Array
    weight: Array
    piece: Array


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
    families: tuple[ElementFamily, ...]
    probes: tuple[Any, ...]
    moving: tuple[int, ...]
    units: tuple[float, ...]
    places: tuple[tuple[int, ...], tuple[int, ...]]


_weigh = jax.jit(whitened_products)


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


def score_information(
    unknowns: Unknowns, carried: int, prepared: Prepared, followed: Sequence[Followed] = ()
) -> Float[np.ndarray, "lanes row other"]:
    """Give the information matrix of each segment, absent effects among the columns.

    The columns are those of `information`; each direction must move one parameter alone. Elements beyond the
    carried ones are at zero strength: their internal states follow the motion and do not act back, so that
    only their strengths have columns and only the carried states have initial values to eliminate.

    Args:
        unknowns: where the simulation stands and its directions.
        carried: count of elements that move the state.
        prepared: the segments.
        followed: a filter's path along each batch, whose innovations are then the residual; none of a
            simulation. Initial states then have columns like those of a simulation, which nobody asks for.

    Returns:
        A^T A of each lane, lanes first; with a filter, behind it A^T times the residual of each piece of the
        lane.
    """
    layout = _layout(unknowns, carried)
    size = 2 + layout.model.internal_states
    columns = len(layout.units) + int(has_stiffness_scale(unknowns.model)) + size + 1

    def one(part: int) -> np.ndarray:
        batch = prepared.batches[part].following(unknowns.model)
        time = batch.drive.shape[0]
        (scale,), states = (
            prepared.own(one, part) for one in (unknowns.stiffness_scale[None], unknowns.states)
        )
        scales = prepared.own(unknowns.state_scales[:size], part)
        lanes = scale.shape[0]
        # A table of all columns along all lanes may not fit the memory: a few lanes at a time.
        blocks = -(-lanes // max(1, int(_ENTRIES / (time * max(columns, _LEAST_COLUMNS)))))
        width = -(-lanes // blocks)
        done = []
        # Lanes without a segment come last, and hold nothing.
        used = min(lanes, len(prepared.segments) - part * lanes)
        for first in range(0, used, width):
            # The last block reaches back, so that all have one shape.
            begin = min(first, lanes - width)
            some: Any = (batch, scale, states, scales, followed[part] if followed else None)
            if blocks > 1:
                some = jax.tree_util.tree_map(partial(_some_lanes, begin=begin, width=width), some)
            done.append(_block(layout, prepared, columns, part, *some)[first - begin :])
        products = np.concatenate(done)
        return np.pad(products, ((0, lanes - len(products)), (0, 0), (0, 0)))

    with ThreadPoolExecutor(workers()) as pool:
        products = prepared.in_lanes(pool.map(one, range(len(prepared.batches))))
    give_memory_back()
    return products


def _some_lanes(values: Array, begin: int, width: int) -> Array:
    """Give a few lanes of a table, by a function that is compiled once for all places of a shape."""
    return jax.lax.dynamic_slice_in_dim(values, begin, width, axis=-1) if np.ndim(values) else values


def _block(
    layout: _Layout,
    prepared: Prepared,
    columns: int,
    part: int,
    batch: Batch,
    scale: Array,
    states: State,
    scales: State,
    followed: Followed | None,
) -> Float[np.ndarray, "lanes row other"]:
    """Work out the columns of a few lanes, and multiply them out."""
    model, size, sampling = layout.model, 2 + layout.model.internal_states, prepared.sampling
    stepping, own = find_stepping(prepared), batch.following(model)
    begin = Lanes(model, scale, states[:size])
    quantity, step = sampling.quantity, sampling.time
    if followed is None:
        weight, gains = batch.weight, ()
        error = (batch.measured - stepping.readings(begin, own, sampling)) * weight
        path, ringing = stepping.path(begin, own, sampling)
    else:
        weight, gains = followed.weight, followed.gains
        error, path, ringing = followed.error * weight, followed.path, None
        # The filter's path has a node a sample.
        tables = {name: jax.tree.map(sample_stages, getattr(own, name)) for name in _BY_STAGE}
        own = dataclasses.replace(own, **tables)
    slopes = slopes_along(model, layout.moving, scale, path, ringing, own, quantity)
    lanes, time = scale.shape[0], batch.measured.shape[0]
    table = np.empty((lanes, columns, time))
    table[:, -1] = np.asarray(error).T

    exact = None
    if ringing is not None:
        exact = transitions_along(model, layout.moving, scale, path, own.acting, quantity, step, own.ringing)
    by_state = slopes.states
    if followed is not None:
        by_state = _with_random_force(slopes)
    propagation = propagate(by_state, step) if exact is None else exact.propagation
    if followed is not None:
        propagation.forward[-1][-1] = propagation.forward[-1][-1] * followed.memory
    readings = tuple(entry.reading for entry in by_state)
    group = _Group(propagation, readings, weight, gains)
    for source in _sources(layout, step, batch, slopes, exact, states[size:], columns, part):
        group.add(*source)
        if group.is_full:
            group.solve(table)
    for index in range(size):
        group.start(columns - 1 - size + index, index, np.asarray(scales[index]))
        if group.is_full:
            group.solve(table)
    group.solve(table)
    if sampling.whitening is not None:
        rows = on_device(table.transpose(2, 1, 0))
        return np.moveaxis(np.asarray(_weigh(rows, batch.weight, sampling.whitening)), -1, 0)
    other = np.swapaxes(table, 1, 2)
    if followed is not None:
        piece = np.asarray(followed.piece).T[..., None] == np.arange(SCORE_PIECES)
        other = np.concatenate([other, table[:, -1, :, None] * piece], axis=2)
    # Where an internal state of a probe diverged its products are infinite.
    with np.errstate(over="ignore", invalid="ignore"):
        return table @ other


def _sources(
    layout: _Layout,
    step: Scalar,
    batch: Batch,
    slopes: Slopes,
    exact: Transitions | None,
    internal: State,
    columns: int,
    part: int,
) -> Iterator[tuple[int, np.ndarray | float, np.ndarray, np.ndarray | float]]:
    """Give each coefficient's column, change of the rates (row time lanes), of the reading (time lanes).

    Last comes what it adds over each sample (row time lanes), in place of the change of the rates, where
    the model's laws jump.
    """
    size = 2 + layout.model.internal_states

    def ready(unit: float, change: Change) -> tuple[np.ndarray, np.ndarray]:
        forcing = unit * np.stack([np.asarray(row) for row in change.rates])
        return forcing, unit * np.asarray(change.reading)

    def own(unit: float, change: Change, place: int) -> tuple:
        forcing, direct = ready(unit, change)
        if exact is None:
            return forcing, direct, 0.0
        added = exact.scale if place < 0 else exact.parameters[:, place]
        return 0.0, direct, unit * np.asarray(added)

    for place, (column, change) in enumerate(zip(layout.places[0], slopes.parameters, strict=True)):
        yield column, *own(layout.units[column], change, place)
    scaled = columns - 1 - size
    if scaled > len(layout.units):
        change = slopes.states[0] if slopes.scale is None else slopes.scale
        # A model without a spring has no stiffness to scale, whatever a probe would bring.
        unit = 0.0 if slopes.scale is None else STIFFNESS_SCALE_UNIT
        yield scaled - 1, *own(unit, change, -1)
    starts = stack_states(layout.families, layout.probes, internal)
    inputs = {name: ready(1.0, change) for name, change in slopes.inputs.items()}
    ends = np.cumsum([0, *(family.elements.internal_states for family in layout.families)])
    shares = dict(zip((family.places for family in layout.families), itertools.pairwise(ends), strict=True))
    for family in in_turn(layout.families, part):
        begin, end = shares[family.places]
        own_channels = {name: batch.channels[name] for name in family.elements.channels}
        pushing = {name: impulse_at_samples(values) for name, values in own_channels.items()}
        added = input_columns(family, slopes.motion._replace(channels=pushing), starts[begin:end], step)
        read = added
        if own_channels:
            # A reading is that of the sample itself, at whose start every hold agrees with the record.
            reading = {name: values[:, 0] for name, values in own_channels.items()}
            seen = slopes.motion._replace(channels=reading)
            read = input_columns(family, seen, starts[begin:end], step)
        does = [(np.asarray(added[name]), np.asarray(read[name]), inputs[name]) for name in added]
        for member, probe in enumerate(family.places):
            column = layout.places[1][probe]
            if column >= 0:
                unit = layout.units[column]
                # Where an internal state diverged its products are not finite.
                with np.errstate(over="ignore", invalid="ignore"):
                    forcing = sum(unit * values[member] * rates for values, _, (rates, _) in does)
                    direct = sum(unit * values[member] * reading for _, values, (_, reading) in does)
                yield column, np.asarray(forcing), np.asarray(direct), 0.0


def _with_random_force(slopes: Slopes) -> tuple[Change, ...]:
    """Give the slopes with each state, and with the random force behind them: constant over a sample."""
    still = jnp.zeros_like(slopes.states[0].reading)
    pushed = slopes.inputs["recorded"]
    own = Change(
        (*(still + rate for rate in pushed.rates), still),
        still + pushed.reading,
    )
    return (*(Change((*one.rates, still), one.reading) for one in slopes.states), own)


class _Group:
    """Columns that wait for one linear solve."""

    def __init__(
        self,
        propagation: Propagation,
        readings: tuple[Array, ...],
        weight: Array,
        gains: State,
    ):
        self.propagation, self.readings, self.weight, self.gains = propagation, readings, weight, gains
        size, (time, lanes) = len(readings), weight.shape
        self.forcing = np.zeros((size - 1, time, _TOGETHER, lanes))
        self.kicks: np.ndarray | None = None
        self.kick_shape = (size + 2, time, _TOGETHER, lanes)
        self.direct = np.zeros((time, _TOGETHER, lanes))
        self.starts = np.zeros((size, _TOGETHER, lanes))
        self.columns: list[int] = []

    @property
    def is_full(self) -> bool:
        """Whether no more columns fit."""
        return len(self.columns) == _TOGETHER

    def add(
        self,
        column: int,
        forcing: np.ndarray | float,
        direct: np.ndarray | float,
        kick: np.ndarray | float = 0.0,
    ) -> None:
        """Put a column that is pushed along the motion."""
        place = len(self.columns)
        rows = (
            np.shape(forcing)[0] if np.ndim(forcing) else len(self.forcing)
        )  # nothing pushes a random force
        self.forcing[rows:, :, place] = 0.0
        self.forcing[:rows, :, place], self.direct[:, place], self.starts[:, place] = forcing, direct, 0.0
        if np.ndim(kick):
            # Coefficients of a law that jumps: of one group at most, so that the others carry no such table.
            self.kicks = np.zeros(self.kick_shape) if self.kicks is None else self.kicks
            self.kicks[:, :, place] = kick
        self.columns.append(column)

    def start(self, column: int, state: int, size: np.ndarray) -> None:
        """Put a column that starts elsewhere."""
        self.add(column, 0.0, 0.0)
        self.starts[state, len(self.columns) - 1] = size

    def solve(self, table: np.ndarray) -> None:
        """Solve, and put what the readings do into the table."""
        if self.columns:
            forcing, direct, starts = map(on_device, (self.forcing, self.direct, self.starts))
            kicks = None if self.kicks is None else on_device(self.kicks)
            rows = respond(
                self.propagation, self.readings, forcing, kicks, direct, starts, self.weight, self.gains
            )
            # Turned here, and not in compiled code, which takes four times as long.
            table[:, self.columns] = np.asarray(rows).transpose(2, 1, 0)[:, : len(self.columns)]
        self.columns, self.kicks = [], None
