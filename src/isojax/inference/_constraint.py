"""What a design must keep to: a quantity of the model on one side of a limit."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from .._given_numbers import given_chance, given_numbers
from .._show import number, shown
from ..models import Isolator


@shown
class Constraint(NamedTuple):
    """A quantity of the model that must stay on one side of a limit.

    Attributes:
        quantity: function of an isolator that gives one real number or an array of them.
        limit: that each number must keep to: one, or one for each.
        upper: whether the limit is an upper one.
        name: in words.
        chance: with which each number is to keep to its limit; None where the coefficients count as exact.
    """

    quantity: Callable[[Isolator], Any]
    limit: Float[np.ndarray, "..."]
    upper: bool
    name: str
    chance: float | None = None

    @property
    def words(self) -> str:
        """The constraint in words."""
        lowest, highest = np.min(self.limit), np.max(self.limit)
        limit = number(lowest) if lowest == highest else f"{number(lowest)} to {number(highest)}"
        sure = "" if self.chance is None else f" with a chance of {self.chance:g}"
        return f"{self.name} {'≤' if self.upper else '≥'} {limit}{sure}"

    def _headline(self) -> str:
        return self.words


def at_most(
    quantity: Callable[[Isolator], Any], limit: Any, *, name: str | None = None, chance: float | None = None
) -> Constraint:
    """Ask a quantity to stay at or below a limit: a transmissibility under a curve, for one.

    Args:
        quantity: function of an isolator that gives one real number or an array, differentiable by
            `jax.jacfwd`. Give the numbers of a curve themselves, not their maximum, which is not smooth.
        limit: one number, or one for each number of the quantity.
        name: in words; that of the function if omitted.
        chance: with which each number is to stay there, given the errors of the fit that `design` is given.

    Returns:
        The constraint.

    Raises:
        ValueError: if the quantity is no function, a limit is not finite, or the chance does not lie between
            0.5 and 1.

    Example:
        >>> stiff = ij.inference.at_most(lambda model: model["linear_stiffness.coefficient"], 1e6, name="k1")
        >>> print(stiff.words)
        k1 ≤ 1e+06
    """
    return _constraint(quantity, limit, True, name, chance)


def at_least(
    quantity: Callable[[Isolator], Any], limit: Any, *, name: str | None = None, chance: float | None = None
) -> Constraint:
    """Ask a quantity to stay at or above a limit: the force at a fold, for one.

    Of the force at the fold, a limit of 150 N and `chance=0.99` say: with a probability of 0.99 the response
    has not jumped at 150 N.

    Args:
        quantity: as in `at_most`.
        limit: as in `at_most`.
        name: as in `at_most`.
        chance: as in `at_most`.

    Returns:
        The constraint.

    Raises:
        ValueError: as in `at_most`.

    Example:
        >>> damped = ij.inference.at_least(lambda model: model["linear_damping.coefficient"], 4e3)
        >>> damped.upper
        False
    """
    return _constraint(quantity, limit, False, name, chance)


def _constraint(
    quantity: Callable[[Isolator], Any], limit: Any, upper: bool, name: str | None, chance: float | None
) -> Constraint:
    limits = given_numbers("limit", limit, "hold finite numbers", np.isfinite)
    if chance is not None:
        chance = given_chance("chance", chance, least=0.5)
    if not callable(quantity):
        raise ValueError(
            "Argument `quantity` must be a function of an isolator, such as lambda model: model['k1'], "
            f"but is {quantity!r}."
        )
    own = getattr(quantity, "__name__", "")
    label = name if name is not None else own if own.isidentifier() else "quantity"
    return Constraint(quantity, limits, upper, label.replace("_", " "), chance)
