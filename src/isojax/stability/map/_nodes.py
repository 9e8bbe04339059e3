"""Orbits of imposed displacement at the nodes of a grid: with the displacement given, the drive is sought."""

import math
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ..._cores import usable_cores
from ..._quick_jit import quick_jit
from ..._small_systems import determinant, solve
from ..._types import Lanes
from ...models import Integrator, Isolator
from ..orbit import (
    Crossings,
    PeriodicDrive,
    Sine,
    balanced_motion,
    follow_events,
    half_range,
    period_map,
    trajectory,
    turning_map,
    value_and_jacobian,
    with_overtones,
)
from ._map_method import Lane, MapMethod, kinks_between

_START_STEPS = 6
"""Steps of Newton's method from the balance of one harmonic."""

_MOST_CLOSING_STEPS, _MOST_TURNING_STEPS = 6, 24
"""Steps of Newton's method at most from orbits that were read off a coarser grid; from the balance of one
harmonic under dry friction."""

_NEARLY_CLOSED = 1e-4
"""Relative step of Newton's method after which one more, whose size is its square, is the last."""

_NODE_CLOSED_TO = 1e-7
"""Last relative step before which the multipliers of a node count as exact."""

_START_CLOSED_TO = 1e-6
"""What a start may leave open, over its size; where it leaves more, the one-harmonic balance is kept."""

_MOST_NODE_CROSSINGS = 16
"""Kinks an orbit to make room for."""

_ANY_STEPS = 8
"""Steps of an integrator that are of no consequence."""

_NODES_A_BLOCK = 544
"""Nodes solved at once: one compiled batch serves grids of any size, and each core runs its own."""


class NodeStarts(NamedTuple):
    """Orbits of nodes, not split at kinks; node first.

    Attributes:
        unknown: fundamental of the drive in phase (sine) and in quadrature (cosine) over the displacement
            amplitude [N/m], then the internal states at the largest displacement over it.
        crossings: the kinks that each passes.
    """

    unknown: Float[np.ndarray, "node unknown"]
    crossings: Crossings


class NodeOrbits(NamedTuple):
    """Closed orbits of nodes, split at kinks; node first.

    Attributes:
        unknown: as of `NodeStarts`, then the phases of the kinks.
        invariants: half the trace and the determinant of the derivative of the period map, or of the half.
        closed: whether each is closed.
    """

    unknown: Float[np.ndarray, "node unknown"]
    invariants: Float[np.ndarray, "node 2"]
    closed: Bool[np.ndarray, " node"]


def in_blocks(work: Callable[..., Any], *values: np.ndarray) -> Any:
    """Do the work on blocks of nodes, as many at once as there are cores.

    Args:
        work: on as many nodes as one compiled batch holds.
        *values: of the nodes, node first.

    Returns:
        What the work gives, of all nodes.
    """
    count = values[0].shape[0]

    def one(begin: int) -> Any:
        rows = [value[begin : begin + _NODES_A_BLOCK] for value in values]
        fill = _NODES_A_BLOCK - rows[0].shape[0]
        padded = [np.concatenate([row, np.repeat(row[-1:], fill, axis=0)]) for row in rows]
        return jax.tree.map(np.asarray, work(*padded))

    with ThreadPoolExecutor(usable_cores()) as pool:
        parts = list(pool.map(one, range(0, count, _NODES_A_BLOCK)))
    return jax.tree.map(lambda *own: np.concatenate(own)[:count], *parts)


def node_starts(
    model: Isolator,
    integrator: Integrator,
    half: bool,
    rest: float,
    amplitude: Float[np.ndarray, " node"],
    frequency: Float[np.ndarray, " node"],
) -> NodeStarts:
    """Find orbits of imposed displacement from the balance of one harmonic.

    Args:
        model: the isolator.
        integrator: steps a period.
        half: whether to use the half-period map.
        rest: displacement at rest [m].
        amplitude: largest displacement over rest [m].
        frequency: [Hz].

    Returns:
        The orbits; where none was found the balance.
    """
    return NodeStarts(
        *in_blocks(
            lambda a, f: _starts(model, integrator, half, jnp.asarray(rest), a, f), amplitude, frequency
        )
    )


