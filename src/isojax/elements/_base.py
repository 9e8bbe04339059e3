"""The contract of an element: one physical effect, in the force balance or on the instruments."""

import abc
from collections.abc import Mapping
from typing import ClassVar, Literal, NamedTuple

import equinox as eqx

from .._types import Internal, Lanes

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


class AbstractElement(eqx.Module):
    """One physical effect. Concrete elements declare what they are and override the methods they need.

    The force balance is `mass x'' + sum of forces = F(t)`, the paper's eq. (4): a spring returns `+k x`.
    Every method is neutral here, so that the isolator may ask each element everything and never its type.

    Attributes:
        name: catalogue name.
        words: what the effect is, for reports.
        strength: the field that is zero when the effect is absent.
        signed: whether a negative strength is physical.
        internal_states: how many internal states it carries.
        substeps: integration steps a sample that the rounded law needs at least (sharp ones need several).
        slides: whether the law, unrounded, jumps with the sign of the velocity, so that it can hold the mass.
        absorbs: catalogue names of effects that this one contains; it takes their place in a model.
        needs: catalogue names of effects without which this one means nothing.
        channels: signals made from the record that the effect follows, such as the clock; without a record it
            is absent.
        phased: whether those signals carry a phase of each record's own, found in the record.
        group: where the list of effects in the documentation shows it.
        proportional_to: the one thing that the force is proportional to: "displacement" for the linear
            spring, whose strength may differ from record to record, "velocity" for the linear damper; empty
            for every other law.
        active: whether the law may feed energy in, so that no check of passivity refuses it.
        freed_by: field of campaign.toml, as `section.field`, that puts the effect into the first model.
        starts_at_mean: whether its strength, a zero error of the sensor, starts at the mean reading.
        look_alikes: effects that records can confuse with this one; each pair is declared once.
    """

    name: ClassVar[str]
    words: ClassVar[str]
    strength: ClassVar[str]
    signed: ClassVar[bool] = False
    internal_states: ClassVar[int] = 0
    substeps: ClassVar[int] = 1
    slides: ClassVar[bool] = False
    absorbs: ClassVar[tuple[str, ...]] = ()
    needs: ClassVar[tuple[str, ...]] = ()
    channels: ClassVar[tuple[str, ...]] = ()
    phased: ClassVar[bool] = False
    group: ClassVar[Group]
    proportional_to: ClassVar[str] = ""
    active: ClassVar[bool] = False
    freed_by: ClassVar[str] = ""
    starts_at_mean: ClassVar[bool] = False
    look_alikes: ClassVar[tuple[LookAlike, ...]] = ()

    @classmethod
    @abc.abstractmethod
    def guess(cls, scales: Scales) -> "AbstractElement":
        """Give the absent effect (zero strength) with sensible shape parameters.

        Args:
            scales: magnitudes of the record.

        Returns:
            The element at zero strength.
        """

    @classmethod
    def grid(cls, scales: Scales) -> "tuple[AbstractElement, ...]":
        """Give the absent effect over a grid of the parameters that mean nothing at zero strength.

        Args:
            scales: magnitudes of the record.

        Returns:
            Elements at zero strength; one if there is nothing to vary.
        """
        return (cls.guess(scales),)

    @classmethod
    @abc.abstractmethod
    def typical_strength(cls, scales: Scales) -> float:
        """Give the strength at which the effect would be as large as the motion itself.

        Args:
            scales: magnitudes of the record.

        Returns:
            Strength [its SI unit], positive; the scale of columns and of bounds.
        """

    def force(self, x: Lanes, v: Lanes, s: Internal) -> Lanes:
        """Give the force on the left-hand side of the balance [N].

        Args:
            x: displacement [m].
            v: velocity [m/s].
            s: internal states.

        Returns:
            Force [N], positive when it opposes positive motion.
        """
        return 0.0 * x

    def state_rate(self, x: Lanes, v: Lanes, s: Internal) -> Internal:
        """Give the rates of the internal states.

        Args:
            x: displacement [m].
            v: velocity [m/s].
            s: internal states.

        Returns:
            One rate an internal state.
        """
        return tuple(0.0 * state for state in s)

    def base_rate(self, a: Lanes, s: Internal) -> Internal:
        """Give what the acceleration of the base adds to the rates of the internal states.

        Under base excitation the coordinate moves with the base; a mass among the internal states, in that
        coordinate, feels the base as the isolated mass does.

        Args:
            a: acceleration of the base [m/s^2].
            s: internal states.

        Returns:
            One rate an internal state.
        """
        return tuple(0.0 * state for state in s)

    def unphysical_shape(self, displacement: float) -> str | None:
        """Say what makes the shape parameters no law of matter at an amplitude, if anything.

        Energy over a loop is asked of every element with memory from outside; this is for degenerate shapes
        that take energy and yet are none.

        Args:
            displacement: largest displacement visited [m].

        Returns:
            The end of a sentence about the effect, or None.
        """
        return None

    def twins(self) -> "tuple[AbstractElement, ...]":
        """Give this law as its exact look-alikes of other kinds, which no search need find.

        Returns:
            One element for each of the exact `look_alikes`, with the shape and strength that make it this
            law, but for a force of the effects beside which they are alike.
        """
        return ()

    @classmethod
    def twin_of(cls, other: "AbstractElement") -> "AbstractElement | None":
        """Give the law of an exact look-alike as one of this kind: the way back from `twins`.

        Args:
            other: an element of any kind.

        Returns:
            The element of this kind, with one of the shapes that do; None where there is none.
        """
        return None

    def kinks(self, x: Lanes, v: Lanes, s: Internal) -> tuple[Lanes, ...]:
        """Give the functions of the state at whose zeros the law is continuous but not smooth.

        A periodic orbit is split where one changes sign, so that each piece is smooth. An element that
        declares any overrides `force_beside` and `state_rate_beside` where the side matters.

        Args:
            x: displacement [m].
            v: velocity [m/s].
            s: internal states.

        Returns:
            One value a kink, such as `x` for |x|x.
        """
        return ()

    def force_beside(self, x: Lanes, v: Lanes, s: Internal, sides: tuple[Lanes, ...]) -> Lanes:
        """Give the force with the law of one side of each kink, carried on smoothly past it.

        Args:
            x: displacement [m].
            v: velocity [m/s].
            s: internal states.
            sides: +1 or -1, the sign of each of `kinks` on the side that is meant.

        Returns:
            Force [N]; equal to `force` where the state lies on those sides.
        """
        return self.force(x, v, s)

    def state_rate_beside(self, x: Lanes, v: Lanes, s: Internal, sides: tuple[Lanes, ...]) -> Internal:
        """Give the rates of the internal states with the law of one side of each kink; see `force_beside`.

        Args:
            x: displacement [m].
            v: velocity [m/s].
            s: internal states.
            sides: +1 or -1, the sign of each of `kinks` on the side that is meant.

        Returns:
            One rate an internal state; equal to `state_rate` where the state lies on those sides.
        """
        return self.state_rate(x, v, s)

    def corners(self, x: Lanes, v: Lanes, s: Internal) -> tuple[Lanes, ...]:
        """Give the functions of the state at whose zeros the law, unrounded, has a corner.

        A simulated record is split there, and where an element that `slides` changes direction, so that each
        piece has the law of `sharp_force`. Orbits and maps keep to `force`, which is smooth.

        Args:
            x: displacement [m].
            v: velocity [m/s].
            s: internal states.

        Returns:
            One value a corner, such as `x - g` of a stop.
        """
        return ()

    def sharp_force(
        self, x: Lanes, v: Lanes, s: Internal, direction: Lanes, sides: tuple[Lanes, ...]
    ) -> Lanes:
        """Give the force of the law without its rounding, each piece carried on smoothly past its end.

        Args:
            x: displacement [m].
            v: velocity [m/s].
            s: internal states.
            direction: +1 or -1, the sign of the velocity that is meant.
            sides: +1 or -1, the sign of each of `corners` on the side that is meant.

        Returns:
            Force [N].
        """
        return self.force(x, v, s)

    @property
    def splits(self) -> bool:
        """Whether simulated records are split where this law jumps or bends."""
        return self.slides or type(self).corners is not AbstractElement.corners

    def inertia(self) -> Lanes | float:
        """Give the mass that moves with the isolator [kg]."""
        return 0.0

    def drive(self, u: Lanes, u_rate: Lanes) -> tuple[Lanes, Lanes]:
        """Turn the recorded drive into the one that acted.

        Args:
            u: recorded drive, already shifted by `shift()` [N, or m/s^2 for base excitation].
            u_rate: its time derivative.

        Returns:
            The drive that acted, and its time derivative.
        """
        return u, u_rate

    def shift(self) -> Lanes | float:
        """Give the time by which the recorded drive leads the one that acted [s]."""
        return 0.0

    def reading(self, y: Lanes, s: Internal) -> Lanes:
        """Turn the motion at the sensor into the recorded reading.

        Args:
            y: motion at the sensor [its SI unit].
            s: internal states.

        Returns:
            The reading.
        """
        return y

    def channel_drive(self, channels: Channels) -> Lanes | float:
        """Give what signals of the record add to the drive that acted.

        Args:
            channels: the signals, by name; those in `channels` are there.

        Returns:
            Drive [N, or m/s^2 for base excitation].
        """
        return 0.0

    def channel_force(self, x: Lanes, v: Lanes, channels: Channels) -> Lanes | float:
        """Give a force on the left-hand side of the balance that follows signals of the record [N].

        Args:
            x: displacement [m].
            v: velocity [m/s].
            channels: the signals, by name.

        Returns:
            Force [N].
        """
        return 0.0

    def channel_base(self, channels: Channels) -> Lanes | None:
        """Give the acceleration that the ground under the isolator has by signals of the record.

        The coordinate then moves with the ground, and an acceleration reading is the absolute one.

        Args:
            channels: the signals, by name.

        Returns:
            Acceleration [m/s^2]; None where the element leaves the ground alone.
        """
        return None

    def channel_reading(self, channels: Channels) -> Lanes | float:
        """Give what signals of the record add to the reading.

        Args:
            channels: the signals, by name.

        Returns:
            Reading [its SI unit].
        """
        return 0.0

    def reading_rate(self, y: Lanes, s: Internal) -> Internal:
        """Give what the motion at the sensor adds to the rates of the internal states (a sensor with memory).

        Args:
            y: motion at the sensor [its SI unit].
            s: internal states.

        Returns:
            One rate an internal state.
        """
        return tuple(0.0 * state for state in s)
