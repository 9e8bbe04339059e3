"""The extended Kalman filter of records side by side: innovations, their variances, and their derivatives.

`y_k = h(z_k, u_k + w_k) + e_k`, `z_(k+1) = f(z_k, u_k + w_k)`, `w_(k+1) = a w_k + n_k`. The random force w
stands for noise of the drive and for what the model does not know; it is white (a = 0) or has a memory.
e is the noise of the output. The mean of the state takes the whole nonlinear step, its covariance the step's
derivatives. A step is split where a law jumps or bends. An innovation that is far too large for its variance
counts for less: a spike of the record, or a reading on the other side of a jump.

Source: Jazwinski 1970, Stochastic Processes and Filtering Theory, sec. 8.3; Kristensen, Madsen & Jorgensen
2004, Automatica 40:225 (grey-box models with system noise); Huber 1964, Ann. Math. Stat. 35:73 (weights).
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..._kernel_scan import kernel_scan
from ..._parameters import replace_parameters
from ..._quick_jit import quick_jit
from ...models import RK4, Instant, Isolator, Quantity, State, advance_record, read_record, split_stages
from ..jacobian import Batch

_IN_A_KERNEL = 4
"""Internal states up to which the loop is one kernel: to compile it takes long where it is large."""

_USUAL = 4.0
"""Standard deviations within which an innovation counts in full: of normal ones 1 in 16,000 lies beyond."""

_ORDERS = 4
"""Terms of the exponential that carries the covariance over a sample."""


class Lanes(NamedTuple):
    """What differs from lane to lane beside the records.

    Attributes:
        force: variance of the random force [squared SI unit of the drive].
        memory: a, its correlation from sample to sample.
        noise: variance of the output's noise [squared SI unit of the output].
        start: mean of the first state, the random force behind the model's states.
        spread: its variances.
    """

    force: Float[Array, " lanes"]
    memory: Float[Array, " lanes"]
    noise: Float[Array, " lanes"]
    start: State
    spread: State


class Trace(NamedTuple):
    """The filter along the records.

    Attributes:
        states: before each sample is seen, the random force last.
        gains: of each, over the innovation.
        error: innovations [SI unit of the output].
        deviation: by which they are weighed: their standard deviation, larger where one is unusually large;
            infinite where a sample does not count.
    """

    states: State
    gains: State
    error: Float[Array, "time lanes"]
    deviation: Float[Array, "time lanes"]


class Followed(NamedTuple):
    """A filter's likelihood, a lane each, and its way along the first lanes.

    Attributes:
        deviance: sum of `log s + e^2/s` over innovations e of variance s, -2 log-likelihood but for a
            constant; beyond `e^2/s = 16` in place of it `16 + 16 log(e^2/16 s)`.
        square: mean square of each state.
        slope: of half the deviance with each of the sizes by which groups of lanes differ.
        fisher: its information.
        trace: of the first lanes, as many as were asked for.
    """

    deviance: Float[Array, " lanes"]
    square: State
    slope: Float[Array, "size kept"]
    fisher: Float[Array, "size size kept"]
    trace: Trace


def _read(model: Isolator, quantity: Quantity, state: State, at: Instant) -> Array:
    """Give the reading of a state, the random force last."""
    return read_record(model, state[:-1], at._replace(drive=at.drive + state[-1]), quantity)


def _predict(
    model: Isolator, quantity: Quantity, step: Array, memory: Array, state: State, stages: tuple[Instant, ...]
) -> State:
    """Give the state one sample later, the random force constant on the way."""
    pushed = tuple(at._replace(drive=at.drive + state[-1]) for at in stages)
    ahead, _ = advance_record(model, RK4(), quantity, step, state[:-1], pushed)
    return (*ahead, memory * state[-1])


def _delayed(
    model: Isolator, stages: tuple[Instant, ...], tabled: tuple[Array, Array]
) -> tuple[Instant, ...]:
    """Give what acts with the model's delay, from tables that were made with another, to first order."""
    moved = []
    for at in stages:
        elapsed = at.channels.get("elapsed", 0.0)
        moved.append(at.delayed(model.shift(elapsed) - tabled[0] - tabled[1] * elapsed))
    return tuple(moved)


