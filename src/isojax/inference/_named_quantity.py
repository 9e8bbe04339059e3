"""A quantity that gives several numbers by name."""

from collections.abc import Callable
from typing import Any

import jax.numpy as jnp
import numpy as np

from .._given_numbers import as_numbers


class NamedQuantity:
    """A quantity whose dict of numbers, if it gives one, is an array; the names are kept beside.

    Attributes:
        names: of the numbers, once the quantity was evaluated; empty where it gives no dict.
    """

    def __init__(self, quantity: Callable[[Any], Any]):
        """Keep the quantity; nothing is evaluated yet."""
        self.quantity = quantity
        self.names: tuple[str, ...] = ()

    def __call__(self, given: Any) -> Any:
        """Give what the quantity gives; the numbers of a dict in their order, also beside how it ended.

        Raises:
            ValueError: if a dict is empty, or holds an array.
        """
        answer = self.quantity(given)
        if isinstance(answer, tuple) and len(answer) == 2:
            return self._numbers(answer[0]), answer[1]
        return self._numbers(answer)

    def _numbers(self, answer: Any) -> Any:
        if not isinstance(answer, dict):
            return answer
        odd = [name for name, one in answer.items() if np.ndim(one) != 0]
        if odd or not answer:
            raise ValueError(
                "Argument `quantity` must give a dict of single numbers, but gives "
                + (f"an array as {odd[0]!r}." if odd else "an empty one.")
            )
        self.names = tuple(map(str, answer))
        return jnp.stack([as_numbers("quantity", one) for one in answer.values()])
