"""Sizes of motions, measured along each of them where the surface does not tell them well enough."""

import jax
import numpy as np
from jax.sharding import NamedSharding
from jaxtyping import Array, Float

from ..._quick_jit import quick_jit
from ..._types import Lanes
from ...models import Isolator
from ..orbit import Sine, half_range, trajectory, with_overtones
from ._map_method import MapMethod

_MEASURED_TOGETHER = 1024
"""Lanes of the compiled measurement."""


def motion_sizes(
    model: Isolator,
    method: MapMethod,
    states: Float[np.ndarray, "orbit state"],
    drive: Float[np.ndarray, "orbit 2"],
    frequency: Float[np.ndarray, " orbit"],
    sharding: NamedSharding | None = None,
) -> Float[np.ndarray, " orbit"]:
    """Give half the peak-to-peak displacement of orbits.

    Args:
        model: the isolator.
        method: how to integrate.
        states: a state of each.
        drive: sine and cosine from there on [N, or m/s^2 for base excitation].
        frequency: [Hz].
        sharding: how lanes are spread over devices.

    Returns:
        The sizes [m].
    """
    sizes = np.empty(frequency.shape)
    for begin in range(0, sizes.size, _MEASURED_TOGETHER):
        own = slice(begin, begin + _MEASURED_TOGETHER)
        count = sizes[own].size
        rows = [values[own] for values in (states, drive, frequency)]
        rows = [
            np.concatenate([row, np.repeat(row[-1:], _MEASURED_TOGETHER - count, axis=0)]) for row in rows
        ]
        sizes[own] = np.asarray(_sizes(model, method, *jax.device_put(rows, sharding)))[:count]
    return sizes


@quick_jit
def _sizes(model: Isolator, method: MapMethod, states: Array, push: Array, frequency: Array) -> Lanes:
    turns = 0.5 if method.half else 1.0

    def one(state: Array, push: Array, frequency: Array) -> Array:
        drive = with_overtones(model, Sine(push[0], push[1], frequency))
        path = trajectory(model, method.integrator, drive, tuple(state), turns=turns)
        return half_range(model, drive, path, turns)

    return jax.vmap(one)(states, push, frequency)
