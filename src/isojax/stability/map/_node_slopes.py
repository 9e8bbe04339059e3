"""How the orbits of imposed displacement at the nodes of a grid move with the parameters of the isolator."""

import math
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..._quick_jit import quick_jit
from ..._small_systems import determinant, solve
from ...models import Isolator
from ..orbit import Sine, half_range, trajectory, with_overtones
from ._map_method import Lane, MapMethod, kinks_between
from ._nodes import in_blocks

TABLES = 5
"""Drive, sine and cosine; sum and product of the multipliers; size of the motion over the displacement."""


class Directions(NamedTuple):
    """Parameters by which orbits are differentiated, as changes of the isolator and of its drive.

    Attributes:
        model: derivative of the isolator's numbers by each, parameter last; None for those that no parameter
            moves.
        frequency: of the frequency of the drive.
        amplitude: of its amplitude.
        scale: size of each parameter, by which changes by different ones are compared.
    """

    model: Isolator
    frequency: Float[np.ndarray, " parameter"]
    amplitude: Float[np.ndarray, " parameter"]
    scale: Float[np.ndarray, " parameter"]


class NodeSlopes(NamedTuple):
    """Tables of closed nodes and their derivatives at the same displacement; node first.

    Attributes:
        values: the drive, sine and cosine [N, or m/s^2 for base excitation]; sum and product of the Floquet
            multipliers; half the peak-to-peak displacement over the displacement amplitude.
        slopes: derivatives of these by each parameter.
    """

    values: Float[np.ndarray, "node table"]
    slopes: Float[np.ndarray, "node table parameter"]


def node_slopes(
    model: Isolator,
    directions: Directions,
    method: MapMethod,
    rest: float,
    amplitude: Float[np.ndarray, " node"],
    frequency: Float[np.ndarray, " node"],
    unknown: Float[np.ndarray, "node unknown"],
) -> NodeSlopes:
    """Differentiate closed orbits of imposed displacement, by the implicit function theorem.

    Args:
        model: the isolator, of two states.
        directions: the parameters.
        method: how to integrate.
        rest: displacement from which the amplitude counts [m].
        amplitude: largest displacement over it [m].
        frequency: [Hz].
        unknown: as of `NodeOrbits`, closed.

    Returns:
        The tables.
    """
    assert method.sides is not None
    kinks = kinks_between(method.sides)

    def work(*rows: np.ndarray) -> tuple[Array, Array]:
        # What no parameter moves is left out: a derivative that is zero costs as much as another.
        rate = jnp.asarray(directions.frequency) if directions.frequency.any() else None
        count = directions.frequency.size
        return _slopes(
            model, (directions.model, rate, count), method, kinks, jnp.asarray(rest), *map(jnp.asarray, rows)
        )

    return NodeSlopes(*in_blocks(work, amplitude, frequency, unknown))


@quick_jit
def _slopes(
    model: Isolator,
    moved: tuple[Isolator, Array | None, int],
    method: MapMethod,
    kinks: Array,
    rest: Array,
    amplitude: Array,
    frequency: Array,
    unknown: Array,
) -> tuple[Array, Array]:
    by_model, by_frequency, parameters = moved
    by, places = jax.tree.flatten(by_model, is_leaf=lambda leaf: leaf is None)
    leaves = places.flatten_up_to(model)

    def node(a: Array, f: Array, found: Array) -> tuple[Array, Array]:
        count = found.size
        # The instants of kinks are phases, of order one.
        scale = jnp.concatenate([jnp.full(2, jnp.hypot(found[0], found[1])), jnp.ones(count - 2)])

        def orbit(at: Array) -> tuple[tuple[Array, Array], Array]:
            real, change = at[:count] * scale, at[count:]
            own = places.unflatten(
                [
                    leaf if slope is None else leaf + slope @ change
                    for leaf, slope in zip(leaves, by, strict=True)
                ]
            )
            rate = f if by_frequency is None else f + by_frequency @ change
            drive = Sine(a * real[0], a * real[1], rate)
            state = jnp.stack([rest + a, 0.0 * a])

            def after(shift: Array) -> tuple[Array, Array]:
                lane = Lane(tuple(state + shift), drive, tuple(real[2:]), a)
                end, reached = method.moved_past(own, lane, kinks)
                gap = (jnp.stack(end) - state) / jnp.stack([a, a * 2.0 * math.pi * f])
                return jnp.stack(end), jnp.concatenate([gap, reached])

            matrix, left = jax.jacfwd(after, has_aux=True)(jnp.zeros(2))
            wanted = _invariants(matrix, method.half)
            size = jnp.ones(())
            if not method.half:
                acting = with_overtones(own, drive)
                path = trajectory(own, method.integrator, acting, tuple(state))
                size = half_range(own, acting, path, 1.0) / a
            wanted = jnp.concatenate([a * real[:2], wanted, size[None]])
            return (left, wanted), wanted

        start = jnp.concatenate([found / scale, jnp.zeros(parameters)])
        (left, wanted), values = jax.jacfwd(orbit, has_aux=True)(start)
        follow = -solve(left[:, :count], left[:, count:])
        return values, wanted[:, count:] + wanted[:, :count] @ follow

    return jax.vmap(node)(amplitude, frequency, unknown)


def _invariants(matrix: Float[Array, "2 2"], half: bool) -> Float[Array, " 2"]:
    """Give sum and product of the multipliers over a period, from the map's derivative or from its half's."""
    total, product = jnp.trace(matrix), determinant(matrix)
    if half:
        total, product = total * total - 2.0 * product, product * product
    return jnp.stack([total, product])
