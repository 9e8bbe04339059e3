"""The contract of what follows a signal of the record beside its drive, such as the clock or the floor."""

from typing import ClassVar, NamedTuple

from .._show import shown
from .._types import Lanes, Scalar
from ._effect import AbstractEffect, Channels
from ._force import AbstractForce


@shown
class Dependence(NamedTuple):
    """A coefficient that follows an operating condition of the record, such as the chamber pressure.

    Attributes:
        condition: name of the condition, which is that of its signal, too.
        reference: value at which the coefficient is that of the model [SI unit of the condition].
        law: what a straight line adds where the condition is twice the reference, proportional to its
            strength.
        curvature: b, by which the change bends [1].
    """

    condition: str
    reference: Scalar
    law: AbstractForce
    curvature: Scalar

    def share(self, value: Lanes) -> Lanes:
        """Give how much of the law acts at a value: `r + b r^2`, `r = value/reference - 1` [1]."""
        relative = value / self.reference - 1.0
        return relative * (1.0 + self.curvature * relative)


@shown
class AddedHarmonic(NamedTuple):
    """A harmonic that acts beside a recorded sine: `h A cos(n theta + phi)` beside `A cos(theta)`.

    Attributes:
        order: n, an integer of at least 2 [1].
        share: h, harmonic over fundamental [1].
        phase: phi [rad].
    """

    order: Scalar
    share: Scalar
    phase: Scalar


class AbstractFollower(AbstractEffect):
    """What follows signals made from the record; without a record it is absent.

    Attributes:
        channels: names of the signals.
        phased: whether they carry a phase of each record's own, which is read from the record.
    """

    channels: ClassVar[tuple[str, ...]] = ()
    phased: ClassVar[bool] = False

    def skew(self) -> Lanes | float:
        """Give the share of the time since the start of the file by which the recorded drive leads [1].

        An element that gives one follows "elapsed".
        """
        return 0.0

    def channel_drive(self, channels: Channels) -> Lanes | float:
        """Give what signals of the record add to the drive that acted.

        Args:
            channels: the signals, by name; those in `channels` are there.

        Returns:
            Drive [N, or m/s^2 for base excitation].
        """
        return 0.0

    def harmonics(self) -> tuple[AddedHarmonic, ...]:
        """Give the harmonics that act beside a recorded sine, where there is no record.

        Like the recorded sine they are changed by the `drive` and `shift` of all elements after.

        Returns:
            The harmonics; none at zero strength, or such with share zero.
        """
        return ()

    def check_record(self) -> None:
        """Refuse a shape of the effect whose signals no record has.

        Raises:
            ValueError: if there is none.
        """

    def channel_force(self, x: Lanes, v: Lanes, channels: Channels) -> Lanes | float:
        """Give a force on the left-hand side of the balance that follows signals of the record [N].

        Args:
            x: displacement [m].
            v: velocity [m/s].
            channels: the signals, by name.

        Returns:
            Force [N].
        """
        follows = self.dependence()
        return (
            0.0
            if follows is None
            else follows.share(channels[follows.condition]) * follows.law.force(x, v, ())
        )

    def dependence(self) -> Dependence | None:
        """Give the operating condition that the effect follows, and the law that it changes.

        Where there is one, `channel_force` follows from it, and the isolator at a given condition has the law
        among its plain coefficients.

        Returns:
            Both, or None.
        """
        return None

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
