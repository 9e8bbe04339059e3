"""Orbits that start at their largest displacement, at t = 0 of the recorded drive."""

import math

import jax
import jax.numpy as jnp

from ..._quick_jit import quick_jit
from ...models import Isolator, State
from ..orbit import with_overtones
from ._map_method import Lane, MapMethod, advance


@quick_jit
def states_at_zero(model: Isolator, method: MapMethod, lanes: Lane) -> State:
    """Give the states of orbits at t = 0 of the recorded drive.

    Args:
        model: the isolator.
        method: how to integrate.
        lanes: the orbits, a lane each.

    Returns:
        Displacement, velocity, internal states.
    """

    def one(lane: Lane) -> State:
        drive = lane.drive
        lead = jnp.arctan2(drive.cosine, drive.sine) + drive.angular_frequency * model.shift()
        whole = 2.0 * math.pi
        target = jnp.mod(-lead, whole)
        turned = method.half & (target >= math.pi)
        target = jnp.where(turned, target - math.pi, target)
        acting = with_overtones(model, drive)
        state = advance(model, method.integrator, acting, lane.state, target, 4 * method.steps)
        return tuple(jnp.where(turned, -value, value) for value in state)

    return jax.vmap(one)(lanes)
