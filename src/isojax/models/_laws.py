"""Which law of the elements is meant where one jumps or bends: rounded, continued from one side, or sharp."""

import abc
from typing import Literal

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


def evaluate_switches(
    elements: Elements, state: State, which: Literal["kinks", "corners"]
) -> list[tuple[Lanes, ...]]:
    """Evaluate the functions at whose zeros laws are not smooth."""
    shares = zip(elements, share_internal(elements, state), strict=True)
    return [getattr(element, which)(state[0], state[1], own) for element, own in shares]


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
    """The laws of given sides of the kinks, continued smoothly past them.

    Attributes:
        sides: +1 or -1, side of each of the isolator's kinks.
    """

    sides: State

    def forces(self, elements: Elements, state: State) -> list[Lanes]:
        shares = _share_sides(elements, state, "kinks", self.sides)
        return [element.force_beside(state[0], state[1], own, sides) for element, own, sides in shares]

    def state_rates(self, elements: Elements, state: State) -> list[Internal]:
        shares = _share_sides(elements, state, "kinks", self.sides)
        return [element.state_rate_beside(state[0], state[1], own, sides) for element, own, sides in shares]


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
        shares = _share_sides(elements, state, "corners", self.corners)
        return [
            element.sharp_force(state[0], state[1], own, self.direction, sides)
            for element, own, sides in shares
        ]

    def acceleration(self, unheld: Lanes) -> Lanes:
        return jnp.where(self.is_held, 0.0, unheld)


def _share_sides(
    elements: Elements, state: State, which: Literal["kinks", "corners"], sides: tuple[Lanes, ...]
) -> list[tuple[AbstractElement, Internal, tuple[Lanes, ...]]]:
    """Give each element with its internal states and the sides of its own kinks or corners."""
    shares, place = [], 0
    counts = [len(own) for own in evaluate_switches(elements, state, which)]
    for element, internal, count in zip(elements, share_internal(elements, state), counts, strict=True):
        shares.append((element, internal, sides[place : place + count]))
        place += count
    return shares