@quick_jit
def _starts(
    model: Isolator, integrator: Integrator, half: bool, rest: Array, amplitude: Array, frequency: Array
) -> tuple[Array, Crossings]:
    turns = 0.5 if half else 1.0

    def node(a: Array, f: Array) -> tuple[Array, Crossings]:
        guess, cycle, _ = balanced_motion(model, a, f, rest)
        push = jnp.hypot(guess.sine, jnp.asarray(guess.cosine))
        internal = jnp.stack([values[0] for values in cycle]) if cycle else jnp.zeros(0)
        inner = jnp.where(internal == 0.0, a, jnp.abs(internal))
        omega = 2.0 * math.pi * f

        def unpack(unknown: Array) -> tuple[PeriodicDrive, tuple[Lanes, ...]]:
            state = (rest + a, 0.0 * a, *(unknown[2:] * inner))
            return with_overtones(model, Sine(unknown[0] * push, unknown[1] * push, f)), state

        def gap(unknown: Array) -> Array:
            drive, state = unpack(unknown)
            moved = period_map(model, integrator, drive, state, turns=turns)
            scale = (a, a * omega, *inner)
            return jnp.stack([(m - s) / c for m, s, c in zip(moved, state, scale, strict=True)])

        start = jnp.concatenate([jnp.stack([guess.sine, guess.cosine]) / push, internal / inner])

        def improve(_: Array | int, unknown: Array) -> Array:
            left, slope = value_and_jacobian(gap, unknown)
            step = solve(slope, left)
            # Far from the balance of one harmonic a full step may leave the basin.
            return unknown - step * jnp.minimum(1.0, 0.5 / jnp.max(jnp.abs(step)))

        over = jnp.concatenate([jnp.full(2, push), inner]) / a
        if model.slides:
            # At its largest displacement, where it starts, friction turns the motion: see `_closed`.
            nothing = Crossings(jnp.zeros(0), jnp.zeros(0, int), None, jnp.array(True))
            return start * over, nothing
        found = jax.lax.fori_loop(0, _START_STEPS, improve, start)
        good = jnp.all(jnp.isfinite(found)) & (jnp.max(jnp.abs(gap(found))) < _START_CLOSED_TO)
        unknown = jnp.where(good, found, start)
        drive, state = unpack(unknown)
        steps = round(integrator.steps_a_period(model) * turns)
        end = 2.0 * math.pi * turns
        crossings = follow_events(model, drive, state, end, steps, _MOST_NODE_CROSSINGS).crossings
        return unknown * over, crossings

    return jax.vmap(node)(amplitude, frequency)


def closed_nodes(
    model: Isolator,
    method: MapMethod,
    rest: float,
    amplitude: Float[np.ndarray, " node"],
    frequency: Float[np.ndarray, " node"],
    start: Float[np.ndarray, "node unknown"],
) -> NodeOrbits:
    """Close orbits of imposed displacement, split at their kinks, to machine precision.

    Unknown are the drive, the internal states at the largest displacement and the phases of the kinks that
    all orbits share. Under dry friction each is split at its own events instead.

    Args:
        model: the isolator.
        method: how to integrate.
        rest: displacement at rest [m].
        amplitude: largest displacement over rest [m].
        frequency: [Hz].
        start: near the orbits, as `NodeOrbits.unknown`.

    Returns:
        The orbits.
    """
    # The steps are a number on the device: with those of the integrator each count would be compiled anew.
    integrator = method.integrator.with_steps(_ANY_STEPS)
    method = MapMethod(integrator, method.half, method.sides, method.steps)

    def work(*rows: np.ndarray) -> tuple[Array, Array, Array]:
        return _closed(model, method, jnp.asarray(rest), *map(jnp.asarray, rows))

    return NodeOrbits(*in_blocks(work, amplitude, frequency, start))


