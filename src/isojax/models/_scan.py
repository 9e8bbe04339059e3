"""Sample-locked integration of many records at once: the diffrax solver's step under `lax.scan`."""

from collections.abc import Callable
from typing import Any

import diffrax
import jax
import jax.numpy as jnp
from jaxtyping import Array

from .._kernel_scan import kernel_scan
from .._types import Lanes
from ._event_step import Ringing, Step, find_regime, find_ringing, split_step
from ._instant import Instant, split_stages
from ._isolator import Isolator, Quantity
from ._laws import ROUNDED, State

_UNROLLED = 2
"""Substeps a sample up to which they are written out."""


def _sampled_term(model: Isolator, quantity: Quantity, sample_time: Lanes | float) -> diffrax.ODETerm:
    """Give the vector field over one sample, with time from 0 to 1.

    Its `args` are what acts at the stages. Time is a Python number, so these are chosen while tracing and the
    compiled step holds no look-up.
    """

    def field(t: float, state: State, stages: tuple[Instant, ...]) -> State:
        rates = model.rates(state, stages[round(t * (len(stages) - 1))], quantity)
        return tuple(sample_time * rate for rate in rates)

    return diffrax.ODETerm(field)  # pyright: ignore[reportArgumentType]


def advance(
    model: Isolator,
    solver: diffrax.AbstractSolver,
    quantity: Quantity,
    sample_time: Lanes | float,
    state: State,
    stages: tuple[Instant, ...],
) -> State:
    """Advance the state by one sample.

    Args:
        model: the isolator.
        solver: a fixed-step solver with equidistant stages.
        quantity: what the sensor measures.
        sample_time: time between samples [s].
        state: state at the sample, any leading shape.
        stages: what acts at `2 substeps + 1` equidistant times of the sample.

    Returns:
        State one sample later.
    """
    substeps = (len(stages) - 1) // 2
    if substeps <= _UNROLLED:
        term = _sampled_term(model, quantity, sample_time)
        for substep in range(substeps):
            t0, t1 = substep / substeps, (substep + 1) / substeps
            state, *_ = solver.step(term, t0, t1, state, stages, None, False)
        return state
    # Many substeps are looped over: unrolled they take long to compile and run no faster.
    term = _sampled_term(model, quantity, sample_time / substeps)

    def body(carry: State, step: tuple[Instant, ...]) -> tuple[State, None]:
        moved, *_ = solver.step(term, 0.0, 1.0, carry, step, None, False)
        return moved, None

    return jax.lax.scan(body, state, _step_tables(stages))[0]


def _step_tables(stages: tuple[Instant, ...]) -> tuple[Instant, ...]:
    """Give what acts at the start, middle and end of each step, steps first."""

    def stack(*values: Array | float) -> Array:
        return jnp.stack([jnp.asarray(value) for value in values])

    last = len(stages) - 2
    return tuple(jax.tree_util.tree_map(stack, *stages[place : last + place : 2]) for place in range(3))


def advance_record(
    model: Isolator,
    solver: diffrax.AbstractSolver,
    quantity: Quantity,
    sample_time: Lanes | float,
    state: State,
    stages: tuple[Instant, ...],
) -> tuple[State, Ringing | None]:
    """Advance the state of a record by one sample, split where a law jumps or bends.

    The arguments are those of `advance`; the solver serves models that need no splitting.

    Returns:
        State one sample later; what jumps on the way leave in the readings of both samples, None of a model
        without jumps.
    """
    if not model.splits:
        return advance(model, solver, quantity, sample_time, state, stages), None
    substeps = (len(stages) - 1) // 2
    step_time = sample_time / substeps
    if substeps == 1:
        state, jump = split_step(model, quantity, state, Step(step_time, stages))
        return state, find_ringing(jump, 0, 1)

    def body(carry: tuple[State, Ringing], table: tuple) -> tuple[tuple[State, Ringing], None]:
        (state, so_far), (number, *during) = carry, table
        state, jump = split_step(model, quantity, state, Step(step_time, tuple(during)))
        ringing = find_ringing(jump, number, substeps)
        return (state, Ringing(so_far.before + ringing.before, so_far.after + ringing.after)), None

    silent = Ringing(jnp.zeros_like(state[0]), jnp.zeros_like(state[0]))
    return jax.lax.scan(body, (state, silent), (jnp.arange(substeps), *_step_tables(stages)))[0]


def read_record(model: Isolator, state: State, at: Instant, quantity: Quantity) -> Lanes:
    """Give what the sensor chain records: as `Isolator.reading`, but with laws that jump or bend as they are.

    The ringing of jumps between samples is not in it: see `add_ringing`.

    Args:
        model: the isolator.
        state: displacement, velocity and internal states.
        at: what acts at the instant.
        quantity: what the sensor measures.

    Returns:
        The reading [SI unit of the quantity].
    """
    return model.reading(state, at, quantity, find_regime(model, state, at) if model.splits else ROUNDED)


def scan_records(
    model: Isolator,
    solver: diffrax.AbstractSolver,
    quantity: Quantity,
    sample_time: Lanes | float,
    state: State,
    record: Instant,
    observe: Callable[[State, Instant], Any],
) -> tuple[State, Any, Ringing | None]:
    """Integrate records side by side and observe each sample before it is stepped over.

    Args:
        model: the isolator.
        solver: a fixed-step solver with equidistant stages.
        quantity: what the sensor measures.
        sample_time: time between samples [s].
        state: states at the first sample, one array of lanes each.
        record: what acts: arrays over time, stage and lanes; stage runs over `2 substeps + 1` equidistant
            times of a sample.
        observe: what to keep, from the state and what acts at a sample.

    Returns:
        State after the last sample; the observations, time first; the ringing of jumps, or None.
    """

    def body(carry: State, table: Instant) -> tuple[State, tuple]:
        stages = split_stages(table)
        kept = observe(carry, stages[0])
        ahead, ringing = advance_record(model, solver, quantity, sample_time, carry, stages)
        return ahead, (kept, ringing)

    last, (kept, ringing) = kernel_scan(body, state, record)
    return last, kept, ringing
