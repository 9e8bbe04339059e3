"""Whether a model is physical over the motion that was measured."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

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


def _static_force(model: Isolator, x: Float[jax.Array, ""], v: Float[jax.Array, ""]) -> Float[jax.Array, ""]:
    """Give the force of all elements with their internal states at rest [N]."""
    return model.restoring_force((x, v, *(jnp.zeros(()),) * model.internal_states))


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
    passive, still = (
        Isolator(model.mass, tuple(one for one in model.elements if not one.active)),
        jnp.zeros(()),
    )
    vs = jnp.linspace(-largest_v, largest_v, 101)
    # Over the ellipse that a sine of that size runs along, and its inside: all states that were visited.
    turns, sizes = jnp.linspace(0.0, 2.0 * jnp.pi, 80, endpoint=False), jnp.linspace(0.0, 1.0, 26)[1:]
    angle, size = (each.ravel() for each in jnp.meshgrid(turns, sizes))
    places = jnp.concatenate([jnp.zeros(101), largest_x * size * jnp.cos(angle)])
    speeds = jnp.concatenate([vs, largest_v * size * jnp.sin(angle)])
    power = jax.vmap(lambda x, v: (_static_force(passive, x, v) - _static_force(passive, x, still)) * v)(
        places, speeds
    )
    if float(power.min()) < -1e-9 * float(jnp.abs(power).max()):
        where = 1e3 * float(speeds[int(jnp.argmin(power))])
        return f"its damping feeds energy in at {where:.3g} mm/s, within the visited motion"
    activities = (find_activity(element, largest_x, largest_v) for element in model.elements)
    return next((sentence for sentence in activities if sentence is not None), None)
