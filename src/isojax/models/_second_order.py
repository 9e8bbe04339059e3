"""Draws of a curve without a search for each: from its second-order expansion by independent steps."""

import numpy as np
from jaxtyping import Float

_EXPANDED_AT = 2.0
"""Standard deviations at which a curve is worked out for its expansion: where an interval of 95 % ends."""


def expansion_nodes(count: int) -> Float[np.ndarray, "node step"]:
    """Give the steps at which a quantity is to be known for its expansion.

    Args:
        count: independent steps.

    Returns:
        Plus and minus two along each, and along the diagonal of each two.
    """
    unit = np.eye(count)
    first, second = np.triu_indices(count, 1)
    ways = np.concatenate([unit, (unit[first] + unit[second]) / np.sqrt(2.0)])
    return _EXPANDED_AT * np.concatenate([ways, -ways])


def expanded(
    shifts: Float[np.ndarray, "node ..."], draws: Float[np.ndarray, "draw step"]
) -> Float[np.ndarray, "draw ..."]:
    """Give a quantity at drawn steps from its expansion.

    Args:
        shifts: of the quantity at the nodes from its value at no step.
        draws: independent steps in standard deviations.

    Returns:
        Its shifts; NaN where one at a node is.
    """
    count = draws.shape[1]
    ahead, behind = np.split(shifts, 2)
    even, odd = 0.5 * (ahead + behind), 0.5 * (ahead - behind)
    slopes, bends = odd[:count] / _EXPANDED_AT, 2.0 * even[:count] / _EXPANDED_AT**2
    first, second = np.triu_indices(count, 1)
    mixed = 2.0 * even[count:] / _EXPANDED_AT**2 - 0.5 * (bends[first] + bends[second])
    squares = np.tensordot(0.5 * draws**2, bends, axes=1)
    products = np.tensordot(draws[:, first] * draws[:, second], mixed, axes=1)
    return np.tensordot(draws, slopes, axes=1) + squares + products
