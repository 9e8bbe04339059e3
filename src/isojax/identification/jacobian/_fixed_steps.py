"""Segments simulated by RK4 from sample to sample, under one scan, and split where a law jumps."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..._kernel_scan import in_one_kernel, kernel_scan
from ..._parameters import list_parameters
from ..._quick_jit import quick_jit
from ...models import (
    RK4,
    Instant,
    Isolator,
    Ringing,
    State,
    Step,
    advance,
    advance_record,
    find_ringing,
    read_record,
    split_stages,
    split_step,
)
from ._batch import Batch, Sampling
from ._slopes import steps_of
from ._unknowns import Lanes, movable, scaled_model, unit_changes
from ._whitening import whitened_products


def _sampler(
    model: Isolator, batch: Batch, sampling: Sampling
) -> Callable[..., tuple[Array, State, Array | None]]:
    """Give the function that reads one sample and steps to the next, the model's numbers as arguments.

    Last it gives what jumps on the way leave in the next reading.
    """
    solver, quantity = RK4(), sampling.quantity

    def sample(
        values: tuple[Array, ...], scale: Array, state: State, stages: tuple[Instant, ...]
    ) -> tuple[Array, State, Array | None]:
        current = scaled_model(model, values, scale)
        stages = tuple(current.with_delay_slope(at) for at in stages)
        reading = read_record(current, state, stages[0], quantity)
        ahead, ringing = advance_record(current, solver, quantity, sampling.time, state, stages)
        if ringing is None:
            return reading, ahead, None
        return reading + batch.ringing * ringing.before, ahead, batch.ringing * ringing.after

    return sample


def _scan_first(
    body: Callable[[Any, Any], tuple[Any, Any]], begun: Any, tables: Any, count: Array, row: Any
) -> tuple[Any, Any]:
    """Do what `jax.lax.scan` does with the first samples, whose count the compiled code does not depend on.

    What the body gives is zero after them: `row`, as of one sample. To ask the body for its shape would take
    as long as to trace it.
    """

    def at(place: Array) -> Any:
        return jax.tree.map(lambda table: jax.lax.dynamic_index_in_dim(table, place, keepdims=False), tables)

    time = jax.tree.leaves(tables)[0].shape[0]
    blank = jax.tree.map(lambda one: jnp.broadcast_to(one, (time, *one.shape)), row)

    def step(place: Array, carry: tuple) -> tuple:
        state, one = body(carry[0], at(place))
        return state, jax.tree.map(
            lambda rows, row: jax.lax.dynamic_update_index_in_dim(rows, row, place, 0), carry[1], one
        )

    return in_one_kernel(lambda *loop: jax.lax.fori_loop(0, loop[0], step, loop[1:]), count, begun, blank)


@quick_jit
def fixed_information(
    start: Lanes,
    moving: tuple[int, ...],
    directions: Float[Array, "moving coefficient"],
    state_scales: State,
    batch: Batch,
    sampling: Sampling,
) -> Float[Array, "column column lanes"]:
    """Accumulate A^T W A over the samples of each lane; A holds the columns and, last, the residual.

    White noise weighs each sample by itself, so that no row need be kept.
    """
    model, scale, states = start
    known, with_moved = movable(model, moving)
    sample = _sampler(model, batch, sampling)
    changes = unit_changes(model, directions, state_scales)
    total, lanes = changes.scale.shape

    def body(carry: tuple, table: tuple) -> tuple[tuple, Array | None]:
        state, tangent, gram, pending = carry
        acting, measured, weight = table
        stages = split_stages(acting)

        def along(seed: tuple[Array, ...], scale_seed: Array, tangent: State) -> tuple:
            primal, change = jax.jvp(
                lambda moved, scale, state: sample(with_moved(moved), scale, state, stages),
                (known, scale, state),
                (seed, scale_seed, tangent),
            )
            return primal, change

        (reading, state, after), change = jax.vmap(along, out_axes=(None, 0))(
            changes.parameters, changes.scale, tangent
        )
        rows = jnp.concatenate([change[0], (measured - reading)[None]])
        if pending is not None:
            rows, pending = rows + pending, jnp.concatenate([change[2], -after[None]])
        rows = rows * weight[None]
        if sampling.whitening is not None:
            return (state, change[1], gram, pending), rows
        return (state, change[1], gram + rows[:, None] * rows[None], pending), None

    silent = jnp.zeros((total + 1, lanes)) if model.splits else None
    begun = (states, changes.states, jnp.zeros((total + 1, total + 1, lanes)), silent)
    tables = (batch.acting, batch.measured, batch.weight)
    row = None if sampling.whitening is None else jnp.zeros((total + 1, lanes))
    carry, rows = _scan_first(body, begun, tables, batch.count, row)
    if sampling.whitening is None or rows is None:
        return carry[2]
    return whitened_products(rows, batch.weight, sampling.whitening)


@quick_jit
def fixed_readings(start: Lanes, batch: Batch, sampling: Sampling) -> Float[Array, "time lanes"]:
    """Simulate; give what the sensor chain records."""
    model, scale, states = start
    values = tuple(entry.value for entry in list_parameters(model))
    sample = _sampler(model, batch, sampling)

    def body(carry: tuple[State, Array | None], table: Instant) -> tuple[tuple[State, Array | None], Array]:
        state, pending = carry
        reading, state, after = sample(values, scale, state, split_stages(table))
        return (state, after), reading if pending is None else reading + pending

    begun = (states, jnp.zeros_like(scale) if model.splits else None)
    return _scan_first(body, begun, batch.acting, batch.count, jnp.zeros_like(scale))[1]


@quick_jit
def fixed_path(start: Lanes, batch: Batch, sampling: Sampling) -> tuple[State, Ringing | None]:
    """Simulate; give the states at the start of each integration step, and the ringing of jumps."""
    model, scale, states = start
    values = tuple(entry.value for entry in list_parameters(model))
    current = scaled_model(model, values, scale)
    acting = jax.tree_util.tree_map(steps_of, batch.acting)
    time = batch.drive.shape[0]
    steps = acting.drive.shape[0] // time
    quantity, step_time = sampling.quantity, sampling.time / steps
    solver = RK4()

    def body(state: State, table: tuple) -> tuple[State, tuple[State, Ringing | None]]:
        number, stages = table[0], split_stages(table[1])
        if not model.splits:
            return advance(current, solver, quantity, step_time, state, stages), (state, None)
        ahead, jump = split_step(current, quantity, state, Step(step_time, stages))
        return ahead, (state, find_ringing(jump, number, steps))

    numbers = jnp.tile(jnp.arange(steps), time)
    path, ringing = kernel_scan(body, states, (numbers, acting))[1]
    return path, jax.tree_util.tree_map(
        lambda one: batch.ringing * one.reshape(time, steps, -1).sum(axis=1), ringing
    )
