"""Whether a model is physical over the motion that was measured."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..._quick_jit import quick_jit
from ..._types import on_device
from ...models import Isolator, Quantity
from ...records import Record
from ..jacobian import coordinate_motion
from ._passivity import find_activity


def visited_range(model: Isolator, records: tuple[Record, ...], quantity: Quantity) -> tuple[float, float]:
    """Give the largest displacement [m] and velocity [m/s] that dwells and windows reached.

    Args:
        model: the isolator, for what its coordinate is.
        records: the records.
        quantity: what the sensor measures.

    Returns:
        Both.
    """
    based = model.excitation == "base_acceleration"
    states = [coordinate_motion(record, quantity, based) for record in records]
    return (
        float(max(np.max(np.abs(x)) for x, _ in states)),
        float(max(np.max(np.abs(v)) for _, v in states)),
    )


@quick_jit
def _damping_power(
    passive: Isolator, x: Float[Array, " state"], v: Float[Array, " state"]
) -> Float[Array, " state"]:
    """Give the power that the dampers of all elements take, their internal states at rest [W]."""

    def force(x: Array, v: Array) -> Array:
        return passive.restoring_force((x, v, *(jnp.zeros(()),) * passive.internal_states))

    return jax.vmap(lambda x, v: (force(x, v) - force(x, jnp.zeros(()))) * v)(x, v)


def find_violation(model: Isolator, records: tuple[Record, ...], quantity: Quantity) -> str | None:
    """Find what is unphysical in a model over the visited motion, if anything.

    The static damping force, but for laws that are declared active, must not drive the motion at any state
    that was visited. A force with internal states must take energy over the loops that it was driven around.
    A spring gives back what it took, whatever its law: a stiffness may be lost or negative, as that of a
    buckled beam or a snap-through spring is.

    Args:
        model: the isolator.
        records: the records.
        quantity: what the sensor measures.

    Returns:
        A sentence, or None.
    """
    largest_x, largest_v = visited_range(model, records, quantity)
    passive = Isolator(model.mass, tuple(one for one in model.elements if not one.active))
    # Over the ellipse that a sine of that size runs along, and its inside: all states that were visited.
    turns, sizes = np.linspace(0.0, 2.0 * np.pi, 80, endpoint=False), np.linspace(0.0, 1.0, 26)[1:]
    angle, size = (each.ravel() for each in np.meshgrid(turns, sizes))
    places = np.concatenate([np.zeros(101), largest_x * size * np.cos(angle)])
    speeds = np.concatenate([np.linspace(-largest_v, largest_v, 101), largest_v * size * np.sin(angle)])
    power = np.asarray(_damping_power(passive, on_device(places), on_device(speeds)))
    if power.min() < -1e-9 * np.abs(power).max():
        where = 1e3 * speeds[np.argmin(power)]
        return f"its damping feeds energy in at {where:.3g} mm/s, within the visited motion"
    activities = (find_activity(element, largest_x, largest_v) for element in model.elements)
    return next((sentence for sentence in activities if sentence is not None), None)
