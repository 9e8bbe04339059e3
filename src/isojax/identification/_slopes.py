"""What a model makes of small changes along its own path: partial derivatives, all samples at once."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from .._parameters import list_parameters
from ..models import RK4, Isolator, Quantity, State, advance_record, at_stages, find_regime, read_record
from ._batch import Batch
from ._information import has_stiffness_scale, scaled_model
from ._ports import PORTS, Motion, Perturbation


def nodes_of(table: Float[Array, "time stage lanes"]) -> Float[Array, "node 3 lanes"]:
    """Split each sample into its integration steps, three stages each."""
    time, stages, lanes = table.shape
    steps = (stages - 1) // 2
    ends = jnp.stack([table[:, 2 * step : 2 * step + 3] for step in range(steps)], axis=1)
    return ends.reshape(time * steps, 3, lanes)


def cubic_middle(before: Array, left: Array, right: Array, after: Array) -> Array:
    """Give the middle of a cubic through four equidistant values."""
    return (9.0 * (left + right) - before - after) / 16.0


@eqx.filter_jit
def follow_path(
    model: Isolator, scale: Array, states: State, batch: Batch, quantity: Quantity, sample_time: float
) -> State:
    """Simulate; give the states at the start of each integration step."""
    values = tuple(entry.value for entry in list_parameters(model))
    current = scaled_model(model, values, scale)
    drive, rate = nodes_of(batch.drive), nodes_of(batch.drive_rate)
    channels = {name: nodes_of(values) for name, values in batch.channels.items()}
    step = sample_time * batch.drive.shape[0] / drive.shape[0]
    solver = RK4()

    def body(state: State, table: tuple) -> tuple[State, State]:
        u, du, known = table
        stages = tuple(u[i] for i in range(3)), tuple(du[i] for i in range(3)), at_stages(known, 3)
        return advance_record(current, solver, quantity, step, state, *stages), state

    return jax.lax.scan(body, states, (drive, rate, channels))[1]


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
    ports: dict[str, Change]
    scale: Change | None
    states: tuple[Change, ...]
    motion: Motion


@eqx.filter_jit
def slopes_along(
    model: Isolator, moving: tuple[int, ...], scale: Array, path: State, batch: Batch, quantity: Quantity
) -> Slopes:
    """Differentiate rates and reading along the path.

    A law that jumps has no slope: its rates are those of the rounded law, of use to ports alone; what it does
    to changes of states and parameters is in `transitions_along`.
    """
    values = tuple(entry.value for entry in list_parameters(model))
    tables = {name: nodes_of(table) for name, table in batch.channels.items()}
    drives, drive_rates = nodes_of(batch.drive), nodes_of(batch.drive_rate)
    channels = {name: table[:, 0] for name, table in tables.items()}
    u, du = drives[:, 0], drive_rates[:, 0]
    scale = jnp.broadcast_to(scale, u.shape)
    present = scaled_model(model, values, scale)
    regime = find_regime(present, path, u, du, channels) if model.splits else None

    def along(values: tuple[Array, ...], scale: Array, state: State, port: dict[str, Array]) -> Change:
        current = scaled_model(model, values, scale)
        late = current.shift() - jax.lax.stop_gradient(current.shift())
        acted = u - late * du
        if port:
            acted = acted + port["recorded"]
            small = Perturbation(port["acted"], port["force"], port["mass"], port["base"], port["read"])
            current = Isolator(current.mass, (*current.elements, small), current.excitation)
        followed = {**channels, "perturbation": port["base"]} if port else channels
        rates = current.rates(state, acted, du, quantity, channels=followed)[1 : len(state)]
        return Change(rates, current.reading(state, acted, du, quantity, followed, regime))

    def by_parameter(place: int) -> Change:
        def with_number(number: Array) -> Change:
            return along((*values[:place], number, *values[place + 1 :]), scale, path, {})

        return jax.jvp(with_number, (values[place],), (jnp.ones(()),))[1]

    def by_port(name: str) -> Change:
        nothing = {port: jnp.zeros(()) for port in PORTS}

        def with_port(amount: Array) -> Change:
            return along(values, scale, path, nothing | {name: amount})

        return jax.jvp(with_port, (jnp.zeros(()),), (jnp.ones(()),))[1]

    def by_state(index: int) -> Change:
        def shifted(number: Array) -> Change:
            return along(values, scale, (*path[:index], number, *path[index + 1 :]), {})

        return jax.jvp(shifted, (path[index],), (jnp.ones_like(path[index]),))[1]

    by_scale = None
    if has_stiffness_scale(model):
        by_scale = jax.jvp(lambda s: along(values, s, path, {}), (scale,), (jnp.ones_like(scale),))[1]

    ends = tuple(jnp.concatenate([state[1:], state[-1:]]) for state in path)
    befores = tuple(jnp.concatenate([state[:1], state[:-1]]) for state in path)
    afters = tuple(jnp.concatenate([state[1:], state[-1:]]) for state in ends)
    middles = tuple(map(cubic_middle, befores, path, ends, afters))
    seen = []
    for stage, state in enumerate((path, middles, ends)):
        beside = {name: table[:, stage] for name, table in tables.items()}
        now, rate = drives[:, stage], drive_rates[:, stage]
        base = present.base(now, rate, beside)
        y = read_record(present, state, now, rate, quantity, beside)
        seen.append((state[0], state[1], y) if base is None else (state[0], state[1], y, base))
    acted, acted_rate = present.acting(u, du, channels)
    motion = Motion(
        path[0],
        path[1],
        du,
        acted,
        jnp.broadcast_to(acted_rate, acted.shape),
        present.sensed(path, u, du, quantity, channels, regime),
        tuple(jnp.stack(three, axis=1) for three in zip(*seen, strict=True)),
        {},
    )
    return Slopes(
        seen[0][2],
        tuple(map(by_parameter, moving)),
        {name: by_port(name) for name in PORTS},
        by_scale,
        tuple(map(by_state, range(len(path)))),
        motion,
    )
