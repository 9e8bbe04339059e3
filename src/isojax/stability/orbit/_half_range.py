"""How large a motion is: half its peak-to-peak displacement."""

import math

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from ..._implicit import frozen
from ..._quick_jit import quick_jit
from ..._types import Lanes
from ...models import Isolator, State
from ._event_path import turning_point
from ._sine import PeriodicDrive


@quick_jit
def half_range(model: Isolator, drive: PeriodicDrive, path: State, turns: float) -> Float[Array, ""]:
    """Give half the peak-to-peak displacement, each extreme where the velocity vanishes [m].

    From the sample before it the motion is stepped to that instant, so that value and derivatives have the
    order of the steps. No displacement between two samples is needed, and none of the law's other side.

    Args:
        model: the isolator.
        drive: the drive that acts.
        path: states at equidistant instants of the motion, time first.
        turns: drive periods that the path lasts; 0.5 of a motion whose other half is minus the first.

    Returns:
        The amplitude.
    """
    count = path[0].shape[0] - 1
    length = 2.0 * math.pi * turns / count

    def extreme(row: Int[Array, ""], side: Array) -> Array:
        """Give the displacement at the extreme in the step after a sample."""
        begin, end = (tuple(along[place] for along in path) for place in (row, row + 1))
        reached, turned = turning_point(model, drive, begin, row * length, length, side)
        # A mass that friction holds, or one that turns at a sample within rounding, is sampled there.
        sampled = side * jnp.maximum(side * begin[0], side * end[0])
        return jnp.where(turned, reached, sampled)

    sides = jnp.array([1.0, -1.0])
    heights = jax.vmap(lambda side: _heights(frozen(path), length / frozen(drive).angular_frequency, side))(
        sides
    )
    if turns == 0.5:
        # The other extreme lies in the other half.
        place = jnp.argmax(heights)
        return jnp.abs(extreme(place % count, sides[place // count]))
    high, low = jax.vmap(extreme)(jnp.argmax(heights, axis=1), sides)
    return 0.5 * (high - low)


def _heights(path: State, step_time: Lanes, side: Array) -> Float[Array, " step"]:
    """Give how far a motion comes to one side within each step, as if its velocity changed evenly."""
    (before, after), (start, end) = ((side * along[:-1], side * along[1:]) for along in path[:2])
    turns = (start >= 0.0) & (end <= 0.0) & (start > end)
    over = 0.5 * step_time * start**2 / jnp.where(turns, start - end, 1.0)
    return jnp.where(turns, before + over, jnp.maximum(before, after))
