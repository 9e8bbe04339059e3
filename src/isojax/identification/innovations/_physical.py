"""Numbers of a model from unbounded variables, by NumPy."""

import numpy as np
from jaxtyping import Float

from ..._parameters import ParameterSpec


def physical(
    free: Float[np.ndarray, " column"], specs: tuple[ParameterSpec, ...], scales: tuple[float, ...]
) -> tuple[Float[np.ndarray, " column"], Float[np.ndarray, " column"]]:
    """Give the physical numbers of unbounded variables, and their slopes: `to_physical`, by NumPy.

    Args:
        free: the unbounded variables.
        specs: declarations with the bounds.
        scales: magnitudes of the numbers.

    Returns:
        Both.
    """
    numbers, slopes = np.empty(len(specs)), np.empty(len(specs))
    for place, (value, spec, scale) in enumerate(zip(free, specs, scales, strict=True)):
        low, high = np.isfinite(spec.lower), np.isfinite(spec.upper)
        rising = np.exp(-np.logaddexp(0.0, -value))
        if low and high:
            numbers[place] = spec.lower + (spec.upper - spec.lower) * rising
            slopes[place] = (spec.upper - spec.lower) * rising * (1.0 - rising)
        elif low or high:
            sign = 1.0 if low else -1.0
            numbers[place] = (spec.lower if low else spec.upper) + sign * scale * np.logaddexp(0.0, value)
            slopes[place] = sign * scale * rising
        else:
            numbers[place], slopes[place] = scale * value, scale
    return numbers, slopes
