"""The rate of a time column, the gaps and clock steps in it, and how far its times scatter."""

from pathlib import Path

import numpy as np
import scipy
from jaxtyping import Float

from .._physical_limits import TIME
from .._wording import row
from ._last_digit import last_digit

_GAP = 1.5
"""A time step above this multiple of the usual one, and four times its jitter more, is a gap."""

_JITTER = 4.0
"""Jitters of the time steps by which a rounded time column may deviate from a uniform one."""

_ROUNDED = 1.5
"""Rounding errors, by rms, that times may depart from an even grid by rounding alone."""

_SIDE = 128
"""Samples on either side of a place whose median times show whether the clock steps there."""

_LEAST_STEP, _SURE = 0.1, 6.0
"""A clock step counts above this share of a sampling step, and above so many of its standard errors."""

_SUDDEN = 0.6
"""Share of a clock step that a quarter of the samples on either side shows; of a change of rate a quarter."""

_MISSING = 0.25
"""Distance from a whole number of sampling steps up to which a clock step is samples that are missing."""

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
    step, drift = _even_grid(time)
    _refuse_clock_step(file, drift, step, _ROUNDED * float(np.max(last_digit(time))), column, first)
    at = int(np.argmax(np.abs(drift)))
    if abs(drift[at]) > step + _JITTER * jitter:
        raise ValueError(
            f"{file}: time column `{column}` is not uniform: at {row(first + at)} it is {drift[at]:.3g} s "
            f"off the even grid of {step:.6g} s; resample the record"
        )
    rate = 1.0 / step
    return float(round(rate)) if abs(rate / max(round(rate), 1) - 1.0) < _WHOLE_RATE else rate


def time_jitter(time: Float[np.ndarray, " time"]) -> float:
    """Gives the rms by which times scatter about an even grid, beyond the rounding of their digits [s].

    A clock that slowly runs fast or slow does not count: samples beside each other are then even.
    """
    rounding = float(np.sqrt(np.mean(last_digit(time) ** 2) / 12.0))
    about = _even_grid(time)[1]
    if float(np.sqrt(np.mean(about**2))) <= _ROUNDED * rounding:
        return 0.0
    scatter = float(np.sqrt(np.mean((about - _median_path(about)) ** 2)))
    return (
        scatter if scatter > _ROUNDED * rounding + np.finfo(float).eps * float(np.max(np.abs(time))) else 0.0
    )


def _even_grid(time: Float[np.ndarray, " time"]) -> tuple[float, Float[np.ndarray, " time"]]:
    """Gives the step of the even grid that fits times best, and the times about it [s]."""
    place = np.arange(time.size) - 0.5 * (time.size - 1)
    about = time - np.mean(time)
    step = float(place @ about) / float(place @ place)
    return step, about - place * step


def _median_path(about: Float[np.ndarray, " time"]) -> Float[np.ndarray, " time"]:
    """Gives the running median: what a clock does beside its scatter."""
    side = min(_SIDE, about.size // 4)
    return scipy.ndimage.median_filter(about, size=2 * side + 1, mode="nearest")


def _refuse_clock_step(
    file: Path, about: Float[np.ndarray, " time"], step: float, rounding: float, column: str, first: int
) -> None:
    """Refuses times that from some sample on all lie later or earlier than the even grid before it."""
    side = min(_SIDE, about.size // 4)
    if float(np.max(np.abs(about))) < 0.5 * _LEAST_STEP * step:
        return
    path = _median_path(about)
    jump = np.zeros_like(about)
    jump[side + 1 : -side] = path[2 * side + 1 :] - path[: -2 * side - 1]
    jump[side + 1 : -side] -= np.median(jump[side + 1 : -side])
    at = int(np.argmax(np.abs(jump)))
    # A median of n samples has the standard error 1.25 sigma / sqrt(n), a difference of two sqrt(2) of it.
    error = 1.25 * float(np.std(about - path)) * np.sqrt(2.0 / (2 * side + 1))
    if abs(jump[at]) < max(_LEAST_STEP * step, _SURE * error, rounding):
        return
    near = max(side // 4, 1)
    beside = float(np.median(about[at : at + near]) - np.median(about[at - near : at]))
    if beside / jump[at] < _SUDDEN:
        return  # the clock changes its rate
    lost = round(jump[at] / step)
    missing = lost > 0 and abs(jump[at] / step - lost) < _MISSING
    what = f"{lost} {'sample is' if lost == 1 else 'samples are'} missing" if missing else "the clock steps"
    raise ValueError(
        f"{file}: time column `{column}` is not uniform: {what} about {row(first + at)}, from where all "
        f"times are {jump[at]:+.3g} s off the even grid of {step:.6g} s before it; cut the record there with "
        "start and stop"
    )
