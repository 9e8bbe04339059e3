"""With how many digits numbers were written, seen from the numbers alone."""

import numpy as np
from jaxtyping import Float

_MOST_DIGITS = 9
"""Decimals, or significant digits, of a written number at most; with more it counts as exact."""

_NEARLY_WHOLE = 1e-3
"""Distance from a whole number, in units of the last digit, within which a number ends there."""

_FIRST_LOOK = 256
"""Numbers that are looked at first: mostly they suffice to see that there are more digits."""


def last_digit(numbers: Float[np.ndarray, " time"]) -> Float[np.ndarray, " time"]:
    """Gives the unit of the last digit of each number: by decimals, significant digits or single precision.

    Of several explanations the coarsest counts. It is 0 where the numbers have all digits of a double.
    """
    decades = np.floor(np.log10(np.maximum(np.abs(numbers), np.finfo(float).tiny)))
    single = numbers.astype(np.float32)
    units = [np.spacing(np.abs(single)).astype(float)] if np.array_equal(single, numbers) else []
    for power in (np.zeros_like(decades), decades + 1.0):
        known = (10.0 ** (power - digits) for digits in range(_MOST_DIGITS + 1))
        units += next(([unit] for unit in known if _ends(numbers, unit)), [])
    return max(units, key=lambda unit: float(np.mean(unit**2)), default=np.zeros_like(numbers))


def _ends(numbers: Float[np.ndarray, " time"], unit: Float[np.ndarray, " time"]) -> bool:
    """Whether every number is a whole multiple of its unit."""
    for part in (slice(_FIRST_LOOK), slice(None)):
        multiple = numbers[part] / unit[part]
        whole = np.round(multiple)
        if np.any(np.abs(multiple - whole) > _NEARLY_WHOLE) or np.any((whole == 0.0) & (multiple != 0.0)):
            return False
    return True
