"""What a model makes of small changes along its own path: partial derivatives, all samples at once.

A sharp law has the model take several steps a sample. Its slopes are then averaged to the samples, so that
what is absent is followed at one step a sample, whatever the model asks for.
"""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..._parameters import list_parameters
from ...models import (
    RK4,
    Isolator,
    Quantity,
    Ringing,
    State,
    Table,
    add_ringing,
    advance,
    at_stages,
    find_regime,
    find_ringing,
    read_record,
    split_step,
)
from ._batch import Batch
from ._effect_inputs import EFFECT_INPUTS, PathMotion, Perturbation
from ._information import has_stiffness_scale, scaled_model


def sample_stages(table: Float[Array, "time stage lanes"]) -> Float[Array, "time 3 lanes"]:
    """Give start, middle and end of each sample."""
    return table[:, :: (table.shape[1] - 1) // 2]


def steps_of(table: Float[Array, "time stage lanes"]) -> Float[Array, "node 3 lanes"]:
    """Split each sample into its integration steps, three stages each."""
    time, stages, lanes = table.shape
    steps = (stages - 1) // 2
    ends = jnp.stack([table[:, 2 * step : 2 * step + 3] for step in range(steps)], axis=1)
    return ends.reshape(time * steps, 3, lanes)


def cubic_middle(before: Array, left: Array, right: Array, after: Array) -> Array:
    """Give the middle of a cubic through four equidistant values."""
    return (9.0 * (left + right) - before - after) / 16.0


def _to_samples(values: Float[Array, "step lanes"], steps: int) -> Float[Array, "time lanes"]:
    """Average what varies between samples, with the weight of a hat: the impulse of a spike is kept.

    What the hat adds to a smooth series, a twelfth of its second difference, is taken off again.
    """
    if steps == 1:
        return values
    time = values.shape[0] // steps
    ahead, behind = values[:1].repeat(steps - 1, axis=0), values[-1:].repeat(steps - 1, axis=0)
    padded = jnp.concatenate([ahead, values, behind])
    shares = [(1.0 - abs(offset) / steps) / steps for offset in range(1 - steps, steps)]
    mean = sum(
        (share * padded[first : first + time * steps : steps] for first, share in enumerate(shares)),
        start=jnp.zeros_like(values[:time]),
    )
    return _without_bend(mean)


def impulse_at_samples(table: Float[Array, "time stage lanes"]) -> Float[Array, "time lanes"]:
    """Average a signal to the samples as slopes are: all of it may lie between them, as that of a hold does.

    Args:
        table: the signal at equidistant times from each sample to the next; it may jump there.

    Returns:
        At each sample what pushes a model as much.
    """
    place = jnp.linspace(0.0, 1.0, table.shape[1])
    pattern = jnp.ones(table.shape[1]).at[1::2].set(4.0).at[2:-1:2].set(2.0)
    simpson = pattern / pattern.sum()
    ahead = jnp.einsum("s,tsl->tl", simpson * (1.0 - place), table)
    behind = jnp.einsum("s,tsl->tl", simpson * place, table)
    return _without_bend(ahead + jnp.concatenate([0.5 * table[:1, 0], behind[:-1]]))


def _without_bend(mean: Float[Array, "time lanes"]) -> Float[Array, "time lanes"]:
    """Take off what a hat adds to a smooth series."""
    around = jnp.concatenate([mean[:1], mean, mean[-1:]])
    return mean - (around[2:] - 2.0 * mean + around[:-2]) / 12.0


@eqx.filter_jit
def follow_path(
    model: Isolator, scale: Array, states: State, batch: Batch, quantity: Quantity, sample_time: float
) -> tuple[State, Ringing | None]:
    """Simulate; give the states at the start of each integration step, and the ringing of jumps."""
    values = tuple(entry.value for entry in list_parameters(model))
    current = scaled_model(model, values, scale)
    drive, rate = steps_of(batch.drive), steps_of(batch.drive_rate)
    channels = {name: steps_of(values) for name, values in batch.channels.items()}
    time = batch.drive.shape[0]
    steps = drive.shape[0] // time
    step_time = sample_time / steps
    solver = RK4()

    def body(state: State, table: tuple) -> tuple[State, tuple[State, Ringing | None]]:
        number, u, du, known = table
        stages = tuple(u[i] for i in range(3)), tuple(du[i] for i in range(3)), at_stages(known, 3)
        if not model.splits:
            return advance(current, solver, quantity, step_time, state, *stages), (state, None)
        ahead, jump = split_step(current, quantity, step_time, state, Table(*stages))
        return ahead, (state, find_ringing(jump, number, steps))

    numbers = jnp.tile(jnp.arange(steps), time)
    path, ringing = jax.lax.scan(body, states, (numbers, drive, rate, channels))[1]
    return path, jax.tree_util.tree_map(lambda one: one.reshape(time, steps, -1).sum(axis=1), ringing)


class Change(NamedTuple):
    """Change of the reading, and of the rates of the carried states but the first (the velocity)."""

    rates: tuple[Array, ...]
    reading: Array


class Slopes(NamedTuple):
    """What the model makes of small changes along its path.

    Attributes:
        reading: the reading itself.
        parameters: with each parameter that moves.
        ports: with a unit at each port, by name.
        scale: with the stiffness scale, or None without one.
        states: with each state.
        motion: what absent effects see of the path.
    """

    reading: Array
    parameters: tuple[Change, ...]
    inputs: dict[str, Change]
    scale: Change | None
    states: tuple[Change, ...]
    motion: PathMotion


@eqx.filter_jit
def slopes_along(
    model: Isolator,
    moving: tuple[int, ...],
    scale: Array,
    path: State,
    ringing: Ringing | None,
    batch: Batch,
    quantity: Quantity,
) -> Slopes:
    """Differentiate rates and reading along the path.

    A law that jumps has no slope: its rates are those of the rounded law, of use to ports alone; what it does
    to changes of states and parameters is in `transitions_along`.
    """
    values = tuple(entry.value for entry in list_parameters(model))
    tables = {name: steps_of(table) for name, table in batch.channels.items()}
    drives, drive_rates = steps_of(batch.drive), steps_of(batch.drive_rate)
    channels = {name: table[:, 0] for name, table in tables.items()}
    u, du = drives[:, 0], drive_rates[:, 0]
    scale = jnp.broadcast_to(scale, u.shape)
    steps = u.shape[0] // batch.measured.shape[0]
    present = scaled_model(model, values, scale)
    regime = find_regime(present, path, u, du, channels) if model.splits else None

    def along(values: tuple[Array, ...], scale: Array, state: State, inlet: dict[str, Array]) -> Change:
        current = scaled_model(model, values, scale)
        late = current.shift() - jax.lax.stop_gradient(current.shift())
        acted = u - late * du
        if inlet:
            acted = acted + inlet["recorded"]
            small = Perturbation(inlet["acted"], inlet["force"], inlet["mass"], inlet["base"], inlet["read"])
            current = Isolator(current.mass, (*current.elements, small), current.excitation)
        followed = {**channels, "perturbation": inlet["base"]} if inlet else channels
        rates = current.rates(state, acted, du, quantity, channels=followed)[1 : len(state)]
        return Change(rates, current.reading(state, acted, du, quantity, followed, regime))

    def by_parameter(place: int) -> Change:
        def with_number(number: Array) -> Change:
            return along((*values[:place], number, *values[place + 1 :]), scale, path, {})

        return jax.jvp(with_number, (values[place],), (jnp.ones(()),))[1]

    def by_input(name: str) -> Change:
        nothing = {inlet: jnp.zeros(()) for inlet in EFFECT_INPUTS}

        def with_amount(amount: Array) -> Change:
            return along(values, scale, path, nothing | {name: amount})

        return jax.jvp(with_amount, (jnp.zeros(()),), (jnp.ones(()),))[1]

    def by_state(index: int) -> Change:
        def shifted(number: Array) -> Change:
            return along(values, scale, (*path[:index], number, *path[index + 1 :]), {})

        return jax.jvp(shifted, (path[index],), (jnp.ones_like(path[index]),))[1]

    by_scale = None
    if has_stiffness_scale(model):
        by_scale = jax.jvp(lambda s: along(values, s, path, {}), (scale,), (jnp.ones_like(scale),))[1]

    def sampled(change: Change) -> Change:
        return Change(tuple(_to_samples(rate, steps) for rate in change.rates), change.reading[::steps])

    present = scaled_model(model, values, scale[::steps])
    own = tuple(state[::steps] for state in path)
    ends = tuple(jnp.concatenate([state[1:], state[-1:]]) for state in own)
    befores = tuple(jnp.concatenate([state[:1], state[:-1]]) for state in own)
    afters = tuple(jnp.concatenate([state[1:], state[-1:]]) for state in ends)
    middles = tuple(map(cubic_middle, befores, own, ends, afters))
    coarse = sample_stages(batch.drive), sample_stages(batch.drive_rate)
    beside = {name: sample_stages(table) for name, table in batch.channels.items()}
    seen = []
    for stage, state in enumerate((own, middles, ends)):
        at = {name: table[:, stage] for name, table in beside.items()}
        now, rate = (table[:, stage] for table in coarse)
        base = present.base(now, rate, at)
        y = read_record(present, state, now, rate, quantity, at)
        if stage == 0:
            y = add_ringing(y, ringing)
        seen.append((state[0], state[1], y) if base is None else (state[0], state[1], y, base))
    now, rate = (table[:, 0] for table in coarse)
    at = {name: table[:, 0] for name, table in beside.items()}
    held = find_regime(present, own, now, rate, at) if model.splits else None
    acted, acted_rate = present.acting(now, rate, at)
    sensed = present.sensed(own, now, rate, quantity, at, held)
    motion = PathMotion(
        own[0],
        own[1],
        rate,
        acted,
        jnp.broadcast_to(acted_rate, acted.shape),
        add_ringing(sensed, ringing),
        tuple(jnp.stack(three, axis=1) for three in zip(*seen, strict=True)),
        {},
    )
    return Slopes(
        seen[0][2],
        tuple(sampled(by_parameter(place)) for place in moving),
        {name: sampled(by_input(name)) for name in EFFECT_INPUTS},
        None if by_scale is None else sampled(by_scale),
        tuple(sampled(by_state(index)) for index in range(len(path))),
        motion,
    )
