"""Harmonic balance: what a force law amounts to at one amplitude, and back."""

import numpy as np
from jaxtyping import Float

HARMONIC_FACTORS = np.array([1.0, 8.0 / (3.0 * np.pi), 0.75])
"""First-harmonic weight of s, |s|s and s^3 for s = S sin(Phi), as shares of S, S^2 and S^3."""


def equivalent_coefficients(law: Float[np.ndarray, " power"]) -> Float[np.ndarray, " power"]:
    """Give the polynomial of the equivalent coefficient that belongs to a force law.

    `a1 s + a2 |s|s + a3 s^3` has the equivalent coefficient `a1 + (8/3pi) a2 S + (3/4) a3 S^2`.

    Args:
        law: a1, a2, a3 of the force law [N/m, N/m^2, N/m^3, or the same with m/s]; fewer for a shorter law.

    Returns:
        Coefficients of 1, S, S^2 in K_eq [N/m] or C_eq [N s/m].

    Source: the paper, eqs. (7) and (8).
    """
    return law * HARMONIC_FACTORS[: law.size]


def invert_equivalent(polynomial: Float[np.ndarray, " power"]) -> Float[np.ndarray, " power"]:
    """Give the force law whose equivalent coefficient is a polynomial of the amplitude.

    `a0 + a1 S + a2 S^2` inverts to `a0 s + (3pi/8) a1 |s|s + (4/3) a2 s^3`.

    Args:
        polynomial: coefficients of 1, S, S^2 in K_eq [N/m] or C_eq [N s/m]; fewer for a lower order.

    Returns:
        Coefficients of s, |s|s, s^3 [SI].

    Source: the paper, eqs. (12)-(13) and (17)-(18).
    """
    return polynomial / HARMONIC_FACTORS[: polynomial.size]


def normalised_law(law: Float[np.ndarray, " power"], amplitude: float) -> Float[np.ndarray, " power"]:
    """Give a force law over its linear part at one amplitude.

    `a1 s + a2 |s|s + a3 s^3` becomes `r + (a2 S/a1) |r|r + (a3 S^2/a1) r^3` with r = s/S.

    Args:
        law: a1, a2, a3 [SI].
        amplitude: S, the amplitude that counts as one [m or m/s].

    Returns:
        Dimensionless coefficients; the first is one.

    Raises:
        ValueError: if the linear coefficient is zero or `amplitude` is not positive.

    Source: the paper, eqs. (14), (19), (24), (29); its eq. (24) divides by 1.414e6 where 1.414e5 is meant.
    """
    if not amplitude > 0:
        raise ValueError(f"Argument `amplitude` must be positive, but is {amplitude}.")
    if law.size == 0 or law[0] == 0:
        raise ValueError(f"Argument `law` must have a linear coefficient other than zero, but is {law}.")
    return law * amplitude ** np.arange(law.size) / law[0]
