"""Many columns at once: how readings answer small forces, from one simulation and one linear solve.

The derivatives of `information` cost a full step of the model a column. For dozens of absent effects the
motion is simulated once, with the memories of the absent effects following it; the force that each effect
would add and the linearised force balance are worked out along the motion, all samples at once; and one
linear, time-varying solve, which knows nothing of the effects, carries all columns.
"""

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._parameters import list_parameters, own_parameters
from ..elements import AbstractElement
from ..models import RK4, Isolator, Quantity, State
from ._batch import Batch, Prepared, workers
from ._families import Family, find_families, follow_motion, share_states, stack_states
from ._information import STIFFNESS_SCALE_UNIT, Unknowns, has_stiffness_scale, scaled_model, share_lanes


def _nodes(table: Float[Array, "time stage lanes"]) -> Float[Array, "node 3 lanes"]:
    """Split each sample into its integration steps, three stages each."""
    time, stages, lanes = table.shape
    steps = (stages - 1) // 2
    ends = jnp.stack([table[:, 2 * step : 2 * step + 3] for step in range(steps)], axis=1)
    return ends.reshape(time * steps, 3, lanes)


_ENTRIES = 1.5e7
"""Numbers that one table of columns along the motion may hold."""


@eqx.filter_jit
def _path(
    model: Isolator,
    families: tuple[Family, ...],
    scale: Array,
    states: State,
    memories: State,
    batch: Batch,
    quantity: Quantity,
    sample_time: float,
) -> tuple[State, State, Array, Array, dict[str, Array]]:
    """Simulate, the memories of absent effects following.

    Returns:
        At the start of each integration step: the states; those memories; drive, its rate and channels.
    """
    values = tuple(entry.value for entry in list_parameters(model))
    current = scaled_model(model, values, scale)
    drive, rate = _nodes(batch.drive), _nodes(batch.drive_rate)
    channels = {name: _nodes(values) for name, values in batch.channels.items()}
    step = sample_time * batch.drive.shape[0] / drive.shape[0]
    solver, size = RK4(), len(states)

    def field(t: float, state: State, args: tuple[Any, Any, Any]) -> State:
        place = round(2.0 * t)
        u, du, beside = args[0][place], args[1][place], {name: at[place] for name, at in args[2].items()}
        own = state[:size]
        rates = current.rates(own, u, du, quantity, channels=beside)
        y = current.reading(own, u, du, quantity, beside)
        base = current.drive(u, du, beside) if current.excitation == "base_acceleration" else None
        followed: list[Array] = []
        for family, internal in zip(families, share_states(families, state[size:]), strict=True):
            if not family.states:
                continue

            def follow(element: AbstractElement, s: State) -> State:
                return follow_motion(element, own[0], own[1], y, base, s)

            followed.extend(jax.vmap(follow)(family.elements, internal))
        return tuple(step * value for value in (*rates, *followed))

    term = diffrax.ODETerm(field)  # pyright: ignore[reportArgumentType]

    def body(state: State, table: tuple) -> tuple[State, State]:
        moved, *_ = solver.step(term, 0.0, 1.0, state, table, None, False)
        return moved, state

    _, path = jax.lax.scan(body, (*states, *memories), (drive, rate, channels))
    starts = {name: values[:, 0] for name, values in channels.items()}
    return path[:size], path[size:], drive[:, 0], rate[:, 0], starts


_Change = tuple[tuple[Array, ...], Array]
"""Change of the rates of the carried states but the first, whose rate is the velocity; and of the reading."""


