"""Which orbits of the surface a force holds, and what the surface says of them."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from ..._types import Lanes
from ._forces import PARTS
from ._surface import Surface

_POLISHING = 2
"""Steps on the polynomial of a piece, after the parabola of a part."""


class ReadOrbits(NamedTuple):
    """Orbits as read off the surface, each from the phase of its largest displacement.

    Attributes:
        states: there.
        direction: the drive over its amplitude: sine and cosine part, tau counted from there.
        phases: where the orbit passes kinks.
        invariants: half the trace and the determinant of the derivative of the period map, or of its half.
        response: half the peak-to-peak displacement [m].
    """

    states: tuple[Lanes, ...]
    direction: tuple[Lanes, Lanes]
    phases: tuple[Lanes, ...]
    invariants: tuple[Lanes, Lanes]
    response: Lanes


class Candidates(NamedTuple):
    """Orbits to be found, sorted by order, then force, then frequency.

    Attributes:
        force: place of the drive amplitude in the window.
        frequency: place of the frequency.
        leg: twice the part of the surface's displacement amplitudes in which the orbit lies, and one more
            where the force rises there: the force may turn within a part.
        order: which of the orbits of its cell, by rising displacement.
    """

    force: Int[np.ndarray, " candidate"]
    frequency: Int[np.ndarray, " candidate"]
    leg: Int[np.ndarray, " candidate"]
    order: Int[np.ndarray, " candidate"]

    @property
    def part(self) -> Int[np.ndarray, " candidate"]:
        """The part of the surface's displacement amplitudes."""
        return self.leg >> 1


class PlacedSurface(NamedTuple):
    """The surface on the devices, with the axes of the map.

    Attributes:
        polynomials: the surface's.
        breaks: logarithm of displacement over rest [m] where one piece ends and the next begins.
        rest: displacement at rest [m].
        amplitudes: drive amplitudes of the map.
        frequencies: of the map [Hz].
    """

    polynomials: Float[Array, "frequency piece table power"]
    breaks: Float[Array, " break"]
    rest: Float[Array, ""]
    amplitudes: Float[Array, " amplitude"]
    frequencies: Float[Array, " frequency"]


