"""The force along the displacements of a surface: at the ends of equal parts, and where it turns."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

PARTS = 8
"""Parts of a spline's piece between whose ends roots are sought."""

_TURN_BISECTIONS = 24
"""Halvings of the part in which the force turns: the force there is then known to the last digit."""


class Turns(NamedTuple):
    """Where the force turns, once a part, sorted by frequency and displacement.

    Attributes:
        column: of the frequencies.
        part: in which it turns.
        force: there [N, or m/s^2 for base excitation].
    """

    column: Int[np.ndarray, " turn"]
    part: Int[np.ndarray, " turn"]
    force: Float[np.ndarray, " turn"]


class Forces(NamedTuple):
    """The force of the orbits of a surface.

    Attributes:
        ends: at the ends of the parts [N, or m/s^2 for base excitation].
        turns: where it is largest or smallest, between ends.
    """

    ends: Float[np.ndarray, "frequency end"]
    turns: Turns


def forces_along(drive: Float[np.ndarray, "frequency piece 2 power"]) -> Forces:
    """Give the force along the displacements.

    Args:
        drive: polynomials of the sine and the cosine part on each piece, over the share that is passed.

    Returns:
        The force.
    """
    columns, powers = drive.shape[0], drive.shape[-1]
    shares = (np.arange(PARTS)[:, None] / PARTS) ** np.arange(powers)
    inside = np.moveaxis(drive, 2, 0) @ shares.T
    last = drive[:, -1].sum(axis=-1)
    square = np.concatenate(
        [(inside**2).sum(axis=0).reshape(columns, -1), (last**2).sum(axis=1)[:, None]], axis=1
    )
    rises = square[:, 1:] > square[:, :-1]
    column, end = np.nonzero(rises[:, 1:] != rises[:, :-1])
    end += 1
    # It turns before the end next to it or behind, as the slope there says.
    behind = (_square(drive, column, end, np.zeros(end.size))[1] > 0.0) != rises[column, end]
    part = np.where(behind, end, end - 1)
    # Once a part: beside a fold that no node resolves it may turn twice.
    once = np.unique(column * rises.shape[1] + part, return_index=True)[1]
    column, part, falls_first = column[once], part[once], rises[column, end][once]
    low, high = np.zeros(part.size), np.ones(part.size)
    for _ in range(_TURN_BISECTIONS):
        middle = 0.5 * (low + high)
        before = (_square(drive, column, part, middle)[1] < 0.0) == falls_first
        low, high = np.where(before, middle, low), np.where(before, high, middle)
    turned = np.sqrt(_square(drive, column, part, 0.5 * (low + high))[0])
    return Forces(np.sqrt(square), Turns(column, part, turned))


def _square(
    drive: np.ndarray, column: np.ndarray, part: np.ndarray, share: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Give the square of the force and its slope at a share of a part."""
    own = drive[column, part // PARTS]
    place = ((part % PARTS + share) / PARTS)[:, None]
    powers = np.arange(own.shape[-1])
    value = np.einsum("tck,tk->tc", own, place**powers)
    slope = np.einsum("tck,tk->tc", own[:, :, 1:] * powers[1:], place ** powers[:-1])
    return (value**2).sum(axis=1), 2.0 * (value * slope).sum(axis=1)
