"""Rows of residuals and derivatives, filtered so that the noise in them is white."""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..._types import on_device

SHORTEST_BLOCK = 16
"""Samples of which one product filters a multiple. Laws are filled up with zeros to as many coefficients, so
that a few compiled functions serve all orders."""


class Whitening(NamedTuple):
    """The inverse square root of the covariance of an autoregressive noise, row by row.

    Attributes:
        start: of the first samples of a segment, each by those before it: prediction-error filters of order
            0, 1 and so on, scaled so that all errors have the variance of the innovation.
        law: 1, a_1, ..., a_p: of every later sample by the p before it.
    """

    start: Float[Array, "order order"]
    law: Float[Array, " tap"]


def find_whitening(coefficients: tuple[float, ...]) -> Whitening | None:
    """Give the filters that whiten an autoregressive noise, from the first sample of a segment on.

    Args:
        coefficients: a_1 to a_p of `e_t = n_t + a_1 n_(t-1) + ... + a_p n_(t-p)`.

    Returns:
        The filters; None of white noise.

    Source: Durbin 1960 (step-down recursion); Brockwell & Davis 1991, Time Series, sec. 8.6 (innovations).
    """
    if not coefficients:
        return None
    order = SHORTEST_BLOCK * -(-len(coefficients) // SHORTEST_BLOCK)
    padded = np.pad(coefficients, (0, order - len(coefficients)))
    start, law, scale = np.zeros((order, order)), padded, 1.0
    for row in range(order - 1, -1, -1):
        reflection = law[-1]
        law = (law[:-1] - reflection * law[-2::-1]) / (1.0 - reflection**2)
        scale *= np.sqrt(1.0 - reflection**2)
        start[row, : row + 1] = scale * np.append(law[::-1], 1.0)
    return Whitening(on_device(start), on_device(np.array([1.0, *padded])))


def whiten(
    rows: Float[Array, "time column lanes"], weight: Float[Array, "time lanes"], whitening: Whitening
) -> Float[Array, "time column lanes"]:
    """Filter the rows of each lane; the first sample that counts has no past.

    Args:
        rows: residuals or derivatives, 0 where a sample does not count.
        weight: 1 for the samples that count, which follow each other, and 0 for the others.
        whitening: the filters.

    Returns:
        The rows, their noise white and of the variance of the innovation.
    """
    time, columns, lanes = rows.shape
    # Blocks of samples: the filter is one small matrix, applied to each block and to the one before it.
    order = size = whitening.start.shape[0]
    blocks = -(-time // size)
    cut = jnp.pad(rows, ((0, blocks * size - time), (0, 0), (0, 0))).reshape(blocks, size, columns * lanes)
    lag = np.arange(size)[:, None] + size - np.arange(2 * size)
    taps = jnp.where((lag >= 0) & (lag <= order), whitening.law[np.clip(lag, 0, order)], 0.0)
    past = jnp.concatenate([jnp.zeros_like(cut[:1]), cut[:-1]])
    filtered = jnp.einsum("ij,bjr->bir", taps, jnp.concatenate([past, cut], axis=1))
    filtered = filtered.reshape(-1, columns, lanes)[:time]
    first = jnp.argmax(weight > 0.0, axis=0)[None] + jnp.arange(min(order, time))[:, None]
    lane = jnp.arange(lanes)[None]
    begun = rows.at[first, :, lane].get(mode="fill", fill_value=0.0)
    begun = jnp.einsum("ij,jlc->ilc", whitening.start[: first.shape[0], : first.shape[0]], begun)
    filtered = filtered.at[first, :, lane].set(begun, mode="drop")
    return filtered * weight[:, None]


def whitened_products(
    rows: Float[Array, "time column lanes"], weight: Float[Array, "time lanes"], whitening: Whitening
) -> Float[Array, "column column lanes"]:
    """Give A^T W A of each lane, W the inverse covariance of the noise, over that of the innovation."""
    white = whiten(rows, weight, whitening).transpose(2, 1, 0)
    return (white @ white.transpose(0, 2, 1)).transpose(1, 2, 0)
