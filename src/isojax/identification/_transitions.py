"""What one integration step makes of small changes, exactly, where records are split at events.

A law that jumps has no slope along the path: a small change of the velocity before a reversal is another
after it. The derivative of the split step itself knows by how much.
"""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from .._parameters import list_parameters
from ..models import Isolator, Quantity, State, Table, split_step
from ._information import scaled_model


class Transitions(NamedTuple):
    """What each step adds to the state at its end.

    Attributes:
        states: for a unit of each state at its beginning.
        pushes: for a unit rate of each state but the first, at its beginning, middle and end.
        parameters: for a unit of each parameter that moves.
        scale: for a unit of the stiffness scale.
    """

    states: Float[Array, "state change node lanes"]
    pushes: Float[Array, "state stage row node lanes"]
    parameters: Float[Array, "state parameter node lanes"]
    scale: Float[Array, "state node lanes"]


@eqx.filter_jit
def transitions_along(
    model: Isolator,
    moving: tuple[int, ...],
    scale: Float[Array, " lanes"],
    path: State,
    tables: tuple[Array, Array, dict[str, Array]],
    quantity: Quantity,
    step_time: float,
) -> Transitions:
    """Differentiate each split step along a path.

    Args:
        model: the isolator.
        moving: its parameters that move.
        scale: factor on the linear stiffness, a lane each.
        path: states at the beginnings of the steps.
        tables: drive, its rate and channels at beginning, middle and end of each step.
        quantity: what the sensor measures.
        step_time: length of a step [s].

    Returns:
        The derivatives.
    """
    values = tuple(entry.value for entry in list_parameters(model))
    size, like = len(path), path[0]
    scale = jnp.broadcast_to(scale, like.shape)
    drive, rate = (tuple(table[:, stage] for stage in range(3)) for table in tables[:2])
    channels = tuple({name: table[:, stage] for name, table in tables[2].items()} for stage in range(3))

    def step(moved: tuple[Array, ...], scale: Array, state: State, push: Array) -> Array:
        numbers = list(values)
        for place, number in zip(moving, moved, strict=True):
            numbers[place] = number
        current = scaled_model(model, numbers, scale)
        late = current.shift() - jax.lax.stop_gradient(current.shift())
        u = tuple(value - late * slope for value, slope in zip(drive, rate, strict=True))
        pushes = tuple(
            (jnp.zeros_like(like), *(push[stage, row] + 0.0 * like for row in range(size - 1)))
            for stage in range(3)
        )
        return jnp.stack(split_step(current, quantity, step_time, state, Table(u, rate, channels, pushes)))

    known = tuple(values[place] for place in moving)
    nothing = (
        tuple(jnp.zeros(()) for _ in moving),
        jnp.zeros_like(scale),
        tuple(jnp.zeros_like(state) for state in path),
        jnp.zeros((3, size - 1)),
    )
    seeds = []
    for place in range(size):
        seeds.append((*nothing[:2], tuple(s + (i == place) for i, s in enumerate(nothing[2])), nothing[3]))
    for stage in range(3):
        seeds += [(*nothing[:3], nothing[3].at[stage, row].set(1.0)) for row in range(size - 1)]
    for place in range(len(moving)):
        seeds.append((tuple(s + (i == place) for i, s in enumerate(nothing[0])), *nothing[1:]))
    seeds.append((nothing[0], jnp.ones_like(scale), *nothing[2:]))

    def along(seed: tuple) -> Array:
        return jax.jvp(step, (known, scale, path, nothing[3]), seed)[1]

    # One derivative after the other: side by side they would hold as many copies of the path.
    found = jnp.moveaxis(jax.lax.map(along, jax.tree_util.tree_map(lambda *s: jnp.stack(s), *seeds)), 0, 1)
    ends = size + 3 * (size - 1)
    pushes = found[:, size:ends].reshape(size, 3, size - 1, *like.shape)
    return Transitions(found[:, :size], pushes, found[:, ends:-1], found[:, -1])


@eqx.filter_jit
def respond_in_steps(
    transitions: Transitions,
    by_state: tuple[Array, ...],
    forcing: Float[Array, "row column node lanes"],
    kicks: Float[Array, "state column node lanes"],
    direct: Float[Array, "column time lanes"],
    starts: Float[Array, "state column lanes"],
    weight: Float[Array, "time lanes"],
) -> Float[Array, "lanes column time"]:
    """Carry some columns from step to step.

    Args:
        transitions: what each step does.
        by_state: what a unit of each state does to the reading, at the nodes.
        forcing: rates that push the columns at the nodes; between them they follow cubics through four.
        kicks: what else each step adds to the columns.
        direct: what the columns do to the reading at once.
        starts: where the columns begin.
        weight: of each reading.

    Returns:
        What the weighted reading does.
    """
    steps = forcing.shape[2] // weight.shape[0]
    pushed = jnp.moveaxis(forcing, 2, 0)
    nexts = jnp.concatenate([pushed[1:], pushed[-1:]])
    befores, afters = jnp.concatenate([pushed[:1], pushed[:-1]]), jnp.concatenate([nexts[1:], nexts[-1:]])
    middles = (9.0 * (pushed + nexts) - befores - afters) / 16.0

    def body(d: Array, table: tuple[Array, ...]) -> tuple[Array, Array]:
        onward, pushes, now, middle, after, kick = table
        moved = kick + jnp.einsum("scl,ckl->skl", onward, d)
        for stage, rates in enumerate((now, middle, after)):
            moved = moved + jnp.einsum("srl,rkl->skl", pushes[:, stage], rates)
        return moved, d

    tables = (jnp.moveaxis(transitions.states, 2, 0), jnp.moveaxis(transitions.pushes, 3, 0))
    path = jax.lax.scan(body, starts, (*tables, pushed, middles, nexts, jnp.moveaxis(kicks, 2, 0)))[1]
    seen = jnp.stack(by_state, axis=1)
    rows = jnp.einsum("tskl,tsl->tkl", path[::steps], seen[::steps]) + jnp.swapaxes(direct, 0, 1)
    return jnp.transpose(rows * weight[:, None], (2, 1, 0))
