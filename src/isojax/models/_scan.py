"""Sample-locked integration of many records at once: the diffrax solver's step under `lax.scan`."""

from collections.abc import Callable
from typing import Any

import diffrax
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from .._types import Lanes
from ..elements import Channels
from ._event_step import Ringing, Table, find_regime, find_ringing, split_step
from ._isolator import NO_CHANNELS, Isolator, Quantity, State


def sampled_term(model: Isolator, quantity: Quantity, sample_time: Lanes | float) -> diffrax.ODETerm:
    """Give the vector field whose drive is tabulated at the stages of the step.

    Time runs from 0 to 1 over one sample and is a Python number, so the table is indexed while tracing and
    the compiled step holds no look-up.

    Args:
        model: the isolator.
        quantity: what the sensor measures.
        sample_time: time between samples [s].

    Returns:
        A term whose `args` are the drive, its rate and the channels at `2 substeps + 1` equidistant times of
        the sample.
    """

    def field(t: float, state: State, args: tuple[Any, Any, Any]) -> State:
        drive, drive_rate, channels = args
        place = round(t * (len(drive) - 1))
        rates = model.rates(state, drive[place], drive_rate[place], quantity, channels=channels[place])
        return tuple(sample_time * rate for rate in rates)

    return diffrax.ODETerm(field)  # pyright: ignore[reportArgumentType]


UNROLLED = 2
"""Substeps a sample up to which they are written out."""


def advance(
    model: Isolator,
    solver: diffrax.AbstractSolver,
    quantity: Quantity,
    sample_time: Lanes | float,
    state: State,
    drive: tuple[Array, ...],
    drive_rate: tuple[Array | float, ...],
    channels: tuple[Channels, ...] = (),
) -> State:
    """Advance the state by one sample.

    Args:
        model: the isolator.
        solver: a fixed-step solver with equidistant stages.
        quantity: what the sensor measures.
        sample_time: time between samples [s].
        state: state at the sample, any leading shape.
        drive: recorded drive at `2 substeps + 1` equidistant times of the sample.
        drive_rate: its time derivative at the same times.
        channels: signals of the record at the same times; none if omitted.

    Returns:
        State one sample later.
    """
    channels = channels or (NO_CHANNELS,) * len(drive)
    substeps = (len(drive) - 1) // 2
    if substeps <= UNROLLED:
        term = sampled_term(model, quantity, sample_time)
        for substep in range(substeps):
            t0, t1 = substep / substeps, (substep + 1) / substeps
            state, *_ = solver.step(term, t0, t1, state, (drive, drive_rate, channels), None, False)
        return state
    # Many substeps are looped over: unrolled they take long to compile and run no faster.
    term = sampled_term(model, quantity, sample_time / substeps)

    def body(carry: State, table: tuple) -> tuple[State, None]:
        moved, *_ = solver.step(term, 0.0, 1.0, carry, table, None, False)
        return moved, None

    return jax.lax.scan(body, state, _step_tables(drive, drive_rate, channels))[0]


def _step_tables(
    drive: tuple[Array, ...], drive_rate: tuple[Array | float, ...], channels: tuple[Channels, ...]
) -> tuple[tuple[Array, ...], tuple[Array, ...], tuple[Channels, ...]]:
    """Give what acts at the beginning, middle and end of each step, steps first."""

    def stages(values: tuple[Array | float, ...], offset: int) -> Array:
        return jnp.stack([jnp.asarray(value) for value in values[offset : len(values) - 2 + offset : 2]])

    def named(offset: int) -> dict[str, Array]:
        return {name: stages(tuple(at[name] for at in channels), offset) for name in channels[0]}

    return (
        tuple(stages(drive, offset) for offset in range(3)),
        tuple(stages(drive_rate, offset) for offset in range(3)),
        tuple(named(offset) for offset in range(3)),
    )


