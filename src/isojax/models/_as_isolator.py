"""What is meant where an isolator is asked for: many a result holds the one that it is about."""

from typing import Protocol, runtime_checkable

import numpy as np
from jax.core import Tracer

from .._parameters import element_names, list_parameters, refuse_shapes_outside
from ._isolator import Isolator


@runtime_checkable
class Modelled(Protocol):
    """Whatever holds an isolator as `.model`: a classical guess, a fit, an extension, a closed loop."""

    @property
    def model(self) -> Isolator:
        """The isolator."""
        ...


def as_isolator(value: object, argument: str = "model", recorded: bool = False) -> Isolator:
    """Give the isolator that is meant.

    Args:
        value: an isolator, or what holds one as `.model`.
        argument: name of the argument, for the message.
        recorded: whether records say at what pressure or temperature it is.

    Returns:
        The isolator.

    Raises:
        ValueError: if there is none, a coefficient follows a condition that nothing states, or a number is
            not finite or not admissible.
    """
    meant = value if isinstance(value, Isolator) else getattr(value, "model", None)
    if not isinstance(meant, Isolator):
        raise ValueError(
            f"Argument `{argument}` must be an isolator, such as guess.model or fit.model, but is of type "
            f"{type(value).__name__}."
        )
    if meant.conditions and not recorded:
        given = ", ".join(f"{name}=..." for name in meant.conditions)
        raise ValueError(
            f"Argument `{argument}` must be an isolator at one {' and '.join(meant.conditions)}, which a "
            f"coefficient follows, such as {argument}.at({given})."
        )
    for entry in list_parameters(meant):
        if not isinstance(entry.value, Tracer) and not np.all(np.isfinite(np.asarray(entry.value))):
            raise ValueError(
                f"Argument `{argument}` must hold finite numbers, but {entry.name} is {entry.value}."
            )
    refuse_shapes_outside(element_names(meant), meant.elements)
    return meant
