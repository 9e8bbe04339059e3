"""Starts of all orbits over a window: which orbit of the surface a force holds."""

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from ..._types import Lanes
from ._surface import Surface


class Starts(NamedTuple):
    """Orbits as read off the surface, each from the phase of its largest displacement.

    Attributes:
        states: there.
        direction: the drive over its amplitude: sine and cosine part, tau counted from there.
        phases: where the orbit passes kinks.
        response: half the peak-to-peak displacement [m].
    """

    states: tuple[Lanes, ...]
    direction: tuple[Lanes, Lanes]
    phases: tuple[Lanes, ...]
    response: Lanes


class Candidates(NamedTuple):
    """Orbits to be found, sorted by force, then frequency, then displacement.

    Attributes:
        force: place of the drive amplitude in the window.
        frequency: place of the frequency.
        interval: interval of the surface's displacement amplitudes in which the orbit lies.
        order: which of the orbits of its cell, by rising displacement.
    """

    force: Int[np.ndarray, " candidate"]
    frequency: Int[np.ndarray, " candidate"]
    interval: Int[np.ndarray, " candidate"]
    order: Int[np.ndarray, " candidate"]


class PlacedSurface(NamedTuple):
    """The surface on the devices, with the axes of the map.

    Attributes:
        tables: stiffness, internal states, response and phases of the surface.
        displacements: its displacement amplitudes [m].
        rest: displacement at rest [m].
        amplitudes: drive amplitudes of the map.
        frequencies: of the map [Hz].
    """

    tables: Float[Array, "table frequency displacement"]
    displacements: Float[Array, " displacement"]
    rest: Float[Array, ""]
    amplitudes: Float[Array, " amplitude"]
    frequencies: Float[Array, " frequency"]


def find_candidates(surface: Surface, forces: Float[np.ndarray, " force"]) -> Candidates:
    """Find every orbit of the surface that a force of the window holds."""
    # The count of forces below the surface; between two nodes it changes by the forces that are passed.
    rank = np.searchsorted(forces, surface.force).astype(np.int32)
    low, high = np.minimum(rank[:, :-1], rank[:, 1:]), np.maximum(rank[:, :-1], rank[:, 1:])
    passed = high - low
    column, interval = np.nonzero(passed)
    counts = passed[column, interval]
    first = np.repeat(np.cumsum(counts) - counts, counts)
    force = np.repeat(low[column, interval], counts) + np.arange(counts.sum()) - first
    column, interval = (np.repeat(part.astype(np.int32), counts) for part in (column, interval))
    cell = force.astype(np.int64) * len(surface.frequencies) + column
    # By cell, and within one by displacement, in which order they come.
    sequence = np.argsort(cell, kind="stable")
    force, column, interval, cell = (
        part[sequence] for part in (force.astype(np.int32), column, interval, cell)
    )
    new = np.r_[True, cell[1:] != cell[:-1]] if cell.size else np.zeros(0, bool)
    begin = np.maximum.accumulate(np.where(new, np.arange(cell.size), 0))
    return Candidates(force, column, interval, np.arange(cell.size) - begin)


def _weights(share: Lanes) -> tuple[Lanes, ...]:
    """Give Lagrange's weights of four equidistant nodes at a place between the middle two."""
    s = share
    return (
        -s * (s - 1.0) * (s - 2.0) / 6.0,
        (s + 1.0) * (s - 1.0) * (s - 2.0) / 2.0,
        -(s + 1.0) * s * (s - 2.0) / 2.0,
        (s + 1.0) * s * (s - 1.0) / 6.0,
    )


def candidate_starts(
    surface: PlacedSurface,
    states: int,
    force: Float[Array, " candidate"],
    column: Int[Array, " candidate"],
    interval: Int[Array, " candidate"],
) -> Starts:
    """Give the starts of candidates, read off the surface.

    Args:
        surface: the surface.
        states: count of states.
        force: drive amplitude of each candidate.
        column: place of its frequency on the surface.
        interval: interval of displacements.

    Returns:
        The starts.
    """
    tables, displacements, rest = surface[:3]
    base = jnp.clip(interval - 1, 0, displacements.size - 4)
    spacing = jnp.log(displacements[1] / displacements[0])
    logarithm = jnp.log(displacements[base + 1])
    offset = interval - base - 1.0
    drive = [[tables[table, column, base + neighbour] for neighbour in range(4)] for table in range(2)]

    def excess(share: Lanes) -> Lanes:
        weights = _weights(share)
        parts = [sum(w * v for w, v in zip(weights, values, strict=True)) for values in drive]
        return jnp.exp(logarithm + share * spacing) * jnp.hypot(*parts) - force

    left, right = offset, offset + 1.0
    at_left, at_right = excess(left), excess(right)
    for _ in range(3):
        share = left - at_left * (right - left) / jnp.where(at_right == at_left, 1.0, at_right - at_left)
        share = jnp.clip(share, offset, offset + 1.0)
        value = excess(share)
        same = (value > 0.0) == (at_left > 0.0)
        # Illinois: the end that stays counts half, so that both move.
        at_left, at_right = jnp.where(same, value, 0.5 * at_left), jnp.where(same, 0.5 * at_right, value)
        left, right = jnp.where(same, share, left), jnp.where(same, right, share)
    slope = jnp.where(at_right == at_left, 1.0, at_right - at_left)
    share = jnp.clip(left - at_left * (right - left) / slope, offset, offset + 1.0)
    weights = _weights(share)
    size = jnp.exp(logarithm + share * spacing)

    def at(table: int) -> Lanes:
        terms = (w * tables[table, column, base + n] for n, w in enumerate(weights))
        return sum(terms, start=0.0 * size)

    sine, cosine = at(0), at(1)
    push = jnp.hypot(sine, cosine)
    internal = tuple(at(table) * size for table in range(2, states))
    phases = tuple(at(table) for table in range(states + 1, tables.shape[0]))
    # There the velocity is zero, and the displacement is what the surface counts by.
    here = (rest + size, 0.0 * size, *internal)
    return Starts(here, (sine / push, cosine / push), phases, at(states) * size)
