"""Arrays that JAX takes as they are, without a copy."""

import math

import numpy as np

_ALIGNED_TO = 64
"""Bytes to whose multiples XLA aligns arrays on CPUs."""


def aligned(shape: tuple[int, ...], kind: type = float) -> np.ndarray:
    """Give an array that begins where XLA wants one to begin: `jax.device_put` then copies nothing.

    Args:
        shape: of the array.
        kind: of its entries.

    Returns:
        The array, with nothing written into it.
    """
    size = math.prod(shape) * np.dtype(kind).itemsize
    room = np.empty(size + _ALIGNED_TO, np.uint8)
    begin = -room.ctypes.data % _ALIGNED_TO
    return room[begin : begin + size].view(kind).reshape(shape)
