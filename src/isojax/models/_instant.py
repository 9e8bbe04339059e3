"""What acts on the isolator at an instant."""

from typing import Any, NamedTuple

import jax

from .._types import Lanes
from ..elements import Channels

NO_CHANNELS: Channels = {}
"""No record, no signals of a record: the effects that follow them are absent."""


class Instant(NamedTuple):
    """What acts at an instant, or at as many as the leading shape holds.

    Attributes:
        drive: recorded drive, already shifted [N, or m/s^2 for base excitation].
        drive_rate: its time derivative.
        channels: signals of the record beside drive and response, by name; none where there is no record.
    """

    drive: Lanes
    drive_rate: Lanes | float = 0.0
    channels: Channels = NO_CHANNELS

    def delayed(self, delay: Lanes | float) -> "Instant":
        """Give the instant with a drive that comes later, to first order in the delay.

        Args:
            delay: [s].

        Returns:
            The instant.
        """
        return self._replace(drive=self.drive - delay * self.drive_rate)

    def pick(self, place: Any) -> "Instant":
        """Give what acts at some of the instants.

        Args:
            place: index into the leading axes of every signal.

        Returns:
            Those instants.
        """
        return jax.tree_util.tree_map(lambda values: values[place], self)


def split_stages(table: Instant) -> tuple[Instant, ...]:
    """Split what acts during a sample into the stages of its steps.

    Args:
        table: each signal with the stages first.

    Returns:
        One instant a stage.
    """
    return tuple(table.pick(stage) for stage in range(table.drive.shape[0]))
