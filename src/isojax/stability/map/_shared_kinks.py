"""The order of kinks that most orbits of a surface share, so that one compiled step can split them all."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import binary_dilation, distance_transform_edt

from ..orbit import Crossings

_EDGE = 1e-4
"""Share of the motion at either end within which a kink counts as lying at the end."""

AROUND = (1, 2)
"""Nodes in frequency and displacement around an odd one, to which interpolation carries its difference."""


class SharedKinks(NamedTuple):
    """Kinks that orbits pass in the same order.

    Attributes:
        phases: of each node's orbit [rad]; those of the nearest that shares the order where it does not.
        sides: signs of the kinks on each piece.
        shared: whether a node and those around it share the order.
    """

    phases: Float[np.ndarray, "frequency displacement crossing"]
    sides: Float[np.ndarray, "piece kink"]
    shared: Bool[np.ndarray, "frequency displacement"]


def shared_kinks(crossings: Crossings, shape: tuple[int, int], end: float) -> SharedKinks:
    """Find the order of kinks that most orbits share.

    Kinks at the ends of a motion are left out: it starts and, if symmetric, ends at an extreme, where the
    velocity passes zero.

    Args:
        crossings: of all nodes' orbits, node first.
        shape: frequencies and displacements of the nodes.
        end: last phase [rad].

    Returns:
        The order, and which nodes share it.
    """
    phases, kinks, sides, complete = (np.asarray(value) for value in crossings)
    early = (kinks >= 0) & (phases <= _EDGE * end)
    inner = (kinks >= 0) & ~early & (phases < (1.0 - _EDGE) * end)
    before, counts = early.sum(axis=1), inner.sum(axis=1)
    words = [
        (kinks[node, inner[node]].tobytes(), sides[node, first : first + count + 1].tobytes())
        for node, (first, count) in enumerate(zip(before, counts, strict=True))
    ]
    known = sorted(set(words))
    label = np.array([known.index(word) for word in words])
    usual = int(np.bincount(label[complete] if complete.any() else label).argmax())
    same = ((label == usual) & complete).reshape(shape)
    example = int(np.flatnonzero(label == usual)[0])
    count = int(counts[example])
    passed = np.zeros((label.size, count))
    for node in np.flatnonzero(same.ravel()):
        passed[node] = phases[node, inner[node]]
    passed = passed.reshape(*shape, count)
    if not same.all() and same.any():
        nearest = distance_transform_edt(~same, return_distances=False, return_indices=True)
        passed = passed[tuple(np.asarray(nearest))]
    around = np.ones(tuple(2 * reach + 1 for reach in AROUND), bool)
    shared = np.logical_not(binary_dilation(~same, structure=around))
    return SharedKinks(passed, sides[example, before[example] : before[example] + count + 1], shared)
