"""What is meant where a fit is asked for: the last fit of what holds several."""

from typing import Protocol, runtime_checkable

from ._fit_result import Fit
from ._saved_fit import SavedFit


@runtime_checkable
class Fitted(Protocol):
    """Whatever ends with a fit as `.after`: an extension, a closed loop, a diagnosis that found an effect."""

    @property
    def after(self) -> Fit | None:
        """The last fit."""
        ...


def as_fit(value: object, argument: str = "fit") -> Fit:
    """Give the fit that is meant.

    Args:
        value: a fit, or what ends with one as `.after`.
        argument: name of the argument, for the message.

    Returns:
        The fit.

    Raises:
        ValueError: if there is none.
    """
    meant = value if isinstance(value, Fit) else getattr(value, "after", None)
    if isinstance(value, SavedFit):
        raise ValueError(
            f"Argument `{argument}` must hold the records that were fitted, but a saved fit holds none. Fit "
            "them again: `fit(saved.model, campaign)`."
        )
    if not isinstance(meant, Fit):
        raise ValueError(
            f"Argument `{argument}` must be a fit, such as `fit(guess.model, campaign)`, or an extension or "
            f"a closed loop, whose last fit is taken, but is of type {type(value).__name__}."
        )
    return meant
