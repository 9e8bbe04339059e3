"""The rate of a time column, and the gaps in it."""

from pathlib import Path

import numpy as np
from jaxtyping import Float

from .._physical_limits import TIME
from .._wording import row

_GAP = 1.5
"""A time step above this multiple of the usual one, and four times its jitter more, is a gap."""

_JITTER = 4.0
"""Jitters of the time steps by which a rounded time column may deviate from a uniform one."""

_WHOLE_RATE = 1e-6
"""Relative distance from a whole number of samples per second below which a rate is rounded to it."""


def uniform_rate(file: Path, time: Float[np.ndarray, " time"], column: str, first: int) -> float:
    """Gives the rate of a time column that must be uniform but may be rounded [Hz].

    Raises:
        ValueError: If a time is not finite, repeats, runs backwards, or leaves a gap; names the row.
    """
    wrong = np.flatnonzero(~(np.abs(time) <= TIME.most))
    if wrong.size:
        at = int(wrong[0])
        raise ValueError(
            f"{file}: time column `{column}` is {time[at]} at {row(first + at)}; it must be finite, and at "
            f"most {TIME.most:g} s"
        )
    steps = np.diff(time)
    wrong = np.flatnonzero(steps <= 0)
    if wrong.size:
        at = int(wrong[0]) + 1
        how = "repeats" if time[at] == time[at - 1] else "runs backwards"
        raise ValueError(
            f"{file}: time column `{column}` {how} at {row(first + at)}: {time[at]:.9g} s follows "
            f"{time[at - 1]:.9g} s; it must increase strictly"
        )
    usual = float(np.median(steps))
    jitter = float(np.median(np.abs(steps - usual)))
    limit = usual * _GAP + _JITTER * jitter
    at = int(np.argmax(steps)) + 1
    if steps[at - 1] > limit:
        raise ValueError(
            f"{file}: time column `{column}` has a gap at {row(first + at)}: {time[at]:.9g} s follows "
            f"{time[at - 1]:.9g} s, but the usual step is {usual:.6g} s; samples are missing"
        )
    step = float((time[-1] - time[0]) / (time.size - 1))
    drift = time - time[0] - step * np.arange(time.size)
    at = int(np.argmax(np.abs(drift)))
    if abs(drift[at]) > step + _JITTER * jitter:
        raise ValueError(
            f"{file}: time column `{column}` is not uniform: at {row(first + at)} it is {drift[at]:.3g} s "
            f"off the even grid of {step:.6g} s; resample the record"
        )
    rate = 1.0 / step
    return float(round(rate)) if abs(rate / max(round(rate), 1) - 1.0) < _WHOLE_RATE else rate
