"""The information that segments hold: products of residuals and of derivatives of their simulation."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..._parameters import find_parameter, list_parameters, replace_parameters
from ...models import RK4, Instant, Isolator, Quantity, State, advance_record, read_record, split_stages
from ._batch import Batch, Prepared, workers
from ._channels import elapsed


class Unknowns(NamedTuple):
    """Where the simulation stands and along which directions it is differentiated.

    Attributes:
        model: the isolator.
        directions: changes of the model's parameters, one column each, in the order of `list_parameters`.
        stiffness_scale: factor on the linear stiffness, a lane each.
        states: state at each lane's first sample.
        state_scales: size of one unit of change of each state.
    """

    model: Isolator
    directions: Float[np.ndarray, "parameter column"]
    stiffness_scale: Float[np.ndarray, " lanes"]
    states: Float[np.ndarray, "state lanes"]
    state_scales: Float[np.ndarray, "state lanes"]


STIFFNESS_SCALE_UNIT = 1e-3
"""One unit of the column of the stiffness scale: a tenth of a percent."""


def _stiffness_place(model: Isolator) -> int | None:
    spring = next((one for one in model.elements if one.proportional_to == "displacement"), None)
    return None if spring is None else find_parameter(model, f"{spring.name}.{spring.strength}")


def scaled_model(model: Isolator, values: Sequence[Array], scale: Array) -> Isolator:
    """Give a model with other numbers, its linear stiffness scaled lane by lane.

    Args:
        model: the isolator.
        values: one value a parameter, in the order of `list_parameters`.
        scale: factor on the linear stiffness.

    Returns:
        The isolator.
    """
    numbers = list(values)
    place = _stiffness_place(model)
    if place is not None:
        numbers[place] = numbers[place] * scale
    return replace_parameters(model, numbers)


def with_delay_slope(model: Isolator, at: Instant) -> Instant:
    """Give an instant of a table of the delayed drive the derivative with respect to the delay, too.

    Args:
        model: the isolator, whose delay the table has.
        at: what acts.

    Returns:
        The instant, its numbers unchanged.
    """
    delay = model.shift(elapsed(at.channels))
    return at.delayed(delay - jax.lax.stop_gradient(delay))


def has_stiffness_scale(model: Isolator) -> bool:
    """Say whether the model has a linear spring, whose stiffness may differ from record to record.

    Args:
        model: the isolator.

    Returns:
        True if it has.
    """
    return _stiffness_place(model) is not None


def _sampler(
    model: Isolator, quantity: Quantity, sample_time: float
) -> Callable[..., tuple[Array, State, Array | None]]:
    """Give the function that reads one sample and steps to the next, the model's numbers as arguments.

    Last it gives what jumps on the way leave in the next reading.
    """
    solver = RK4()

    def sample(
        values: tuple[Array, ...], scale: Array, state: State, stages: tuple[Instant, ...]
    ) -> tuple[Array, State, Array | None]:
        current = scaled_model(model, values, scale)
        stages = tuple(with_delay_slope(current, at) for at in stages)
        reading = read_record(current, state, stages[0], quantity)
        ahead, ringing = advance_record(current, solver, quantity, sample_time, state, stages)
        return (reading, ahead, None) if ringing is None else (reading + ringing.before, ahead, ringing.after)

    return sample


@eqx.filter_jit
def _lane_information(
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
) -> Float[Array, "column column lanes"]:
    """Accumulate A^T W A over the samples of each lane; A holds the columns and, last, the residual."""
    values = tuple(entry.value for entry in list_parameters(model))
    sample = _sampler(model, quantity, sample_time)
    lanes = scale.shape[0]
    has_scale = _stiffness_place(model) is not None
    total = columns + int(has_scale) + len(states)

    seeds = tuple(jnp.concatenate([seed, jnp.zeros(total - columns)]) for seed in directions)
    scale_seed = jnp.zeros((total, lanes))
    if has_scale:
        scale_seed = scale_seed.at[columns].set(STIFFNESS_SCALE_UNIT)
    tangents = tuple(
        jnp.zeros((total, lanes)).at[total - len(states) + index].set(unit)
        for index, unit in enumerate(state_scales)
    )

    def with_moved(moved: tuple[Array, ...]) -> tuple[Array, ...]:
        # Only what moves is differentiated: the rest would cost as much and give zeros.
        numbers = list(values)
        for place, number in zip(moving, moved, strict=True):
            numbers[place] = number
        return tuple(numbers)

    def body(carry: tuple, table: tuple) -> tuple[tuple, None]:
        state, tangent, gram, pending = carry
        acting, measured, weight = table
        stages = split_stages(acting)

        def along(seed: tuple[Array, ...], scale_seed: Array, tangent: State) -> tuple:
            primal, change = jax.jvp(
                lambda moved, scale, state: sample(with_moved(moved), scale, state, stages),
                (tuple(values[place] for place in moving), scale, state),
                (seed, scale_seed, tangent),
            )
            return primal, change

        (reading, state, after), change = jax.vmap(along, out_axes=(None, 0))(seeds, scale_seed, tangent)
        rows = jnp.concatenate([change[0], (measured - reading)[None]])
        if pending is not None:
            rows, pending = rows + pending, jnp.concatenate([change[2], -after[None]])
        rows = rows * weight[None]
        return (state, change[1], gram + rows[:, None] * rows[None], pending), None

    silent = jnp.zeros((total + 1, lanes)) if model.splits else None
    start = (states, tangents, jnp.zeros((total + 1, total + 1, lanes)), silent)
    tables = (batch.acting, batch.measured, batch.weight)
    carry, _ = jax.lax.scan(body, start, tables)
    return carry[2]


def share_lanes(values: np.ndarray, part: int, parts: int) -> tuple[Array, ...]:
    """Give one worker's lanes."""
    size = values.shape[-1] // parts
    return tuple(jnp.asarray(row[part * size : (part + 1) * size]) for row in values)


