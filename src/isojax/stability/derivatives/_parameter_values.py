"""Numbers of a model and its drive by name."""

from collections.abc import Callable, Mapping, Sequence

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..._parameters import list_parameters, replace_parameters
from ..._types import Lanes
from ...models import Isolator
from ..orbit import value_and_jacobian

DRIVE = ("drive.amplitude", "drive.frequency")
"""Names of the drive's numbers beside those of the model."""


def with_values(model: Isolator, names: Sequence[str], numbers: Float[Array, " parameter"]) -> Isolator:
    """Give a model with some parameters replaced.

    Args:
        model: the isolator.
        names: of parameters; those that are not the model's own are passed over.
        numbers: their values.

    Returns:
        The model.
    """
    entries = list_parameters(model)
    places = {name: place for place, name in enumerate(names)}
    return replace_parameters(
        model, [numbers[places[entry.name]] if entry.name in places else entry.value for entry in entries]
    )


def drive_values(
    names: Sequence[str], numbers: Float[Array, " parameter"], drive: Sequence[Lanes]
) -> tuple[Lanes, Lanes]:
    """Give amplitude and frequency of the drive, in place of which parameters may stand.

    Args:
        names: of parameters; those of the model are passed over.
        numbers: their values.
        drive: amplitude and frequency where they are no parameters.

    Returns:
        Amplitude and frequency.
    """
    amplitude, frequency = (
        numbers[names.index(name)] if name in names else own for name, own in zip(DRIVE, drive, strict=True)
    )
    return amplitude, frequency


def differentiate(
    quantities: Callable[[Float[Array, " parameter"]], Mapping[str, Array]], at: Float[Array, " parameter"]
) -> tuple[dict[str, Array], dict[str, Array]]:
    """Give quantities and their derivatives.

    Args:
        quantities: of the parameters, by name.
        at: values of the parameters.

    Returns:
        The quantities; their derivatives, parameter first.
    """
    values, slopes = value_and_jacobian(lambda numbers: dict(quantities(numbers)), at)
    return values, {name: jnp.moveaxis(slope, -1, 0) for name, slope in slopes.items()}