@eqx.filter_jit
def _partials(
    model: Isolator,
    families: tuple[Family, ...],
    moving: tuple[int, ...],
    scale: Array,
    path: State,
    memories: State,
    u: Array,
    du: Array,
    channels: dict[str, Array],
    quantity: Quantity,
) -> tuple[Array, list[_Change], list[_Change], list[_Change]]:
    """Differentiate rates and reading along the path.

    Returns:
        The reading; the changes with each parameter that moves; with the strength of each absent effect; with
        the stiffness scale, where there is one, and each state.
    """
    values = tuple(entry.value for entry in list_parameters(model))

    def along(current: Isolator, state: State, internal: State = ()) -> _Change:
        late = current.shift() - jax.lax.stop_gradient(current.shift())
        full, acted = (*state, *internal), u - late * du
        rates = current.rates(full, acted, du, quantity, channels=channels)[1 : len(state)]
        return rates, current.reading(full, acted, du, quantity, channels)

    def both(values: tuple[Array, ...], scale: Array, state: State) -> _Change:
        return along(scaled_model(model, values, scale), state)

    (_, reading) = both(values, scale, path)
    by_parameter = []
    for place in moving:

        def with_number(number: Array, place: int = place) -> _Change:
            return both((*values[:place], number, *values[place + 1 :]), scale, path)

        by_parameter.append(jax.jvp(with_number, (values[place],), (jnp.ones(()),))[1])

    present = scaled_model(model, values, scale)
    by_probe: dict[int, _Change] = {}
    for family, own in zip(families, share_states(families, memories), strict=True):

        def by_strength(element: AbstractElement, strength: Array, internal: State) -> _Change:
            def with_strength(number: Array) -> _Change:
                probe = eqx.tree_at(lambda e: getattr(e, e.strength), element, number)
                extended = Isolator(present.mass, (*present.elements, probe), present.excitation)
                return along(extended, path, internal)

            return jax.jvp(with_strength, (strength,), (jnp.ones(()),))[1]

        # Along the path the members of a family come after time.
        internal = tuple(jnp.moveaxis(values, 1, 0) for values in own)
        changes = jax.vmap(by_strength)(family.elements, family.strengths, internal)
        for member, place in enumerate(family.places):
            by_probe[place] = jax.tree_util.tree_map(lambda values, member=member: values[member], changes)

    by_state = []
    if has_stiffness_scale(model):
        by_state.append(jax.jvp(lambda s: both(values, s, path), (scale,), (jnp.ones_like(scale),))[1])
    for index in range(len(path)):

        def shifted(number: Array, index: int = index) -> _Change:
            return both(values, scale, (*path[:index], number, *path[index + 1 :]))

        by_state.append(jax.jvp(shifted, (path[index],), (jnp.ones_like(path[index]),))[1])
    return reading, by_parameter, [by_probe[place] for place in sorted(by_probe)], by_state


