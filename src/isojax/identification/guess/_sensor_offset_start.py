"""Start of the sensor's zero error."""

import jax
import jax.numpy as jnp
import numpy as np

from ...models import Isolator
from ...records import Campaign
from ._force_balance import with_strength


def output_mean(campaign: Campaign) -> float:
    """Give the mean reading over the records to fit [SI unit of the output]."""
    return float(np.mean(np.concatenate([record.output for record in campaign.fit_records])))


def with_sensor_zero(campaign: Campaign, model: Isolator) -> Isolator:
    """Give the model with a start for the sensor's offset, where that is declared free.

    An acceleration or a velocity has zero mean, so that the mean reading is the offset. A displacement may
    have a mean: the static deflection under the mean force is subtracted, unless the offset of the force is
    free as well and accounts for it. Without a spring the rest position is arbitrary, and the offset starts
    at zero.

    Args:
        campaign: the campaign.
        model: the model with its coefficients found.

    Returns:
        The model; as it was where the sensor's offset is not free.
    """
    if not campaign.output.offset_free:
        return model
    offset = output_mean(campaign)
    if campaign.output.quantity == "displacement":
        still = jnp.asarray(0.0)
        _, slope = jax.jvp(
            lambda x: model.restoring_force((x, still, *(still,) * model.internal_states)),
            (still,),
            (jnp.asarray(1.0),),
        )
        spring = float(slope)
        if not spring > 0:
            return model
        if not campaign.input.offset_free:
            sign = -float(model.mass) if model.excitation == "base_acceleration" else 1.0
            force = sign * np.mean(np.concatenate([record.input for record in campaign.fit_records]))
            offset -= float(force) / spring
    return Isolator(
        model.mass,
        tuple(
            with_strength(element, offset) if element.starts_at_mean else element
            for element in model.elements
        ),
        model.excitation,
    )