def advance_record(
    model: Isolator,
    solver: diffrax.AbstractSolver,
    quantity: Quantity,
    sample_time: Lanes | float,
    state: State,
    drive: tuple[Array, ...],
    drive_rate: tuple[Array | float, ...],
    channels: tuple[Channels, ...] = (),
) -> tuple[State, Ringing | None]:
    """Advance the state of a record by one sample: as `advance`, but split where a law jumps or bends.

    Args:
        model: the isolator.
        solver: a fixed-step solver with equidistant stages, for models that need no splitting.
        quantity: what the sensor measures.
        sample_time: time between samples [s].
        state: state at the sample, any leading shape.
        drive: recorded drive at `2 substeps + 1` equidistant times of the sample.
        drive_rate: its time derivative at the same times.
        channels: signals of the record at the same times; none if omitted.

    Returns:
        State one sample later; what jumps on the way leave in the readings of both samples, None of a model
        without jumps.
    """
    if not model.splits:
        return advance(model, solver, quantity, sample_time, state, drive, drive_rate, channels), None
    channels = channels or (NO_CHANNELS,) * len(drive)
    substeps = (len(drive) - 1) // 2
    step_time = sample_time / substeps
    if substeps == 1:
        state, jump = split_step(model, quantity, step_time, state, Table(drive, drive_rate, channels))
        return state, find_ringing(jump, 0, 1)

    def body(carry: tuple[State, Ringing], table: tuple) -> tuple[tuple[State, Ringing], None]:
        (state, so_far), (step, *at) = carry, table
        state, jump = split_step(model, quantity, step_time, state, Table(*at))
        ringing = find_ringing(jump, step, substeps)
        return (state, Ringing(so_far.before + ringing.before, so_far.after + ringing.after)), None

    silent = Ringing(jnp.zeros_like(state[0]), jnp.zeros_like(state[0]))
    tables = (jnp.arange(substeps), *_step_tables(drive, drive_rate, channels))
    return jax.lax.scan(body, (state, silent), tables)[0]


def read_record(
    model: Isolator,
    state: State,
    u: Lanes,
    u_rate: Lanes | float,
    quantity: Quantity,
    channels: Channels = NO_CHANNELS,
) -> Lanes:
    """Give what the sensor chain records: as `Isolator.reading`, but with laws that jump or bend as they are.

    The ringing of jumps between samples is not in it: see `add_ringing`.

    Args:
        model: the isolator.
        state: displacement, velocity and internal states.
        u: recorded drive, already shifted.
        u_rate: its time derivative.
        quantity: what the sensor measures.
        channels: signals of the record, by name.

    Returns:
        The reading [SI unit of the quantity].
    """
    regime = find_regime(model, state, u, u_rate, channels) if model.splits else None
    return model.reading(state, u, u_rate, quantity, channels, regime)


def at_stages(channels: dict[str, Float[Array, "stage lanes"]], stages: int) -> tuple[Channels, ...]:
    """Give signals stage by stage.

    Args:
        channels: signals over the stages of a sample, by name.
        stages: how many these are.

    Returns:
        One set of signals a stage.
    """
    return tuple({name: values[stage] for name, values in channels.items()} for stage in range(stages))


def scan_records(
    model: Isolator,
    solver: diffrax.AbstractSolver,
    quantity: Quantity,
    sample_time: float,
    state: State,
    drive: Float[Array, "time stage lanes"],
    drive_rate: Float[Array, "time stage lanes"] | None,
    observe: Callable[[State, Array, Array | float], Any],
    channels: dict[str, Float[Array, "time stage lanes"]] | None = None,
) -> tuple[State, Any, Ringing | None]:
    """Integrate records side by side and observe each sample before it is stepped over.

    Args:
        model: the isolator.
        solver: a fixed-step solver with equidistant stages.
        quantity: what the sensor measures.
        sample_time: time between samples [s].
        state: states at the first sample, one array of lanes each.
        drive: recorded drive; stage runs over `2 substeps + 1` equidistant times of a sample.
        drive_rate: its time derivative, or None where the model has no use for it.
        observe: what to keep, from the state, drive and drive rate at a sample.
        channels: signals of the records at the same times, by name.

    Returns:
        State after the last sample; the observations, time first; the ringing of jumps, or None.
    """
    stages = drive.shape[1]

    def body(carry: State, table: tuple[Array, Array | None, dict[str, Array]]) -> tuple[State, tuple]:
        values, slopes, beside = table
        u = tuple(values[stage] for stage in range(stages))
        du = (0.0,) * stages if slopes is None else tuple(slopes[stage] for stage in range(stages))
        kept = observe(carry, u[0], du[0])
        beside = at_stages(beside, stages)
        ahead, ringing = advance_record(model, solver, quantity, sample_time, carry, u, du, beside)
        return ahead, (kept, ringing)

    last, (kept, ringing) = jax.lax.scan(body, state, (drive, drive_rate, channels or {}))
    return last, kept, ringing
