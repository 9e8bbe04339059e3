"""Many columns at once: how readings answer small forces, from one simulation and one linear solve.

The derivatives of `information` cost a full step of the model a column. For dozens of absent effects the
motion is simulated once, with the memories of the absent effects following it; the force that each effect
would add and the linearised force balance are worked out along the motion, all samples at once; and one
linear, time-varying solve, which knows nothing of the effects, carries all columns.
"""

from concurrent.futures import ThreadPoolExecutor

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._parameters import list_parameters
from ..models import RK4, Isolator, Quantity, State, scan_records
from ._batch import Batch, Prepared, workers
from ._information import STIFFNESS_SCALE_UNIT, Unknowns, has_stiffness_scale, scaled_model, share_lanes


def _nodes(table: Float[Array, "time stage lanes"]) -> Float[Array, "node 3 lanes"]:
    """Split each sample into its integration steps, three stages each."""
    time, stages, lanes = table.shape
    steps = (stages - 1) // 2
    ends = jnp.stack([table[:, 2 * step : 2 * step + 3] for step in range(steps)], axis=1)
    return ends.reshape(time * steps, 3, lanes)


@eqx.filter_jit
def _path(
    model: Isolator, scale: Array, states: State, batch: Batch, quantity: Quantity, sample_time: float
) -> tuple[State, Array, Array, dict[str, Array]]:
    """Simulate; give states, drive, its rate and channels at the start of each integration step."""
    values = tuple(entry.value for entry in list_parameters(model))
    current = scaled_model(model, values, scale)
    drive, rate = _nodes(batch.drive), _nodes(batch.drive_rate)
    step = sample_time * batch.drive.shape[0] / drive.shape[0]
    channels = {name: _nodes(values) for name, values in batch.channels.items()}
    _, path = scan_records(
        current, RK4(), quantity, step, states, drive, rate, lambda state, u, du: state, channels
    )
    return path, drive[:, 0], rate[:, 0], {name: values[:, 0] for name, values in channels.items()}


@eqx.filter_jit
def _partials(
    model: Isolator,
    carried_states: int,
    moving: tuple[int, ...],
    scale: Array,
    path: State,
    u: Array,
    du: Array,
    channels: dict[str, Array],
    quantity: Quantity,
) -> tuple[Array, list[tuple[tuple[Array, ...], Array]], list[tuple[tuple[Array, ...], Array]]]:
    """Differentiate rates and reading along the path.

    Returns:
        The reading; then, for each parameter that moves and for the stiffness scale, and for each carried
        state, the change of the rates of the carried states but the first (whose rate is the velocity) and of
        the reading.
    """
    values = tuple(entry.value for entry in list_parameters(model))

    def both(values: tuple[Array, ...], scale: Array, state: State) -> tuple[tuple[Array, ...], Array]:
        current = scaled_model(model, values, scale)
        late = current.shift() - jax.lax.stop_gradient(current.shift())
        full = (*state, *path[carried_states:])
        rates = current.rates(full, u - late * du, du, quantity, channels=channels)[1:carried_states]
        return rates, current.reading(full, u - late * du, du, quantity, channels)

    state = path[:carried_states]
    (_, reading) = both(values, scale, state)
    by_parameter = []
    for place in moving:

        def along(number: Array, place: int = place) -> tuple[tuple[Array, ...], Array]:
            return both((*values[:place], number, *values[place + 1 :]), scale, state)

        by_parameter.append(jax.jvp(along, (values[place],), (jnp.ones(()),))[1])
    if has_stiffness_scale(model):
        by_parameter.append(jax.jvp(lambda s: both(values, s, state), (scale,), (jnp.ones_like(scale),))[1])
    by_state = []
    for index in range(carried_states):

        def shifted(number: Array, index: int = index) -> tuple[tuple[Array, ...], Array]:
            return both(values, scale, (*state[:index], number, *state[index + 1 :]))

        by_state.append(jax.jvp(shifted, (state[index],), (jnp.ones_like(state[index]),))[1])
    return reading, by_parameter, by_state


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
    model = unknowns.model
    size = 2 + sum(element.internal_states for element in model.elements[:carried])
    moving = tuple(int(np.flatnonzero(column)[0]) for column in unknowns.directions.T)
    units = [float(unknowns.directions[place, index]) for index, place in enumerate(moving)]
    if has_stiffness_scale(model):
        units.append(STIFFNESS_SCALE_UNIT)

    def one(part: int) -> np.ndarray:
        batch = prepared.batches[part].following(model)
        scale = share_lanes(unknowns.stiffness_scale[None], part, parts)[0]
        states = share_lanes(unknowns.states, part, parts)
        path, u, du, channels = _path(model, scale, states, batch, prepared.quantity, prepared.sample_time)
        lanes, nodes = scale.shape[0], u.shape[0]
        steps = nodes // batch.measured.shape[0]
        wide = jnp.broadcast_to(scale, u.shape)
        reading, by_parameter, by_state = _partials(
            model, size, moving, wide, path, u, du, channels, prepared.quantity
        )
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
        scales = share_lanes(unknowns.state_scales[:size], part, parts)
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