@quick_jit
def _closed(
    model: Isolator, method: MapMethod, rest: Array, amplitude: Array, frequency: Array, start: Array
) -> tuple[Array, Array, Array]:
    states = 2 + model.internal_states

    def left(a: Array, f: Array, scale: Array, unknown: Array, shift: Array) -> tuple[Array, Array, Array]:
        """Give what is missing, the scaled state at the end, and the saltation at the start."""
        real = unknown * scale
        sizes = jnp.concatenate([jnp.stack([a, a * 2.0 * math.pi * f]), a * scale[2:states]])
        state = jnp.concatenate([jnp.stack([rest + a, 0.0 * a]), a * real[2:states]]) + shift * sizes
        drive = Sine(a * real[0], a * real[1], f)
        if model.slides:
            acting, steps = with_overtones(model, drive), method.steps_over_map
            moved, late, saltation = turning_map(model, acting, tuple(state), method.half, steps)
            end = jnp.stack(moved) / sizes
            return (end - state / sizes).at[1].set(late), end, saltation
        assert method.sides is not None
        lane = Lane(tuple(state), drive, tuple(real[states:]), a)
        moved, reached = method.moved_past(model, lane, kinks_between(method.sides))
        moved = jnp.stack(moved)
        return jnp.concatenate([(moved - state) / sizes, reached]), moved / sizes, jnp.ones(())

    def newton(a: Array, f: Array, scale: Array, unknown: Array) -> tuple[Array, Array]:
        """Give the step of Newton's method and its size."""
        gap, slope = value_and_jacobian(lambda own: left(a, f, scale, own, jnp.zeros(states))[0], unknown)
        step = solve(slope, gap)
        size = jnp.max(jnp.abs(step))
        return step * jnp.minimum(1.0, 0.3 / size), size

    def last(a: Array, f: Array, scale: Array, unknown: Array) -> tuple[Array, Array, Array]:
        """Give the last step, its size, and half the trace and the determinant of the map's derivative."""
        count = unknown.size

        def whole(own: Array) -> Array:
            gap, moved, saltation = left(a, f, scale, own[:count], own[count:])
            return jnp.concatenate([gap, moved, saltation[None]])

        out, slope = value_and_jacobian(whole, jnp.concatenate([unknown, jnp.zeros(states)]))
        step = solve(slope[:count, :count], out[:count])
        by_start = slope[:, count:]
        matrix = by_start[count : count + states]
        if count > states:
            # The instants of the kinks follow the disturbance.
            follow = solve(slope[states:count, states:count], by_start[states:count])
            matrix = matrix - slope[count : count + states, states:count] @ follow
        matrix = matrix.at[:, 1].multiply(out[-1])
        return step, jnp.max(jnp.abs(step)), jnp.stack([0.5 * jnp.trace(matrix), determinant(matrix)])

    def scaled(begin: Array) -> Array:
        push = jnp.full(2, jnp.hypot(begin[0], begin[1]))
        inner = begin[2:states]
        return jnp.concatenate(
            [push, jnp.where(inner == 0.0, 1.0, jnp.abs(inner)), jnp.ones(begin.size - states)]
        )

    scale = jax.vmap(scaled)(start)

    def body(carry: tuple[Array, Array, Array]) -> tuple[Array, Array, Array]:
        unknown, _, count = carry
        step, size = jax.vmap(newton)(amplitude, frequency, scale, unknown)
        return unknown - step, size, count + 1

    most = _MOST_TURNING_STEPS if model.slides else _MOST_CLOSING_STEPS

    def unfinished(carry: tuple[Array, Array, Array]) -> Array:
        _, size, count = carry
        return jnp.any((size > _NEARLY_CLOSED) & jnp.isfinite(size)) & (count < most)

    begin = (start / scale, jnp.full(amplitude.shape, 1.0), jnp.asarray(0))
    unknown, _, _ = jax.lax.while_loop(unfinished, body, begin)
    step, size, invariants = jax.vmap(last)(amplitude, frequency, scale, unknown)
    closed = (size <= _NODE_CLOSED_TO) & jnp.all(jnp.isfinite(invariants), axis=1)
    return (unknown - step) * scale, invariants, closed


def node_responses(
    model: Isolator,
    integrator: Integrator,
    half: bool,
    rest: float,
    amplitude: Float[np.ndarray, " node"],
    frequency: Float[np.ndarray, " node"],
    unknown: Float[np.ndarray, "node unknown"],
) -> Float[np.ndarray, " node"]:
    """Give half the peak-to-peak displacement of orbits, over their largest displacement from rest.

    Args:
        model: the isolator.
        integrator: steps a period.
        half: whether the second half of each motion is minus the first.
        rest: displacement at rest [m].
        amplitude: largest displacement over rest [m].
        frequency: [Hz].
        unknown: as of `NodeStarts`.

    Returns:
        The sizes.
    """
    return in_blocks(
        lambda *rows: _responses(model, integrator, half, jnp.asarray(rest), *rows),
        amplitude,
        frequency,
        unknown,
    )


@quick_jit
def _responses(
    model: Isolator,
    integrator: Integrator,
    half: bool,
    rest: Array,
    amplitude: Array,
    frequency: Array,
    unknown: Array,
) -> Array:
    turns = 0.5 if half else 1.0

    def node(a: Array, f: Array, own: Array) -> Array:
        state = (rest + a, 0.0 * a, *(own[2:] * a))
        drive = with_overtones(model, Sine(own[0] * a, own[1] * a, f))
        return half_range(model, drive, trajectory(model, integrator, drive, state, turns=turns), turns) / a

    return jax.vmap(node)(amplitude, frequency, unknown)
