"""When a drive that is brief is on, and the stretch of a record in which nothing but its noise drives it."""

import numpy as np
from jaxtyping import Bool, Float

from ._record import Record

ABOVE_NOISE = 5.0
"""What exceeds so many standard deviations of the noise is no noise."""

BRIEF = 0.05
"""Share of a record that a blow takes at most, and share of its peak below which the drive is off."""

_PARTS = 10
"""The mean of the last of so many parts is where the motion comes to rest."""

_FALLEN = 0.5
"""Share of its largest size below which a motion has surely been let go."""

_SHORTEST = 256
"""Samples without which no floor can be read off a spectrum."""


def driven_samples(drive: Float[np.ndarray, " time"]) -> Bool[np.ndarray, " time"]:
    """Gives the samples at which a drive that rests most of the time stands above its noise and 5 % of its
    peak.

    Args:
        drive: Input, (time,).

    Returns:
        Whether it is on, (time,).
    """
    size = np.abs(drive - np.median(drive))
    return size > max(BRIEF * float(np.max(size)), ABOVE_NOISE * drive_noise(drive))


def drive_noise(drive: Float[np.ndarray, " time"]) -> float:
    """Gives the standard deviation of the noise of a drive that rests most of the time."""
    return 1.4826 * float(np.median(np.abs(drive - np.median(drive))))


def blow_samples(drive: Float[np.ndarray, " time"]) -> int:
    """Gives the number of samples that the largest blow of a record lasts.

    Args:
        drive: Input, (time,).

    Returns:
        Samples in a row that stand above the noise and 5 % of the peak.
    """
    on = driven_samples(drive)
    peak = int(np.argmax(np.abs(drive - np.median(drive))))
    before, after = on[: peak + 1][::-1], on[peak:]
    run = [int(np.argmin(side)) if not np.all(side) else side.size for side in (before, after)]
    return max(run[0] + run[1] - 1, 0)


def ring_down(record: Record) -> Float[np.ndarray, " time"]:
    """Gives the output after the release or the last blow; the whole of it where little would be left, or
    where the record does not ring down.

    A blow, and the jump of a release, reach far above the band of the motion: there they pass for noise.

    Args:
        record: The record.

    Returns:
        Output samples, the last of the record.
    """
    if not record.rings_down:
        return record.output
    size = np.abs(record.output - np.mean(record.output[-max(record.output.size // _PARTS, 1) :]))
    begin = _end_of(size > _FALLEN * np.max(size))
    if record.kind == "impulse":
        # a filter before the converter draws a blow out by less than its own length
        on = np.flatnonzero(driven_samples(record.input))
        begin = max(begin, int(on[-1]) + 1 + blow_samples(record.input)) if on.size else begin
    return record.output[begin:] if record.output.size - begin >= _SHORTEST else record.output


def _end_of(on: Bool[np.ndarray, " time"]) -> int:
    """Gives the place after the last true sample."""
    return int(np.flatnonzero(on)[-1]) + 1 if np.any(on) else 0