def _correct(state: State, gain: State, error: Array) -> State:
    return tuple(one + k * error for one, k in zip(state, gain, strict=True))


def _trust(error: Array, variance: Array) -> Array:
    """Give the share with which an innovation counts."""
    return jnp.minimum(1.0, _USUAL * jnp.sqrt(variance) / jnp.maximum(jnp.abs(error), 1e-300))


def _update(
    model: Isolator,
    quantity: Quantity,
    step: Array,
    lanes: Lanes,
    state: State,
    covariance: tuple[State, ...],
    stages: tuple[Instant, ...],
    measured: Array,
    used: Array,
) -> tuple[Array, State, Array, State, tuple[State, ...]]:
    """Give the innovation of a sample, its gains and variance, the state at the next, and its covariance."""
    every, last = range(len(state)), len(state) - 1
    zero = jnp.zeros_like(measured)
    units = [tuple(zero + float(row == place) for row in every) for place in every]

    def read(state: State) -> Array:
        return _read(model, quantity, state, stages[0])

    error = measured - read(state)
    slopes = [jax.jvp(read, (state,), (unit,))[1] for unit in units]
    seen = [sum(covariance[row][other] * slopes[other] for other in every) for row in every]
    variance = sum((slopes[row] * seen[row] for row in every), start=lanes.noise)
    share = used * _trust(error, variance)
    gain = tuple(share * one / variance for one in seen)
    after = [[covariance[row][other] - gain[row] * seen[other] for other in every] for row in every]
    moved = _correct(state, gain, error)
    carry = _split_transition if model.splits else _smooth_transition
    ends, ahead = carry(model, quantity, step, lanes.memory, moved, stages)
    mixed = [[sum(after[row][other] * ahead[other][to] for other in every) for row in every] for to in every]
    upper: dict[tuple[int, int], Array] = {
        (to, other): sum((ahead[row][other] * mixed[to][row] for row in every), start=zero)
        for to in every
        for other in range(to, len(state))
    }
    upper[last, last] = upper[last, last] + (1.0 - lanes.memory**2) * lanes.force
    return (
        error,
        gain,
        variance,
        ends,
        tuple(tuple(upper[min(a, b), max(a, b)] for b in every) for a in every),
    )


def _split_transition(
    model: Isolator, quantity: Quantity, step: Array, memory: Array, state: State, stages: tuple[Instant, ...]
) -> tuple[State, list[State]]:
    """Give the state a sample later, and what a unit of each becomes, the step split at jumps and bends."""
    size = len(state)
    units = jnp.broadcast_to(jnp.eye(size)[..., None], (size, size, *state[0].shape))
    ends, ahead = jax.vmap(
        lambda unit: jax.jvp(
            lambda state: _predict(model, quantity, step, memory, state, stages), (state,), (tuple(unit),)
        ),
        out_axes=(None, 0),
    )(units)
    return ends, [tuple(one[place] for one in ahead) for place in range(size)]


