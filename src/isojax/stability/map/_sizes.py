"""Sizes of motions, measured along each of them where the surface does not tell them well enough."""

import jax
import numpy as np
from jaxtyping import Array, Float

from ..._quick_jit import quick_jit
from ..._types import Lanes
from ...models import Isolator
from ..orbit import Sine, half_range, trajectory, with_overtones
from ._map_method import MapMethod
from ._nodes import in_blocks


def motion_sizes(
    model: Isolator,
    method: MapMethod,
    states: Float[np.ndarray, "orbit state"],
    drive: Float[np.ndarray, "orbit 2"],
    frequency: Float[np.ndarray, " orbit"],
) -> Float[np.ndarray, " orbit"]:
    """Give half the peak-to-peak displacement of orbits.

    Args:
        model: the isolator.
        method: how to integrate.
        states: a state of each.
        drive: sine and cosine from there on [N, or m/s^2 for base excitation].
        frequency: [Hz].

    Returns:
        The sizes [m].
    """
    return in_blocks(lambda *rows: _sizes(model, method, *rows), states, drive, frequency)


@quick_jit
def _sizes(model: Isolator, method: MapMethod, states: Array, push: Array, frequency: Array) -> Lanes:
    turns = 0.5 if method.half else 1.0

    def one(state: Array, push: Array, frequency: Array) -> Array:
        drive = with_overtones(model, Sine(push[0], push[1], frequency))
        path = trajectory(model, method.integrator, drive, tuple(state), turns=turns)
        return half_range(model, drive, path, turns)

    return jax.vmap(one)(states, push, frequency)