@eqx.filter_jit
def _respond(
    slopes: Float[Array, "node row state lanes"],
    forcing: Float[Array, "node row column lanes"],
    starts: Float[Array, "state column lanes"],
    step: float,
) -> Float[Array, "node state column lanes"]:
    """Solve `d' = A(t) d + b(t)` for all columns; between nodes A and b follow cubics through four."""
    size = starts.shape[0]
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

    def middle(before: Array, left: Array, right: Array, after: Array) -> Array:
        return (9.0 * (left + right) - before - after) / 16.0

    def body(carry: tuple, ahead: tuple[Array, Array]) -> tuple[tuple, tuple[Array, ...]]:
        d, a, b = carry
        a, b = (*a, ahead[0]), (*b, ahead[1])
        table = (
            (a[1], middle(a[0], a[1], a[2], a[3]), a[2]),
            (b[1], middle(b[0], b[1], b[2], b[3]), b[2]),
        )
        moved, *_ = solver.step(term, 0.0, 1.0, d, table, None, False)
        return (moved, a[1:], b[1:]), d

    def ahead(values: Array) -> Array:
        return jnp.concatenate([values[2:], values[-1:], values[-1:]])

    first = (slopes[0], slopes[0], slopes[1]), (forcing[0], forcing[0], forcing[1])
    start = (tuple(starts[index] for index in range(size)), *first)
    return jnp.stack(jax.lax.scan(body, start, (ahead(slopes), ahead(forcing)))[1], axis=1)


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
    whole = unknowns.model
    model = Isolator(whole.mass, whole.elements[:carried], whole.excitation)
    probes = whole.elements[carried:]
    families = find_families(probes)
    size = 2 + model.internal_states
    moving = tuple(int(np.flatnonzero(column)[0]) for column in unknowns.directions.T)
    units = [float(unknowns.directions[place, index]) for index, place in enumerate(moving)]
    known = len(list_parameters(model))
    own = tuple(place for place in moving if place < known)
    # Which probe each further direction belongs to.
    owner = np.repeat(np.arange(len(probes)), [len(own_parameters(probe)) for probe in probes])
    columns = [own.index(place) if place < known else len(own) + owner[place - known] for place in moving]
    scaled, wanted = has_stiffness_scale(model), has_stiffness_scale(whole)
    if wanted:
        units.append(STIFFNESS_SCALE_UNIT)

    def one(part: int) -> np.ndarray:
        batch = prepared.batches[part].following(whole)
        scale = share_lanes(unknowns.stiffness_scale[None], part, parts)[0]
        states = share_lanes(unknowns.states, part, parts)
        scales = share_lanes(unknowns.state_scales[:size], part, parts)
        lanes = scale.shape[0]
        # A table of all columns along all lanes may not fit the memory: a few lanes at a time.
        entries = batch.drive.shape[0] * (batch.drive.shape[1] // 2) * (len(units) + whole.internal_states)
        blocks = -(-lanes // max(1, int(_ENTRIES / entries)))
        width = -(-lanes // blocks)
        done = []
        for first in range(0, lanes, width):
            chosen = np.minimum(np.arange(first, first + width), lanes - 1)
            some = jax.tree_util.tree_map(
                lambda values, chosen=chosen: values[..., chosen], (batch, scale, states, scales)
            )
            done.append(block(*some)[: lanes - first])
        return np.concatenate(done)

    def block(batch: Batch, scale: Array, states: State, scales: State) -> np.ndarray:
        memories = stack_states(families, probes, states[size:])
        path, memories, u, du, channels = _path(
            model, families, scale, states[:size], memories, batch, prepared.quantity, prepared.sample_time
        )
        lanes, nodes = scale.shape[0], u.shape[0]
        steps = nodes // batch.measured.shape[0]
        wide = jnp.broadcast_to(scale, u.shape)
        reading, by_parameter, by_probe, by_state = _partials(
            model, families, own, wide, path, memories, u, du, channels, prepared.quantity
        )
        del memories
        by_parameter = [[*by_parameter, *by_probe][column] for column in columns]
        if wanted:
            nothing = jax.tree_util.tree_map(jnp.zeros_like, by_state[0])
            by_parameter.append(by_state[0] if scaled else nothing)
        by_state = by_state[-size:]
        rest = [jnp.zeros_like(u)] * size
        forcing = jnp.stack(
            [
                jnp.stack(
                    [unit * entry[0][row] for unit, entry in zip(units, by_parameter, strict=True)] + rest,
                    axis=1,
                )
                for row in range(size - 1)
            ],
            axis=1,
        )
        slopes = jnp.stack(
            [jnp.stack([entry[0][row] for entry in by_state], axis=1) for row in range(size - 1)], axis=1
        )
        count = len(units)
        starts = np.zeros((size, count + size, lanes))
        for index in range(size):
            starts[index, count + index] = np.asarray(scales[index])
        response = _respond(slopes, forcing, jnp.asarray(starts), prepared.sample_time / steps)
        del forcing, slopes
        readings_by_parameter = [entry[1] for entry in by_parameter]
        readings_by_state = [entry[1] for entry in by_state]
        return np.asarray(
            _products(
                response, reading, jnp.asarray(units), readings_by_parameter, readings_by_state, batch, steps
            )
        )

    with ThreadPoolExecutor(workers()) as pool:
        return np.concatenate(list(pool.map(one, range(parts))))


@eqx.filter_jit
def _products(
    response: Float[Array, "node state column lanes"],
    reading: Float[Array, "node lanes"],
    units: Float[Array, " parameter"],
    by_parameter: list[Array],
    by_state: list[Array],
    batch: Batch,
    steps: int,
) -> Float[Array, "lanes entry entry"]:
    """Form the readings' columns and multiply them out, lane by lane."""
    rows = sum(response[::steps, index] * slope[::steps, None] for index, slope in enumerate(by_state))
    direct = jnp.stack([slope[::steps] for slope in by_parameter], axis=1) * units[None, :, None]
    rows = rows + jnp.pad(direct, ((0, 0), (0, len(by_state)), (0, 0)))
    last = (batch.measured - reading[::steps])[:, None]
    table = jnp.concatenate([rows, last], axis=1) * batch.weight[:, None]
    return jnp.einsum("tcl,tdl->lcd", table, table)
