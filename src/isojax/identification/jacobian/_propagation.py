"""From sample to sample: how a small change of the states, and what pushes it, goes on."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..._kernel_scan import kernel_scan
from ..._quick_jit import quick_jit
from ..._types import Scalar
from ._slopes import Change, cubic_middle

Matrix = list[list[Array]]
"""A small matrix whose entries are series over (time, lanes)."""


class Propagation(NamedTuple):
    """What one sample makes of a small change d: `d+ = F d + G0 b + Gm bm + G1 b+`.

    Attributes:
        forward: F.
        by_start: G0, what the rates b at its start add; its first column, of the velocity, is unused.
        by_middle: Gm, of those in the middle.
        by_end: G1, of those at the end.

    Of a model whose laws jump each has two rows more: what d and b do to the readings at the start and the
    end of the sample.
    """

    forward: Matrix
    by_start: Matrix
    by_middle: Matrix
    by_end: Matrix


def product(left: Matrix, right: Matrix) -> Matrix:
    """Multiply small matrices: written out, so that all of it is one pass over the series."""
    columns = list(zip(*right, strict=True))

    def entry(row: list[Array], column: tuple[Array, ...]) -> Array:
        return sum((a * b for a, b in zip(row, column, strict=True)), jnp.zeros(()))

    return [[entry(row, column) for column in columns] for row in left]


def weighted_sum(*terms: tuple[Array | float, Matrix]) -> Matrix:
    """Add small matrices, the first number of each term times its matrix."""
    size = range(len(terms[0][1]))
    return [[sum((f * m[row][column] for f, m in terms), jnp.zeros(())) for column in size] for row in size]


def around(values: Array) -> tuple[Array, Array, Array, Array]:
    """Give the values at the samples before and at the start of each step, at its end and after that."""
    time = values.shape[0]
    padded = jnp.concatenate([values[:1], values, values[-1:], values[-1:]])
    before, now, ahead, after = (padded[first : first + time] for first in range(4))
    return before, now, ahead, after


@quick_jit
def propagate(by_state: tuple[Change, ...], step: Scalar) -> Propagation:
    """Give what a Runge-Kutta step of the linear equation `d' = A(t) d + b(t)` does; it is linear itself.

    Args:
        by_state: slopes with each state, whose rates are the rows of A but the first; between samples A
            follows cubics through four.
        step: time between samples [s].

    Returns:
        The propagation.
    """
    size = len(by_state)
    still = jnp.zeros_like(by_state[0].rates[0])
    one = [[still + float(row == column) for column in range(size)] for row in range(size)]
    start = [one[1], *([entry.rates[row] for entry in by_state] for row in range(size - 1))]
    beside = [[around(entry) for entry in row] for row in start]
    middle = [[cubic_middle(*four) for four in row] for row in beside]
    end = [[four[2] for four in row] for row in beside]
    k2 = product(middle, weighted_sum((1.0, one), (0.5 * step, start)))
    k3 = product(middle, weighted_sum((1.0, one), (0.5 * step, k2)))
    k4 = product(end, weighted_sum((1.0, one), (step, k3)))
    sixth = step / 6.0
    twice = product(middle, middle)
    return Propagation(
        weighted_sum((1.0, one), (sixth, start), (2.0 * sixth, k2), (2.0 * sixth, k3), (sixth, k4)),
        weighted_sum(
            (sixth, one),
            (sixth * step, middle),
            (0.5 * sixth * step**2, twice),
            (0.25 * sixth * step**3, product(end, twice)),
        ),
        weighted_sum(
            (4.0 * sixth, one),
            (sixth * step, middle),
            (sixth * step, end),
            (0.5 * sixth * step**2, product(end, middle)),
        ),
        weighted_sum((sixth, one)),
    )


@quick_jit
def respond(
    propagation: Propagation,
    readings: tuple[Float[Array, "time lanes"], ...],
    forcing: Float[Array, "row time column lanes"],
    kicks: Float[Array, "effect time column lanes"] | None,
    direct: Float[Array, "time column lanes"],
    starts: Float[Array, "state column lanes"],
    weight: Float[Array, "time lanes"],
    gains: tuple[Float[Array, "time lanes"], ...] = (),
) -> Float[Array, "time column lanes"]:
    """Carry some columns from sample to sample.

    Args:
        propagation: what each sample does to them.
        readings: what a unit of each state does to the reading.
        forcing: rates of the states but the first that push them; between samples they follow cubics.
        kicks: what else each sample adds to the states and to the readings at its ends, if anything.
        direct: what the columns do to the reading at once.
        starts: where they begin.
        weight: of each reading.
        gains: by which a filter corrects each state by what is read; none of a simulation.

    Returns:
        What the weighted reading does.
    """
    size, last = starts.shape[0], forcing.shape[1] - 1
    splits = len(propagation.forward) > size

    def body(carry: tuple, table: tuple) -> tuple[tuple, Float[Array, "column lanes"]]:
        d, (before, now, ahead), pending = carry
        place, by, seen, at_once, weigh, gain = table
        reading = sum((one * slope[None] for one, slope in zip(d, seen, strict=True)), start=at_once)
        d = (*(one - k[None] * reading for one, k in zip(d, gain, strict=False)), *d[len(gain) :])
        # All in one pass: tables of what pushes each sample would cost more than the pushing.
        after = jax.lax.dynamic_index_in_dim(forcing, jnp.minimum(place + 2, last), 1, keepdims=False)
        kick = None if kicks is None else jax.lax.dynamic_index_in_dim(kicks, place, 1, keepdims=False)
        pushes = ((by[1], now), (by[2], cubic_middle(before, now, ahead, after)), (by[3], ahead))
        moved = []
        for row, onward in enumerate(by[0]):
            pushed = jnp.zeros(()) if kick is None else kick[row]
            for matrix, rates in pushes:
                for column, rate in enumerate(rates):
                    pushed = pushed + matrix[row][column + 1][None] * rate
            moved.append(sum((f[None] * one for f, one in zip(onward, d, strict=True)), start=pushed))
        if splits:
            reading, pending = reading + moved[size] + pending, moved[size + 1]
        return (tuple(moved[:size]), (now, ahead, after), pending), reading * weigh[None]

    window = forcing[:, 0], forcing[:, 0], forcing[:, 1]
    tables = jnp.arange(last + 1), propagation, readings, direct, weight, gains
    return kernel_scan(body, (tuple(starts), window, jnp.zeros_like(starts[0])), tables)[1]