def information(unknowns: Unknowns, prepared: Prepared) -> Float[np.ndarray, "lanes column column"]:
    """Give the information matrix of each segment.

    Columns, in this order: the directions; the stiffness scale of the record in units of
    `STIFFNESS_SCALE_UNIT`, if the model has a linear spring; the initial states in their scales; the residual
    (measured - simulated). All in the SI unit of the output, not yet weighted by the noise.

    Args:
        unknowns: where the simulation stands and its directions.
        prepared: the segments.

    Returns:
        A^T A of each lane, lanes first; not finite where a simulation diverged.
    """
    parts = len(prepared.batches)
    model = unknowns.model
    moving = tuple(int(place) for place in np.flatnonzero(unknowns.directions.any(axis=1)))
    directions = tuple(jnp.asarray(unknowns.directions[place]) for place in moving)

    def one(part: int) -> np.ndarray:
        result = _lane_information(
            model,
            moving,
            directions,
            unknowns.directions.shape[1],
            share_lanes(unknowns.stiffness_scale[None], part, parts)[0],
            share_lanes(unknowns.states, part, parts),
            share_lanes(unknowns.state_scales, part, parts),
            prepared.batches[part].following(model),
            prepared.quantity,
            prepared.sample_time,
        )
        return np.moveaxis(np.asarray(result), -1, 0)

    # JAX releases the interpreter while it computes, so that plain threads use every core on one device.
    with ThreadPoolExecutor(workers()) as pool:
        return np.concatenate(list(pool.map(one, range(parts))))


@eqx.filter_jit
def _lane_readings(
    model: Isolator, scale: Array, states: State, batch: Batch, quantity: Quantity, sample_time: float
) -> Float[Array, "time lanes"]:
    values = tuple(entry.value for entry in list_parameters(model))
    sample = _sampler(model, quantity, sample_time)

    def body(carry: tuple[State, Array | None], table: Instant) -> tuple[tuple[State, Array | None], Array]:
        state, pending = carry
        reading, state, after = sample(values, scale, state, split_stages(table))
        return (state, after), reading if pending is None else reading + pending

    start = (states, jnp.zeros_like(scale) if model.splits else None)
    return jax.lax.scan(body, start, batch.acting)[1]


def readings(
    model: Isolator,
    stiffness_scale: Float[np.ndarray, " lanes"],
    states: Float[np.ndarray, "state lanes"],
    prepared: Prepared,
) -> Float[np.ndarray, "time lanes"]:
    """Simulate each segment from a given state.

    Args:
        model: the isolator.
        stiffness_scale: factor on the linear stiffness, a lane each.
        states: state at each lane's first sample.
        prepared: the segments.

    Returns:
        What the sensor chain records [SI unit of the output]; meaningless where the lane is padded.
    """
    parts = len(prepared.batches)

    def one(part: int) -> np.ndarray:
        scale = share_lanes(stiffness_scale[None], part, parts)[0]
        batch = prepared.batches[part].following(model)
        own = share_lanes(states, part, parts)
        return np.asarray(_lane_readings(model, scale, own, batch, prepared.quantity, prepared.sample_time))

    with ThreadPoolExecutor(workers()) as pool:
        return np.concatenate(list(pool.map(one, range(parts))), axis=1)