def _smooth_transition(
    model: Isolator, quantity: Quantity, step: Array, memory: Array, state: State, stages: tuple[Instant, ...]
) -> tuple[State, list[State]]:
    """Give the state a sample later, and what a unit of each becomes, by derivatives in the middle.

    A covariance needs no more, in a truncated exponential: the derivatives of the whole step take three
    times as long to compile. Internal states that follow within a sample need it squared: as often as the
    step is halved.
    """
    every, last = range(len(state)), len(state) - 1
    zero = jnp.zeros_like(state[0])
    units = [tuple(zero + float(row == place) for row in every) for place in every]
    halvings = (len(stages) // 2).bit_length() - 1 if model.internal_states else 0
    part = step / 2**halvings
    ends = _predict(model, quantity, step, memory, state, stages)
    middle = tuple(0.5 * (one + other) for one, other in zip(state[:-1], ends[:-1], strict=True))
    half = stages[len(stages) // 2]

    def rates(state: State) -> State:
        return model.rates(state[:-1], half._replace(drive=half.drive + state[-1]), quantity)

    slope = [jax.jvp(rates, ((*middle, state[-1]),), (unit,))[1] for unit in units]
    ahead = []
    for place in every:
        column = [part * one + zero for one in slope[place]]
        total = [one + float(to == place) for to, one in enumerate(column)]
        for order in range(2, _ORDERS + 1):
            column = [
                part / order * sum(slope[row][to] * column[row] for row in range(last)) for to in range(last)
            ]
            total = [one + more for one, more in zip(total, column, strict=True)]
        ahead.append((*total, zero + float(place == last)))
    for _ in range(halvings):
        ahead = [
            tuple(sum((ahead[row][to] * column[row] for row in every), start=zero) for to in every)
            for column in ahead
        ]
    ahead[last] = (*ahead[last][:last], memory + zero)
    return ends, ahead


def _scan_of(model: Isolator) -> Callable[..., Any]:
    """Give what loops over the samples."""
    return kernel_scan if model.internal_states <= _IN_A_KERNEL else jax.lax.scan


@quick_jit
def follow_records(
    model: Isolator,
    values: tuple[Array, ...],
    lanes: Lanes,
    batch: Batch,
    quantity: Quantity,
    step: Array,
    tabled: tuple[Array, Array],
    kept: int,
    spacing: float,
) -> Followed:
    """Filter records side by side, the first lanes again with each size a little larger and a little smaller.

    Args:
        model: the isolator.
        values: its parameters, one a lane.
        lanes: what else differs from lane to lane.
        batch: the records.
        quantity: what the sensor measures.
        step: time between samples [s].
        tabled: delay of the drive with which the records were tabulated, and its growth.
        kept: the first lanes, whose way is wanted; so many more follow for each size up, and down.
        spacing: by which the logarithm of a size differs there.

    Returns:
        The likelihood, not finite where a lane diverged, and the way of the first lanes.
    """
    present = replace_parameters(model, list(values))
    nothing = jnp.zeros(batch.measured.shape[1])

    def body(carry: tuple, table: tuple) -> tuple[tuple, Trace]:
        state, covariance, deviance, square, slope, fisher = carry
        acting, measured, weight, used = table
        stages = _delayed(present, split_stages(acting), tabled)
        error, gain, variance, after, ahead = _update(
            present, quantity, step, lanes, state, covariance, stages, measured, used
        )
        variance = jnp.where(used > 0.0, variance, 1.0)
        trust = _trust(error, variance)
        ratio = error**2 / variance
        usual = jnp.minimum(ratio, _USUAL**2)
        # Beyond what is usual the cost is the one whose slope with the variance stays what it was there.
        cost = usual * (1.0 + jnp.log(jnp.maximum(ratio / _USUAL**2, 1.0)))
        deviance = deviance + weight * (jnp.log(variance) + cost)
        square = tuple(old + weight * one**2 for old, one in zip(square, state, strict=True))
        shares = [one.reshape(-1, kept) for one in (error, jnp.log(variance))]
        by_error, by_log = ((one[1::2] - one[2::2]) / (2.0 * spacing) for one in shares)
        own, weigh, counted = jnp.sqrt(variance[:kept]), weight[:kept], usual[:kept]
        share = jnp.where(counted < ratio[:kept], counted / jnp.maximum(ratio[:kept], 1e-300), 1.0)
        scaled = by_error / own[None]
        by_size = 0.5 * by_log * (1.0 - counted)[None] + scaled * (share * error[:kept] / own)[None]
        slope = slope + weigh[None] * by_size
        squares = 0.5 * by_log[:, None] * by_log[None] + share[None, None] * scaled[:, None] * scaled[None]
        fisher = fisher + weigh[None, None] * squares
        seen = Trace(state, gain, error, jnp.where(weight > 0.0, jnp.sqrt(variance / trust), jnp.inf))
        return (after, ahead, deviance, square, slope, fisher), jax.tree.map(lambda one: one[:kept], seen)

    every = range(len(lanes.spread))
    begun = tuple(tuple((lanes.spread[a] if a == b else 0.0) + nothing for b in every) for a in every)
    start = tuple(one + nothing for one in lanes.start)
    used = jax.lax.cummax(batch.weight, axis=0, reverse=True)
    tables = batch.acting, batch.measured, batch.weight, used
    differing = (nothing.size // kept - 1) // 2
    flat = jnp.zeros((differing, kept)), jnp.zeros((differing, differing, kept))
    (_, _, deviance, square, slope, fisher), trace = _scan_of(model)(
        body, (start, begun, nothing, tuple(nothing for _ in every), *flat), tables
    )
    counted = jnp.maximum(batch.weight.sum(axis=0), 1.0)
    return Followed(deviance, tuple(one / counted for one in square), slope, fisher, trace)


@quick_jit
def innovation_products(
    model: Isolator,
    values: tuple[Array, ...],
    directions: tuple[Array, ...],
    start: State,
    start_directions: Float[Array, "state direction"],
    memory: Array,
    trace: Trace,
    batch: Batch,
    quantity: Quantity,
    step: Array,
    tabled: tuple[Array, Array],
) -> Float[Array, "row row lanes"]:
    """Differentiate the innovations with the gains and their deviations held.

    Args:
        model: the isolator.
        values: its parameters, one a lane.
        directions: change of each with the columns; no entries of those that do not move.
        start: mean of the first state.
        start_directions: change of it with the columns.
        memory: correlation of the random force from sample to sample.
        trace: gains and deviations.
        batch: the records.
        quantity: what the sensor measures.
        step: time between samples [s].
        tabled: delay of the drive with which the records were tabulated, and its growth.

    Returns:
        `A^T A` of each lane, with A the columns of de/dtheta and, last, e, over their deviations.
    """
    columns, count = start_directions.shape[1], batch.measured.shape[1]
    moving = [place for place, one in enumerate(directions) if one.size]
    known = tuple(values[place] for place in moving)
    seeds = tuple(jnp.broadcast_to(directions[place][:, None], (columns, count)) for place in moving)

    def with_moved(moved: Sequence[Array]) -> Isolator:
        numbers = list(values)
        for place, number in zip(moving, moved, strict=True):
            numbers[place] = number
        return replace_parameters(model, numbers)

    def body(carry: tuple, table: tuple) -> tuple[tuple, None]:
        state, tangents, products = carry
        acting, measured, gain, deviation = table
        stages = split_stages(acting)

        def innovate(moved: tuple[Array, ...], state: State) -> tuple[State, Array]:
            current = with_moved(moved)
            slowed = _delayed(current, stages, tabled)
            error = measured - _read(current, quantity, state, slowed[0])
            after = _correct(state, gain, error)
            return _predict(current, quantity, step, memory, after, slowed), error

        if columns:
            (state, error), (tangents, slopes) = jax.vmap(
                lambda seed, tangent: jax.jvp(innovate, (known, state), (seed, tangent)), out_axes=(None, 0)
            )(seeds, tangents)
            rows = jnp.concatenate([slopes, error[None]]) / deviation[None]
        else:
            state, error = innovate(known, state)
            rows = (error / deviation)[None]
        return (state, tangents, products + rows[:, None] * rows[None]), None

    begun = tuple(one + jnp.zeros(count) for one in start)
    tangents = tuple(jnp.broadcast_to(one[:, None], (columns, count)) for one in start_directions)
    empty = jnp.zeros((columns + 1, columns + 1, count))
    tables = batch.acting, batch.measured, trace.gains, trace.deviation
    return _scan_of(model)(body, (begun, tangents, empty), tables)[0][2]
