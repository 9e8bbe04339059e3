"""How large a motion is: half its peak-to-peak displacement."""

import math

import jax.numpy as jnp
from jaxtyping import Array, Float

from ...models import Isolator, State
from ._sine import PeriodicDrive


def half_range(model: Isolator, drive: PeriodicDrive, path: State, turns: float) -> Float[Array, ""]:
    """Give half the peak-to-peak displacement, each peak by a parabola through its sample [m].

    Args:
        model: the isolator.
        drive: the drive that acts.
        path: states at equidistant instants of the motion, time first.
        turns: drive periods that the path lasts; 0.5 of a motion whose other half is minus the first.

    Returns:
        The amplitude.
    """
    samples = path[0].shape[0]

    def peak(values: Float[Array, " time"]) -> Array:
        place = jnp.argmax(values)
        state = tuple(along[place] for along in path)
        phase = 2.0 * math.pi * turns * place / (samples - 1)
        bend = model.acceleration(state, drive.at(drive.waves(phase)))
        return state[0] - 0.5 * state[1] ** 2 / jnp.where(bend == 0.0, 1.0, bend)

    if turns == 0.5:
        # The other extreme lies in the other half.
        return jnp.abs(peak(jnp.abs(path[0])))
    return 0.5 * (peak(path[0]) - peak(-path[0]))
