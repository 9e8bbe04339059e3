"""Internal states that follow a measured motion."""

import diffrax
import jax.numpy as jnp
from jaxtyping import Array

from ..._kernel_scan import kernel_scan
from ..._quick_jit import quick_jit
from ...models import RK4, Isolator, State, share_internal
from ..jacobian import follow_motion

_STEPS_A_SAMPLE = 2
"""Integration steps per sample."""


@quick_jit
def internal_states_along(model: Isolator, x: Array, v: Array, y: Array, u: Array, step: Array) -> State:
    """Integrate the internal states of a model's elements along a given motion, from rest.

    Args:
        model: the isolator; its force balance takes no part.
        x: displacement [m].
        v: velocity [m/s].
        y: motion at the sensor [its SI unit].
        u: drive [N, or m/s^2 for base excitation].
        step: time from each sample to the next [s].

    Returns:
        One history per internal state.
    """
    solver, based = RK4(), model.excitation == "base_acceleration"

    def field(t: float, internal: State, ends: tuple[tuple[Array, ...], tuple[Array, ...]]) -> State:
        far, fast, seen, drive, _ = (one + t * (other - one) for one, other in zip(*ends, strict=True))
        rates: list[Array] = []
        for element, own in zip(
            model.elements, share_internal(model.elements, (far, fast, *internal)), strict=True
        ):
            rates.extend(follow_motion(element, far, fast, seen, drive if based else None, own))
        return tuple(ends[0][-1] * rate for rate in rates)

    term = diffrax.ODETerm(field)  # pyright: ignore[reportArgumentType]

    def body(internal: State, ends: tuple[tuple[Array, ...], tuple[Array, ...]]) -> tuple[State, State]:
        moved = internal
        for part in range(_STEPS_A_SAMPLE):
            moved, *_ = solver.step(
                term, part / _STEPS_A_SAMPLE, (part + 1) / _STEPS_A_SAMPLE, moved, ends, None, False
            )
        return moved, internal

    signals = (x, v, y, u, step)
    ahead = tuple(jnp.concatenate([values[1:], values[-1:]]) for values in signals)
    rest = (jnp.zeros(()),) * model.internal_states
    return kernel_scan(body, rest, (signals, ahead))[1]
