"""The contract of what acts on the instruments: the drive channel and the response channel."""

from typing import ClassVar

from .._types import Internal, Lanes
from ._effect import AbstractEffect


class AbstractInstrument(AbstractEffect):
    """What stands between the motion and what was recorded; instruments act in the order of the isolator.

    Attributes:
        starts_at_mean: whether its strength, a zero error of the sensor, starts at the mean reading.
    """

    starts_at_mean: ClassVar[bool] = False

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

    def reading_rate(self, y: Lanes, s: Internal) -> Internal:
        """Give what the motion at the sensor adds to the rates of the internal states (a dynamic sensor).

        Args:
            y: motion at the sensor [its SI unit].
            s: internal states.

        Returns:
            One rate an internal state.
        """
        return tuple(0.0 * state for state in s)
