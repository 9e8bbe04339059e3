"""Segments simulated by a diffrax solver with its own steps and tolerances, and differentiated through it."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..._parameters import list_parameters
from ...models import Instant, Integrator, Isolator, Quantity, State, solve_record
from ._batch import Batch
from ._unknowns import movable, scaled_model, unit_changes
from ._whitening import Whitening, whitened_products


def _solve_lanes(
    integrator: Integrator,
    jumps: bool,
    model: Isolator,
    values: tuple[Array, ...],
    scale: Array,
    states: State,
    batch: Batch,
    quantity: Quantity,
    sample_time: float,
    observed: int = 1,
) -> tuple[State, Array]:
    """Solve each lane with steps of its own; give its states, `observed` a sample, and its readings."""

    def lane(scale: Array, state: State, record: Instant) -> tuple[State, Array]:
        current = scaled_model(model, values, scale)
        path = solve_record(current, integrator, quantity, sample_time, state, record, observed, jumps)
        at = current.with_delay_slope(record.pick(np.s_[:, 0]))
        return path, current.reading(tuple(one[::observed] for one in path), at, quantity)

    return jax.vmap(lane, in_axes=-1, out_axes=-1)(scale, states, batch.acting)


@eqx.filter_jit
def solved_information(
    integrator: Integrator,
    jumps: bool,
    model: Isolator,
    moving: tuple[int, ...],
    directions: tuple[Array, ...],
    columns: int,
    scale: Array,
    states: State,
    state_scales: State,
    batch: Batch,
    quantity: Quantity,
    sample_time: float,
    whitening: Whitening | None,
) -> Float[Array, "column column lanes"]:
    """Differentiate the solver's readings forward, and multiply out A^T W A; see `fixed_information`."""
    known, with_moved = movable(model, moving)
    changes = unit_changes(model, directions, columns, state_scales)

    def read(moved: tuple[Array, ...], scale: Array, states: State) -> Array:
        values = with_moved(moved)
        return _solve_lanes(integrator, jumps, model, values, scale, states, batch, quantity, sample_time)[1]

    def along(seed: tuple[Array, ...], scale_seed: Array, tangent: State) -> tuple[Array, Array]:
        return jax.jvp(read, (known, scale, states), (seed, scale_seed, tangent))

    reading, slopes = jax.vmap(along, out_axes=(None, 0))(*changes)
    rows = jnp.concatenate([slopes, (batch.measured - reading)[None]]) * batch.weight[None]
    if whitening is not None:
        return whitened_products(rows.swapaxes(0, 1), batch.weight, whitening)
    return jnp.einsum("itl,jtl->ijl", rows, rows)


@eqx.filter_jit
def solved_readings(
    integrator: Integrator,
    jumps: bool,
    model: Isolator,
    scale: Array,
    states: State,
    batch: Batch,
    quantity: Quantity,
    sample_time: float,
) -> Float[Array, "time lanes"]:
    """Simulate; give what the sensor chain records."""
    values = tuple(entry.value for entry in list_parameters(model))
    return _solve_lanes(integrator, jumps, model, values, scale, states, batch, quantity, sample_time)[1]


@eqx.filter_jit
def solved_path(
    integrator: Integrator,
    jumps: bool,
    model: Isolator,
    scale: Array,
    states: State,
    batch: Batch,
    quantity: Quantity,
    sample_time: float,
) -> tuple[State, None]:
    """Simulate; give the states at the start of each step of the tables. No law is split, nothing rings."""
    values = tuple(entry.value for entry in list_parameters(model))
    steps = (batch.drive.shape[1] - 1) // 2
    how = integrator, jumps, model, values
    return _solve_lanes(*how, scale, states, batch, quantity, sample_time, observed=steps)[0], None
