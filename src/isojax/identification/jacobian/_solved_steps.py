"""Segments simulated by a diffrax solver with its own steps and tolerances, and differentiated through it."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..._parameters import list_parameters
from ..._quick_jit import quick_jit
from ...models import Instant, State, solve_record
from ._batch import Batch, Sampling
from ._unknowns import Lanes, movable, scaled_model, unit_changes
from ._whitening import whitened_products


def _solve_lanes(
    start: Lanes, values: tuple[Array, ...], batch: Batch, sampling: Sampling, observed: int = 1
) -> tuple[State, Array]:
    """Solve each lane with steps of its own; give its states, `observed` a sample, and its readings."""
    quantity, sample_time, integrator, jumps, *_ = sampling

    def lane(scale: Array, state: State, record: Instant) -> tuple[State, Array]:
        current = scaled_model(start.model, values, scale)
        path = solve_record(current, integrator, quantity, sample_time, state, record, observed, jumps)
        at = current.with_delay_slope(record.pick(np.s_[:, 0]))
        return path, current.reading(tuple(one[::observed] for one in path), at, quantity)

    return jax.vmap(lane, in_axes=-1, out_axes=-1)(start.stiffness_scale, start.states, batch.acting)


@quick_jit
def solved_information(
    start: Lanes,
    moving: tuple[int, ...],
    directions: Float[Array, "moving coefficient"],
    state_scales: State,
    batch: Batch,
    sampling: Sampling,
) -> Float[Array, "column column lanes"]:
    """Differentiate the solver's readings forward, and multiply out A^T W A; see `fixed_information`."""
    model, scale, states = start
    known, with_moved = movable(model, moving)
    changes = unit_changes(model, directions, state_scales)

    def read(moved: tuple[Array, ...], scale: Array, states: State) -> Array:
        return _solve_lanes(Lanes(model, scale, states), with_moved(moved), batch, sampling)[1]

    def along(seed: tuple[Array, ...], scale_seed: Array, tangent: State) -> tuple[Array, Array]:
        return jax.jvp(read, (known, scale, states), (seed, scale_seed, tangent))

    reading, slopes = jax.vmap(along, out_axes=(None, 0))(*changes)
    rows = jnp.concatenate([slopes, (batch.measured - reading)[None]]) * batch.weight[None]
    if sampling.whitening is not None:
        return whitened_products(rows.swapaxes(0, 1), batch.weight, sampling.whitening)
    return jnp.einsum("itl,jtl->ijl", rows, rows)


@quick_jit
def solved_readings(start: Lanes, batch: Batch, sampling: Sampling) -> Float[Array, "time lanes"]:
    """Simulate; give what the sensor chain records."""
    values = tuple(entry.value for entry in list_parameters(start.model))
    return _solve_lanes(start, values, batch, sampling)[1]


@quick_jit
def solved_path(start: Lanes, batch: Batch, sampling: Sampling) -> tuple[State, None]:
    """Simulate; give the states at the start of each step of the tables. No law is split, nothing rings."""
    values = tuple(entry.value for entry in list_parameters(start.model))
    steps = (batch.drive.shape[1] - 1) // 2
    return _solve_lanes(start, values, batch, sampling, observed=steps)[0], None
