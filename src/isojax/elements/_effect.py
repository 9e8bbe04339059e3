"""What every physical effect declares, whatever it acts on."""

from collections.abc import Mapping
from typing import ClassVar, Literal, NamedTuple

import equinox as eqx

from .._show import shown
from .._types import Lanes

Channels = Mapping[str, Lanes]
"""Signals made from a record beside its drive, by name."""


Group = Literal[
    "Springs",
    "Dampers",
    "Dry friction and hysteresis",
    "Relaxation and further masses",
    "The drive and the floor",
    "The response channel",
]
"""Where the list of effects in the documentation shows one."""


class LookAlike(NamedTuple):
    """Effects that records can confuse with the declaring one, and the test that separates them.

    A pair is declared by one of the two, and holds for both.

    Attributes:
        others: catalogue names.
        test: what to do and why it separates them: the first half of a sentence.
        among: whether the same test separates the others from one another.
        exact: whether both laws leave the same trace in any record, so that `twins` translates one into the
            other.
        beside: catalogue names of what must be free in the model for that, such as a linear spring.
    """

    others: tuple[str, ...]
    test: str
    among: bool = False
    exact: bool = False
    beside: tuple[str, ...] = ()

    def separates(self, declared_by: str, names: set[str]) -> bool:
        """Say whether the test separates some of these effects.

        Args:
            declared_by: catalogue name of the declaring effect.
            names: catalogue names.

        Returns:
            True if it does.
        """
        return len(names & {declared_by, *self.others}) > 1 and (self.among or declared_by in names)


@shown
class Scales(eqx.Module):
    """Typical magnitudes of a record, from which an element guesses its own parameters.

    Attributes:
        mass: moving mass [kg].
        force: amplitude of the drive [N].
        displacement: amplitude of the motion [m].
        velocity: amplitude of the velocity [m/s].
        acceleration: amplitude of the acceleration [m/s^2].
        angular_frequency: centre of the excited band [rad/s].
        sample_time: time between samples [s].
        slowest_velocity: smallest velocity amplitude among the dwells or windows [m/s].
        reading: amplitude of the measured output [its SI unit].
        largest_reading: largest measured output [its SI unit]; 0 where it is not known.
        pressure: mean pressure of the records [Pa]; that of the air where none is recorded.
        temperature: mean temperature of the records [K]; that of a room where none is recorded.
    """

    mass: float
    force: float
    displacement: float
    velocity: float
    acceleration: float
    angular_frequency: float
    sample_time: float
    slowest_velocity: float
    reading: float
    largest_reading: float = 0.0
    pressure: float = 101325.0
    temperature: float = 293.15


class AbstractEffect(eqx.Module):
    """One physical effect: what it is called, when it is absent, and what else every one declares.

    Attributes:
        name: catalogue name.
        words: what the effect is, for reports.
        strength: the field that is zero when the effect is absent.
        signed: whether a negative strength is physical.
        internal_states: how many internal states it carries.
        absorbs: catalogue names of effects that this one contains; it takes their place in a model.
        needs: catalogue names of effects without which this one means nothing.
        group: where the list of effects in the documentation shows it.
        seldom: whether a commoner effect has the same force, and goes first where records show either.
        freed_by: field of campaign.toml, as `section.field`, that puts the effect into the first model.
        look_alikes: effects that records can confuse with this one; each pair is declared once.
    """

    name: ClassVar[str]
    words: ClassVar[str]
    strength: ClassVar[str]
    signed: ClassVar[bool] = False
    internal_states: ClassVar[int] = 0
    absorbs: ClassVar[tuple[str, ...]] = ()
    needs: ClassVar[tuple[str, ...]] = ()
    group: ClassVar[Group]
    seldom: ClassVar[bool] = False
    freed_by: ClassVar[str] = ""
    look_alikes: ClassVar[tuple[LookAlike, ...]] = ()