def find_candidates(surface: Surface, forces: Float[np.ndarray, " force"], coexisting: bool) -> Candidates:
    """Find every orbit of the surface that a force of the window holds, or that of the smallest motion."""
    # The count of forces below the surface; between two ends it changes by the forces that are passed.
    rank = np.searchsorted(forces, surface.forces.ends).astype(np.int32)
    risen = np.diff(rank, axis=1)
    # Where the force turns beyond both ends of a part, that has two legs.
    column, part, turned = surface.forces.turns
    legs = np.stack([rank[column, part], np.searchsorted(forces, turned), rank[column, part + 1]], axis=1)
    two = (legs[:, 1] - legs[:, 0]) * (legs[:, 1] - legs[:, 2]) > 0
    risen[column[two], part[two]] = 0
    place = np.flatnonzero(risen)
    begin = rank.ravel()[place + place // risen.shape[1]]
    end = begin + risen.ravel()[place]
    twice, legs = np.repeat(column[two] * risen.shape[1] + part[two], 2), legs[two].astype(np.int32)
    at = np.searchsorted(place, twice)
    place, begin, end = (
        np.insert(values, at, more)
        for values, more in ((place, twice), (begin, legs[:, :2].ravel()), (end, legs[:, 1:].ravel()))
    )
    column, part = np.divmod(place, risen.shape[1])
    # Along one run up or down a force is passed once.
    up = end > begin
    new = np.ones(up.size, bool)
    new[1:] = (up[1:] != up[:-1]) | (column[1:] != column[:-1])
    first = np.maximum.accumulate(
        np.where(np.r_[True, column[1:] != column[:-1]][: column.size], np.arange(up.size), 0)
    )
    runs = np.cumsum(new)
    run = runs - runs[first] if up.size else runs
    leg = (2 * part + up).astype(np.int32)
    low, risen = np.minimum(begin, end), np.abs(end - begin)
    shape = len(forces), len(surface.frequencies)
    counts = np.zeros(shape[0] * shape[1], np.int8)
    cells: list[np.ndarray] = []
    for place in range(int(run.max(initial=0)) + 1):
        own = run == place
        passed = risen[own]
        begins = np.cumsum(passed) - passed
        cell = np.repeat((low[own] - begins) * shape[1] + column[own], passed)
        cell += np.arange(0, cell.size * shape[1], shape[1])
        if not cells:
            cells.append(np.full(counts.size, -1, np.int32))
            cells[0][cell] = np.repeat(leg[own], passed)
            counts += cells[0] >= 0
            continue
        order = counts[cell]
        for count in range(int(order.max(initial=-1)) + 1):
            if count == len(cells):
                cells.append(np.full(counts.size, -1, np.int32))
            which = order == count
            cells[count][cell[which]] = np.repeat(leg[own], passed)[which]
        counts[cell] += 1
    held = cells if coexisting else cells[:1]
    lists = []
    for order, legs in enumerate(held):
        force, column = np.indices(shape, np.int32).reshape(2, -1)
        has = legs >= 0
        if not has.all():
            force, column, legs = force[has], column[has], legs[has]
        lists.append(Candidates(force, column, legs, np.full(force.size, order, np.int32)))
    return joined(lists)


def joined(lists: list[Any]) -> Any:
    """Join lists of cells or of orbits.

    Args:
        lists: named tuples of one kind, of arrays with a leading axis.

    Returns:
        One such tuple.
    """
    if len(lists) == 1:
        return lists[0]
    return type(lists[0])(*(np.concatenate(own) for own in zip(*lists, strict=True)))


def read_surface(
    surface: PlacedSurface,
    states: int,
    force: Int[Array, " candidate"],
    column: Int[Array, " candidate"],
    leg: Int[Array, " candidate"],
) -> ReadOrbits:
    """Give candidates as read off the surface.

    Args:
        surface: the surface.
        states: count of states.
        force: place of the drive amplitude of each candidate in the window.
        column: place of its frequency.
        leg: see `Candidates`.

    Returns:
        What the surface says of them.
    """
    _, pieces, tables, powers = surface.polynomials.shape
    # Unsigned, and promised to exist: the wrapping of negative places costs more than the reading.
    force, column, leg = (jnp.asarray(places, jnp.uint32) for places in (force, column, leg))
    part, rises = leg >> 1, (leg & 1).astype(bool)
    piece, share = part // PARTS, (part % PARTS) / PARTS
    base = (column * pieces + piece) * (tables * powers)
    flat = surface.polynomials.ravel()

    def at_place(values: Array, place: Array) -> Array:
        return values.at[place].get(mode="promise_in_bounds")

    def polynomial(table: int) -> list[Array]:
        return [at_place(flat, base + (table * powers + power)) for power in range(powers)]

    push, begin, end = (
        at_place(surface.amplitudes, force),
        *(at_place(surface.breaks, piece + k) for k in (0, 1)),
    )
    own = [polynomial(table) for table in range(tables)]
    # Gathered apart from what follows, which then runs in vector registers.
    own, push, begin, end, share, rises = jax.lax.optimization_barrier((own, push, begin, end, share, rises))

    def value(own: list[Array], at: Array) -> Array:
        total = own[-1]
        for coefficient in own[-2::-1]:
            total = total * at + coefficient
        return total

    def slope(own: list[Array], at: Array) -> Array:
        total = (powers - 1) * own[-1]
        for power in range(powers - 2, 0, -1):
            total = total * at + power * own[power]
        return total

    def curvature(own: list[Array], at: Array) -> Array:
        total = (powers - 1) * (powers - 2) * own[-1]
        for power in range(powers - 2, 1, -1):
            total = total * at + power * (power - 1) * own[power]
        return total

    def passed_to_root(gap: Array, steep: Array, bend: Array) -> Array:
        """Give how far the root of a parabola lies at which it rises or falls as the leg does."""
        root = jnp.where(rises, 1.0, -1.0) * jnp.sqrt(jnp.maximum(steep * steep - 2.0 * bend * gap, 0.0))
        same = steep * root >= 0.0
        over = jnp.where(same, steep + root, bend)
        return jnp.where(same, -2.0 * gap, root - steep) / jnp.where(over == 0.0, 1.0, over)

    drive = own[:2]

    def square(at: Array) -> Array:
        return value(drive[0], at) ** 2 + value(drive[1], at) ** 2

    # The parabola through both ends and the middle of the part: which of its roots is known by the slope.
    left, middle, right = (square(share + k / PARTS) - push * push for k in (0.0, 0.5, 1.0))
    bend, rise = 4.0 * (left + right - 2.0 * middle), 4.0 * middle - 3.0 * left - right
    at = share + jnp.clip(passed_to_root(left, rise, bend), 0.0, 1.0) / PARTS
    for _ in range(_POLISHING):
        # Steps of second order: next to a fold those of Newton's method would lead both legs to one root.
        parts = [(value(one, at), slope(one, at), curvature(one, at)) for one in drive]
        gap = parts[0][0] ** 2 + parts[1][0] ** 2 - push * push
        steep = 2.0 * (parts[0][0] * parts[0][1] + parts[1][0] * parts[1][1])
        bends = [2.0 * (own[1] ** 2 + own[0] * own[2]) for own in parts]
        at = jnp.clip(at + passed_to_root(gap, steep, bends[0] + bends[1]), share, share + 1.0 / PARTS)
    size = jnp.exp(begin + at * (end - begin))
    sine, cosine = (value(one, at) for one in drive)
    internal = tuple(value(own[table], at) * size for table in range(2, states))
    phases = tuple(value(own[table], at) for table in range(states, tables - 3))
    half_trace, determinant, response = (value(own[tables - k], at) for k in (3, 2, 1))
    # There the velocity is zero, and the displacement is what the surface counts by.
    here = (surface.rest + size, 0.0 * size, *internal)
    return ReadOrbits(here, (sine / push, cosine / push), phases, (half_trace, determinant), response * size)
