"""First states of the records, which follow the coefficients of the model."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

_FURTHEST_DOWN = 1e-3
"""Share of the variance of a first state that a step leaves at least."""


class FirstStates(NamedTuple):
    """Normal equations of the coefficients, without the first states of each record, and what these do.

    Attributes:
        reduced: `A^T A` of the coefficients and, last, the innovations.
        settled: step of the first states where the coefficients stay.
        along: what it changes with each coefficient.
        spread: variances of the first states after it.
    """

    reduced: Float[np.ndarray, "row row record"]
    settled: Float[np.ndarray, "state record"]
    along: Float[np.ndarray, "state column record"]
    spread: Float[np.ndarray, "state record"]


def eliminate(
    products: Float[np.ndarray, "whole whole record"],
    starts: Float[np.ndarray, "state record"],
    centers: Float[np.ndarray, "state record"],
    prior: Float[np.ndarray, "state record"],
    damping: Float[np.ndarray, " record"],
    given: Float[np.ndarray, "state record"],
) -> FirstStates:
    """Solve for the first states of each record.

    Args:
        products: `A^T A` of coefficients, first states and innovations, over standard deviations.
        starts: means of the first states.
        centers: their means before the record was seen.
        prior: their variances before.
        damping: Marquardt's, of each record.
        given: variances with which a filter of these products began; 0 of what it does not estimate.

    Returns:
        The equations that are left. Where the products are not finite the first states stay.
    """
    size, count = starts.shape
    columns = products.shape[0] - size - 1
    rows = np.r_[:columns, products.shape[0] - 1]
    settled, along = np.zeros((size, count)), np.zeros((size, columns, count))
    reduced, spread = products[np.ix_(rows, rows)].copy(), prior.copy()
    scale = np.sqrt(np.maximum(prior, 1e-300))
    for record in np.flatnonzero(np.isfinite(products).all(axis=(0, 1))):
        own, whole = scale[:, record], products[:, :, record]
        inner = whole[columns:-1, columns:-1] * np.outer(own, own)
        outer = whole[columns:-1][:, rows] * own[:, None]
        outer[:, -1] += (starts - centers)[:, record] / own
        unit = np.sqrt(1.0 + np.diag(inner))  # of an unstable motion it is huge
        known = (inner + np.eye(size)) / np.outer(unit, unit)
        damped = _inverse(known + damping[record] * np.diag(np.diag(inner) / unit**2))
        back = (own / unit)[:, None] * (damped @ (outer / unit[:, None]))
        reduced[:, :, record] -= (outer / own[:, None]).T @ back
        settled[:, record], along[:, :, record] = -back[:, -1], -back[:, :-1]
        told = _without(inner, given[:, record] / own**2) + np.eye(size)
        unit = np.sqrt(np.diag(told))
        spread[:, record] = (own / unit) ** 2 * np.diag(_inverse(told / np.outer(unit, unit)))
    return FirstStates(reduced, settled, along, spread)


def _without(
    information: Float[np.ndarray, "state state"], given: Float[np.ndarray, " state"]
) -> Float[np.ndarray, "state state"]:
    """Give what a record tells of its first state where a filter began with a variance of its own.

    The innovations hold that variance: the inverse of their information is the sum of both.
    """
    root = np.sqrt(given)
    shares, vectors = np.linalg.eigh(information * np.outer(root, root))
    # Where all but nothing is left a step takes a variance down by as much as it may.
    lost = np.clip(shares, 0.0, 1.0 - _FURTHEST_DOWN)
    across = (information * root) @ vectors
    return information + (across / (1.0 - lost)) @ across.T


def _inverse(matrix: Float[np.ndarray, "state state"]) -> Float[np.ndarray, "state state"]:
    """Invert a symmetric matrix of ones on its diagonal, whose rounding may have made it indefinite."""
    values, vectors = np.linalg.eigh(matrix)
    return (vectors / np.maximum(values, np.finfo(float).eps * values.size)) @ vectors.T


def covariance_of(information: Float[np.ndarray, "column column"]) -> Float[np.ndarray, "column column"]:
    """Give the covariance of coefficients from their information; zero where nothing is determined.

    Args:
        information: of the coefficients [inverse product of their units].

    Returns:
        Their covariance [product of their units].
    """
    # Stiffness in N/m and in N/m^3 would spoil each other.
    size = 1.0 / np.sqrt(np.maximum(np.diag(information), 1e-300))
    scales = np.outer(size, size)
    return np.linalg.pinv(information * scales, rcond=1e-12, hermitian=True) * scales
