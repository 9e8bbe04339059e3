"""Sample-locked integration of many records at once: the diffrax solver's step under `lax.scan`."""

from collections.abc import Callable
from typing import Any

import diffrax
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from .._types import Lanes
from ._isolator import Isolator, Quantity, State


def sampled_term(model: Isolator, quantity: Quantity, sample_time: Lanes | float) -> diffrax.ODETerm:
    """Give the vector field whose drive is tabulated at the stages of the step.

    Time runs from 0 to 1 over one sample and is a Python number, so the table is indexed while tracing and
    the compiled step holds no look-up.

    Args:
        model: the isolator.
        quantity: what the sensor measures.
        sample_time: time between samples [s].

    Returns:
        A term whose `args` are the drive and its rate at `2 substeps + 1` equidistant times of the sample.
    """

    def field(t: float, state: State, args: tuple[Any, Any]) -> State:
        drive, drive_rate = args
        place = round(t * (len(drive) - 1))
        rates = model.rates(state, drive[place], drive_rate[place], quantity)
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

    Returns:
        State one sample later.
    """
    substeps = (len(drive) - 1) // 2
    if substeps <= UNROLLED:
        term = sampled_term(model, quantity, sample_time)
        for substep in range(substeps):
            t0, t1 = substep / substeps, (substep + 1) / substeps
            state, *_ = solver.step(term, t0, t1, state, (drive, drive_rate), None, False)
        return state
    # Many substeps are looped over: unrolled they take long to compile and run no faster.
    term = sampled_term(model, quantity, sample_time / substeps)

    def stages(values: tuple[Array | float, ...], offset: int) -> Array:
        return jnp.stack([jnp.asarray(value) for value in values[offset : len(values) - 2 + offset : 2]])

    def body(carry: State, table: tuple[Array, ...]) -> tuple[State, None]:
        moved, *_ = solver.step(term, 0.0, 1.0, carry, (table[:3], table[3:]), None, False)
        return moved, None

    tables = tuple(stages(values, offset) for values in (drive, drive_rate) for offset in range(3))
    return jax.lax.scan(body, state, tables)[0]


def scan_records(
    model: Isolator,
    solver: diffrax.AbstractSolver,
    quantity: Quantity,
    sample_time: float,
    state: State,
    drive: Float[Array, "time stage lanes"],
    drive_rate: Float[Array, "time stage lanes"] | None,
    observe: Callable[[State, Array, Array | float], Any],
) -> tuple[State, Any]:
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

    Returns:
        State after the last sample, and the observations, time first.
    """
    stages = drive.shape[1]

    def body(carry: State, table: tuple[Array, Array | None]) -> tuple[State, Any]:
        values, slopes = table
        u = tuple(values[stage] for stage in range(stages))
        du = (0.0,) * stages if slopes is None else tuple(slopes[stage] for stage in range(stages))
        kept = observe(carry, u[0], du[0])
        return advance(model, solver, quantity, sample_time, carry, u, du), kept

    return jax.lax.scan(body, state, (drive, drive_rate))
