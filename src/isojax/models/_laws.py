"""Which law of the elements is meant where one jumps or bends: rounded, continued from one side, or sharp."""

import abc
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool

from .._types import Internal, Lanes
from ..elements import AbstractElement

State = tuple[Lanes, ...]
"""Displacement [m], velocity [m/s], then the internal states of each element in turn."""

Elements = tuple[AbstractElement, ...]


def share_internal(elements: Elements, state: State) -> list[Internal]:
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


def evaluate_corners(elements: Elements, state: State) -> list[tuple[Lanes, ...]]:
    """Evaluate the functions at whose zeros laws, unrounded, have a corner; those of each element."""
    shares = zip(elements, share_internal(elements, state), strict=True)
    return [element.corners(state[0], state[1], own) for element, own in shares]


class Switches(NamedTuple):
    """The functions of the state at whose zeros some law jumps or bends, each once.

    Attributes:
        values: of the functions.
        places: which of them are those of each element, in its own order.
        velocity: which of them is the velocity; -1 where no law depends on its sign.
    """

    values: State
    places: tuple[tuple[int, ...], ...]
    velocity: int


def find_switches(elements: Elements, state: State) -> Switches:
    """Find where laws jump or bend: the corners of those that split records, the kinks of the others.

    Laws that share a switch, such as the velocity, give back the very array that they were given.

    Args:
        elements: the isolator's.
        state: displacement, velocity and internal states.

    Returns:
        The switches.
    """
    values: list[Lanes] = []
    places = []

    def place_of(one: Lanes) -> int:
        for place, other in enumerate(values):
            if one is other:
                return place
        values.append(one)
        return len(values) - 1

    for element, internal in zip(elements, share_internal(elements, state), strict=True):
        own = (element.corners if element.splits else element.kinks)(state[0], state[1], internal)
        places.append(tuple(place_of(one) for one in own))
    if any(element.slides for element in elements):
        place_of(state[1])
    velocity = next((place for place, one in enumerate(values) if one is state[1]), -1)
    return Switches(tuple(values), tuple(places), velocity)


class AbstractLaw(eqx.Module):
    """Which forces and state rates of the elements are meant."""

    @abc.abstractmethod
    def forces(self, elements: Elements, state: State) -> list[Lanes]:
        """Give the force of each element [N]."""

    def state_rates(self, elements: Elements, state: State) -> list[Internal]:
        """Give the rates of each element's internal states."""
        shares = zip(elements, share_internal(elements, state), strict=True)
        return [element.state_rate(state[0], state[1], own) for element, own in shares]

    def acceleration(self, unheld: Lanes) -> Lanes:
        """Give the acceleration of the mass from the one that it has where nothing holds it [m/s^2]."""
        return unheld


class RoundedLaw(AbstractLaw):
    """The laws with their jumps rounded, each state on its own side of the kinks."""

    def forces(self, elements: Elements, state: State) -> list[Lanes]:
        shares = zip(elements, share_internal(elements, state), strict=True)
        return [element.force(state[0], state[1], own) for element, own in shares]


ROUNDED = RoundedLaw()


class ContinuedLaw(AbstractLaw):
    """The laws of given sides of the switches, continued smoothly past them; sharp ones without rounding.

    Attributes:
        sides: +1 or -1, side of each of the isolator's switches; that of the velocity 0 where dry friction
            holds the mass.
        held: whether it does; None of a model that nothing can hold.
    """

    sides: State
    held: Bool[Array, "..."] | None = None

    def _beside(self, elements: Elements, state: State) -> list[tuple]:
        """Give each element with its internal states, the sides of its own switches and that of sliding."""
        switches = find_switches(elements, state)
        direction = self.sides[switches.velocity] if switches.velocity >= 0 else jnp.ones_like(state[1])
        own = [tuple(self.sides[place] for place in places) for places in switches.places]
        shares = share_internal(elements, state)
        return [(*each, direction) for each in zip(elements, shares, own, strict=True)]

    def forces(self, elements: Elements, state: State) -> list[Lanes]:
        x, v = state[:2]
        return [
            element.sharp_force(x, v, own, direction, sides)
            if element.splits
            else element.force_beside(x, v, own, sides)
            for element, own, sides, direction in self._beside(elements, state)
        ]

    def state_rates(self, elements: Elements, state: State) -> list[Internal]:
        return [
            element.state_rate(state[0], state[1], own)
            if element.splits
            else element.state_rate_beside(state[0], state[1], own, sides)
            for element, own, sides, _ in self._beside(elements, state)
        ]

    def acceleration(self, unheld: Lanes) -> Lanes:
        return unheld if self.held is None else jnp.where(self.held, 0.0, unheld)


class Regime(AbstractLaw):
    """The sharp laws of the regime in which a motion is: sliding one way or the other, or held by friction.

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

    def forces(self, elements: Elements, state: State) -> list[Lanes]:
        shares = _share_sides(elements, state, self.corners)
        return [
            element.sharp_force(state[0], state[1], own, self.direction, sides)
            for element, own, sides in shares
        ]

    def acceleration(self, unheld: Lanes) -> Lanes:
        return jnp.where(self.is_held, 0.0, unheld)


def _share_sides(
    elements: Elements, state: State, sides: tuple[Lanes, ...]
) -> list[tuple[AbstractElement, Internal, tuple[Lanes, ...]]]:
    """Give each element with its internal states and the sides of its own corners."""
    shares, place = [], 0
    counts = [len(own) for own in evaluate_corners(elements, state)]
    for element, internal, count in zip(elements, share_internal(elements, state), counts, strict=True):
        shares.append((element, internal, sides[place : place + count]))
        place += count
    return shares
