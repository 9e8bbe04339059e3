"""The samples at which a brief drive acts, and the free motion after a release or a blow."""

import numpy as np
import scipy
from jaxtyping import Bool, Float

from ._record import Record

ABOVE_NOISE = 5.0
"""Standard deviations of the noise above which a sample is no noise."""

BRIEF = 0.05
"""Largest share of a record that a blow takes, and share of its peak below which the drive is off."""

_LAST_TENTH = 10
"""The mean of the last tenth of a record is taken for the position at rest."""

_RELEASED = 0.5
"""Share of its largest amplitude below which a motion has surely been released."""

_STRETCH = 32
"""Samples over which the noise of a reading shows."""

_FIRST = 8
"""Samples whose median is the level at which a mass is held."""

_MOVED = 1e-3
"""Share of its range by which a reading must leave that level, however quiet it is."""

_FEWEST_FREE_SAMPLES = 256
"""Samples without which no floor can be estimated from a spectrum."""


def driven_samples(drive: Float[np.ndarray, " time"]) -> Bool[np.ndarray, " time"]:
    """Gives the samples at which a mostly resting drive exceeds its noise and 5 % of its peak.

    Args:
        drive: Input, (time,).

    Returns:
        Whether it is on, (time,).
    """
    size = np.abs(drive - np.median(drive))
    return size > max(BRIEF * float(np.max(size)), ABOVE_NOISE * resting_noise(drive))


def resting_noise(drive: Float[np.ndarray, " time"]) -> float:
    """Gives the standard deviation of the noise of a drive that rests most of the time."""
    return 1.4826 * float(np.median(np.abs(drive - np.median(drive))))


def blow_samples(drive: Float[np.ndarray, " time"]) -> int:
    """Gives the number of samples that the largest blow of a record lasts.

    Args:
        drive: Input, (time,).

    Returns:
        Samples in a row that exceed the noise and 5 % of the peak.
    """
    on = driven_samples(drive)
    peak = int(np.argmax(np.abs(drive - np.median(drive))))
    before, after = on[: peak + 1][::-1], on[peak:]
    run = [int(np.argmin(side)) if not np.all(side) else side.size for side in (before, after)]
    return max(run[0] + run[1] - 1, 0)


def rest_position(signal: Float[np.ndarray, " time"]) -> float:
    """Gives the value at which a motion ends: the mean over the last tenth of a record."""
    return float(np.mean(signal[-max(signal.size // _LAST_TENTH, 1) :]))


def held_samples(output: Float[np.ndarray, " time"], rate: float) -> int:
    """Gives the samples for which a mass is held still before it is released.

    The reading leaves its first level by more than its noise: that of the quietest stretch of the record,
    held or decayed.

    Args:
        output: Of a free decay, (time,).
        rate: Samples per second [Hz].

    Returns:
        The first sample in motion; 0 where that comes within a quarter of a cycle, as if it began there.
    """
    stretches = np.array_split(output, max(1, output.size // _STRETCH))
    noise = min(float(np.std(scipy.signal.detrend(one))) for one in stretches)
    least = max(2.0 * ABOVE_NOISE * noise, _MOVED * float(np.ptp(output)))
    away = np.abs(output - np.median(output[:_FIRST])) > least
    away[:-1] &= away[1:]  # one sample alone is a spike
    first = int(np.argmax(away))
    frequency, power = scipy.signal.periodogram(output[first:], rate, detrend="constant")
    quarter = 0.25 * rate / max(float(frequency[np.argmax(power)]), rate / output.size)
    return first if first > quarter else 0


def ring_down(record: Record) -> Float[np.ndarray, " time"]:
    """Gives the output after the release or the last blow; all of it where too few samples follow, or where
    the record does not ring down.

    The spectra of a blow and of a release reach far above the band of the motion, where they look like noise.

    Args:
        record: The record.

    Returns:
        Output samples, the last of the record.
    """
    if not record.rings_down:
        return record.output
    size = np.abs(record.output - rest_position(record.output))
    start = _end_of(size > _RELEASED * np.max(size))
    if record.kind == "impulse":
        # A filter before the converter lengthens a blow by less than the blow's own length.
        on = np.flatnonzero(driven_samples(record.input))
        start = max(start, int(on[-1]) + 1 + blow_samples(record.input)) if on.size else start
    return record.output[start:] if record.output.size - start >= _FEWEST_FREE_SAMPLES else record.output


def _end_of(on: Bool[np.ndarray, " time"]) -> int:
    """Gives the index after the last true sample."""
    return int(np.flatnonzero(on)[-1]) + 1 if np.any(on) else 0
