"""What one integration step makes of small changes, exactly, where records are split at events.

A law that jumps has no slope along the path: a small change of the velocity before a reversal is another
after it. The derivative of the split step itself knows by how much.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..._parameters import list_parameters
from ..._quick_jit import quick_jit
from ..._types import Scalar
from ...models import Instant, Isolator, Quantity, State, Step, find_ringing, split_step
from ._propagation import Matrix, Propagation, product
from ._slopes import steps_of
from ._unknowns import scaled_model

_AT_ONCE = 32
"""Steps that are differentiated side by side: their derivatives stay in the processor's cache."""


class Transitions(NamedTuple):
    """What each sample adds to the state at its end, then to the readings at its start and its end.

    Attributes:
        propagation: for a unit of each state at its start, and for rates that push.
        parameters: for a unit of each parameter that moves.
        scale: for a unit of the stiffness scale.
    """

    propagation: Propagation
    parameters: Float[Array, "row parameter time lanes"]
    scale: Float[Array, "row time lanes"]


@quick_jit
def transitions_along(
    model: Isolator,
    moving: tuple[int, ...],
    scale: Float[Array, " lanes"],
    path: State,
    acting: Instant,
    quantity: Quantity,
    sample_time: Scalar,
    ringing: Float[Array, ""],
) -> Transitions:
    """Differentiate each split step along a path.

    Args:
        model: the isolator.
        moving: its parameters that move.
        scale: factor on the linear stiffness, a lane each.
        path: states at the beginnings of the steps.
        acting: what acts at the stages of each sample.
        quantity: what the sensor measures.
        sample_time: time between samples [s].
        ringing: share of the ringing of jumps that the samples hold.

    Returns:
        The derivatives.
    """
    values = tuple(entry.value for entry in list_parameters(model))
    size, (nodes, lanes), time = len(path), path[0].shape, acting.drive.shape[0]
    steps = nodes // time
    step_time = sample_time / steps
    known = tuple(values[place] for place in moving)
    still = jnp.zeros((_AT_ONCE, lanes))
    nothing = (
        tuple(jnp.zeros(()) for _ in moving),
        still,
        tuple(still for _ in path),
        jnp.zeros((3, size - 1)),
    )
    seeds = []
    for place in range(size):
        seeds.append((*nothing[:2], tuple(s + (i == place) for i, s in enumerate(nothing[2])), nothing[3]))
    for stage in range(3):
        seeds += [(*nothing[:3], nothing[3].at[stage, row].set(1.0)) for row in range(size - 1)]
    for place in range(len(moving)):
        seeds.append((tuple(s + (i == place) for i, s in enumerate(nothing[0])), *nothing[1:]))
    seeds.append((nothing[0], still + 1.0, *nothing[2:]))
    stacked = jax.tree_util.tree_map(lambda *each: jnp.stack(each), *seeds)

    def differentiate(piece: tuple[State, Instant, Array]) -> Array:
        path, acting, step_of_sample = piece
        stages = tuple(acting.pick(np.s_[:, stage]) for stage in range(3))

        def step(moved: tuple[Array, ...], scale: Array, state: State, push: Array) -> Array:
            numbers = list(values)
            for place, number in zip(moving, moved, strict=True):
                numbers[place] = number
            current = scaled_model(model, numbers, scale)
            pushes = tuple(
                (still, *(push[stage, row] + still for row in range(size - 1))) for stage in range(3)
            )
            pushed = Step(step_time, tuple(current.with_delay_slope(at) for at in stages), pushes)
            ahead, jump = split_step(current, quantity, state, pushed)
            return jnp.stack([*ahead, *(ringing * one for one in find_ringing(jump, step_of_sample, steps))])

        here = known, jnp.broadcast_to(scale, still.shape), path, nothing[3]
        return jax.vmap(lambda seed: jax.jvp(step, here, seed)[1])(stacked)

    def in_pieces(table: Array) -> Array:
        padded = jnp.concatenate([table, table[-1:].repeat(-nodes % _AT_ONCE, axis=0)])
        return padded.reshape(-1, _AT_ONCE, *table.shape[1:])

    tables = path, jax.tree_util.tree_map(steps_of, acting), jnp.tile(jnp.arange(steps), time)[:, None]
    found = jax.lax.map(differentiate, jax.tree_util.tree_map(in_pieces, tables))
    found = found.transpose(2, 1, 0, 3, 4).reshape(size + 2, len(seeds), -1, lanes)[:, :, :nodes]
    found = found.reshape(size + 2, len(seeds), -1, steps, lanes)
    return _over_samples([found[:, :, :, step] for step in range(steps)], size)


def _over_samples(each: list[Array], size: int) -> Transitions:
    """Join the steps of a sample; what pushes follows a parabola through its start, middle and end.

    Rows of states go on from step to step, those of readings add up.
    """
    steps, pushes_end = len(each), size + 3 * (size - 1)
    rows = range(size + 2)
    nothing = jnp.zeros_like(each[0][0, 0])
    forward = [[nothing + float(row == column) for column in range(size)] for row in rows]
    pushed = [[[nothing for _ in range(size)] for _ in rows] for _ in range(3)]
    rest = jnp.zeros_like(each[0][:, pushes_end:])

    def joined(onward: Matrix, so_far: Matrix) -> Matrix:
        moved = product(onward, so_far[:size])
        read = [
            [old + new for old, new in zip(*both, strict=True)]
            for both in zip(so_far[size:], moved[size:], strict=True)
        ]
        return [*moved[:size], *read]

    for step, found in enumerate(each):
        onward = [[found[row, column] for column in range(size)] for row in rows]
        forward = joined(onward, forward)
        pushed = [joined(onward, one) for one in pushed]
        carried = jnp.stack([sum(onward[row][k][None] * rest[k] for k in range(size)) for row in rows])
        rest = carried.at[size:].add(rest[size:]) + found[:, pushes_end:]
        for stage in range(3):
            at = (step + 0.5 * stage) / steps
            # Lagrange's parabolas through 0, 1/2 and 1.
            shares = (2.0 * at - 1.0) * (at - 1.0), 4.0 * at * (1.0 - at), at * (2.0 * at - 1.0)
            for place, share in enumerate(shares):
                for row in rows:
                    for column in range(1, size):
                        own = found[row, size + stage * (size - 1) + column - 1]
                        pushed[place][row][column] = pushed[place][row][column] + share * own
    return Transitions(Propagation(forward, *pushed), rest[:, :-1], rest[:, -1])
