"""Numbers of a model and its drive by name."""

from collections.abc import Sequence

from jaxtyping import Array, Float

from ..._parameters import list_parameters, replace_parameters
from ...models import Isolator

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
        model,
        [numbers[places[entry.name]] if entry.name in places else entry.value for entry in entries],
    )
