"""Checking the values over which something is worked out."""

from typing import Any

import numpy as np
from jaxtyping import Float


def ascending(name: str, values: Any, *, positive: bool = True) -> Float[np.ndarray, " axis"]:
    """Give a list of ascending numbers.

    Args:
        name: of the argument.
        values: the numbers.
        positive: whether each must be above zero.

    Returns:
        The numbers.

    Raises:
        ValueError: if the list is empty, does not ascend, or a number is not finite or not positive.
    """
    if isinstance(values, tuple) and len(values) == 2:
        # A tuple of two is how a range is written elsewhere; taken as a grid of two it would answer another
        # question without a word.
        first, last = values
        raise ValueError(
            f"Argument `{name}` must list the values, but is the pair {values}. For a range write "
            f"np.linspace({first}, {last}, 100), for these two values [{first}, {last}]."
        )
    try:
        given = np.asarray(values)
        if given.dtype.kind in "bUSc":
            raise TypeError(f"{given.dtype} is no number")
        axis = np.asarray(given, dtype=float)
    except (TypeError, ValueError) as problem:
        raise ValueError(f"Argument `{name}` must be a list of real numbers, but is {values!r}.") from problem
    if axis.ndim != 1 or not axis.size:
        raise ValueError(f"Argument `{name}` must be a list of numbers, but has shape {axis.shape}.")
    bad = np.flatnonzero(~(np.isfinite(axis) & ((axis > 0.0) | (not positive))))
    if bad.size:
        wanted = "positive" if positive else "finite"
        raise ValueError(f"Argument `{name}` must be {wanted}, but {name}[{bad[0]}] = {axis[bad[0]]}.")
    bad = np.flatnonzero(np.diff(axis) <= 0.0)
    if bad.size:
        place = bad[0] + 1
        raise ValueError(
            f"Argument `{name}` must ascend, but {name}[{place}] = {axis[place]} follows {axis[place - 1]}."
        )
    return axis
