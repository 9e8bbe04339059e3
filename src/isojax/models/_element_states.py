"""What belongs to which element: internal states, kinks, corners, and the pieces of sharp laws."""

from typing import Literal, NamedTuple

from jaxtyping import Array, Bool

from .._types import Internal, Lanes
from ..elements import AbstractElement

State = tuple[Lanes, ...]
"""Displacement [m], velocity [m/s], then the internal states of each element in turn."""


class Regime(NamedTuple):
    """Where a motion stands among the pieces of laws that jump or bend.

    Attributes:
        direction: +1 or -1, that of the sliding; 0 where dry friction holds the mass.
        corners: +1 or -1, side of each of the isolator's corners.
    """

    direction: Lanes
    corners: tuple[Lanes, ...]

    @property
    def is_held(self) -> Bool[Array, "..."]:
        """Whether dry friction holds the mass: displacement and velocity then stay."""
        return self.direction == 0.0


def share_internal(elements: tuple[AbstractElement, ...], state: State) -> list[Internal]:
    """Share the internal states out among the elements.

    Args:
        elements: the isolator's.
        state: displacement, velocity and internal states.

    Returns:
        Those of each element.
    """
    shares, place = [], 2
    for element in elements:
        shares.append(state[place : place + element.internal_states])
        place += element.internal_states
    return shares


def gather(elements: tuple[AbstractElement, ...], state: State, what: Literal["kinks", "corners"]) -> State:
    """Gather the functions at whose zeros laws are not smooth.

    Args:
        elements: the isolator's.
        state: displacement, velocity and internal states.
        what: the method that gives them.

    Returns:
        Those of each element in turn.
    """
    shares = zip(elements, share_internal(elements, state), strict=True)
    return tuple(one for element, own in shares for one in getattr(element, what)(state[0], state[1], own))


def share_sides(
    elements: tuple[AbstractElement, ...], state: State, sides: State | Regime
) -> list[tuple[Lanes, ...]]:
    """Share the sides of the kinks, or of a regime's corners, out among the elements.

    Args:
        elements: the isolator's.
        state: displacement, velocity and internal states.
        sides: one a kink, or the regime.

    Returns:
        Those of each element.
    """
    shares, place = [], 0
    sharp = isinstance(sides, Regime)
    values = sides.corners if sharp else sides
    for element, internal in zip(elements, share_internal(elements, state), strict=True):
        count = len((element.corners if sharp else element.kinks)(state[0], state[1], internal))
        shares.append(values[place : place + count])
        place += count
    return shares


def sum_forces(elements: tuple[AbstractElement, ...], state: State, sides: State | Regime | None) -> Lanes:
    """Sum the forces of the elements.

    Args:
        elements: the isolator's.
        state: displacement, velocity and internal states.
        sides: see `Isolator.restoring_force`.

    Returns:
        Force on the left-hand side of the balance [N].
    """
    x, v = state[:2]
    total = 0.0 * x
    shares = share_internal(elements, state)
    if sides is None:
        for element, internal in zip(elements, shares, strict=True):
            total = total + element.force(x, v, internal)
        return total
    for element, internal, own in zip(elements, shares, share_sides(elements, state, sides), strict=True):
        if isinstance(sides, Regime):
            total = total + element.sharp_force(x, v, internal, sides.direction, own)
        else:
            total = total + element.force_beside(x, v, internal, own)
    return total
