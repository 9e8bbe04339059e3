"""Elements of one kind side by side: their internal states and their forces are traced once a kind."""

from typing import Any, NamedTuple

import jax
import numpy as np

from ..._types import Internal, Lanes, on_device
from ...elements import AbstractElement
from ...models import State


class ElementFamily(NamedTuple):
    """Elements of one kind, side by side: a kind is traced once, however many there are.

    Attributes:
        elements: their numbers stacked.
        places: where each stands among all elements given.
    """

    elements: AbstractElement
    places: tuple[int, ...]


def find_families(probes: tuple[AbstractElement, ...]) -> tuple[ElementFamily, ...]:
    """Put elements of one kind side by side."""
    groups: dict[Any, list[int]] = {}
    for place, probe in enumerate(probes):
        groups.setdefault((type(probe), jax.tree_util.tree_structure(probe)), []).append(place)
    families = []
    for places in groups.values():
        members = [probes[place] for place in places]
        # By NumPy: JAX would compile a program for each number of members.
        stacked = jax.tree_util.tree_map(lambda *leaves: on_device(np.stack(leaves)), *members)
        families.append(ElementFamily(stacked, tuple(places)))
    return tuple(families)


def in_turn(families: tuple[ElementFamily, ...], part: int) -> tuple[ElementFamily, ...]:
    """Give families in the order in which a worker takes them: two workers start at either end.

    Each kind is compiled by itself; workers that took them in one order would wait for each other.
    """
    return families if part % 2 == 0 else families[::-1]


def stack_states(
    families: tuple[ElementFamily, ...], probes: tuple[AbstractElement, ...], rows: State
) -> State:
    """Give internal states family by family, each with its members first.

    Args:
        families: the families.
        probes: the elements, in their own order.
        rows: internal states in that order.

    Returns:
        One array a state of a family.
    """
    ends = np.cumsum([0, *(probe.internal_states for probe in probes)])
    return tuple(
        on_device(np.stack([rows[ends[place] + state] for place in family.places]))
        for family in families
        for state in range(family.elements.internal_states)
    )


def follow_motion(
    element: AbstractElement, x: Lanes, v: Lanes, y: Lanes, base: Lanes | None, s: Internal
) -> Internal:
    """Give the rates of an element's internal states along a given motion.

    Args:
        element: the element.
        x: displacement [m].
        v: velocity [m/s].
        y: motion at the sensor [its SI unit].
        base: acceleration of the base that acted [m/s^2], or None without base excitation.
        s: internal states.

    Returns:
        One rate an internal state.
    """
    law, sensed = element.state_rate(x, v, s), element.reading_rate(y, s)
    rates = tuple(one + other for one, other in zip(law, sensed, strict=True))
    if base is None:
        return rates
    return tuple(one + other for one, other in zip(rates, element.base_rate(base, s), strict=True))
