"""What an undeclared excitation is: free decay, blow, stepped sine, sweep, or anything else (broadband)."""

import numpy as np
from jaxtyping import Float

from .._blow import ABOVE_NOISE, BRIEF, driven_samples, rest_position, resting_noise
from .._record import Dwell, ExcitationKind
from ..spectrum import power_spectrum, ringing_frequency
from ._find_dwells import rising_crossings, segment_dwells

_TENTHS = 10
"""Sections of a record whose rms values are compared."""

_EARLY_TENTHS = 3
"""A free motion is largest in one of so many first sections."""

_DIED_OUT = 0.7
"""A motion whose last section is above this share of its largest one has not died out."""

_CLEAR_BLOW = 2.0
"""The peak of a blow is so many times the level above which a sample is no noise."""

_NO_DRIVE = 0.1
"""A drive below this share of the inertia, within the band of the motion, did not cause the motion ..."""

_FEATURELESS = 4.0
"""... if its power there is not above so many times that of its other frequencies either."""

_FEWEST_CROSSINGS = 6
"""Rising zero crossings without which a drive is no sine."""

_PERIODIC = 0.1
"""A drive whose period usually changes by more of itself, from cycle to cycle, is no sine."""

_STEPPED = 0.5
"""Share of a record that dwells must cover, else it is no stepped sine."""

_GLIDING = 0.5
"""A sine whose period changes within dwells by more than this share of the steps between them is swept."""

_ONE_WAY = 0.7
"""Share of the cycles, those of one way less those of the other, over which the period of a sweep changes."""


def detect_kind(
    drive: Float[np.ndarray, " time"],
    response: Float[np.ndarray, " time"],
    rate: float,
    inertia: float | None = None,
) -> tuple[tuple[Dwell, ...], ExcitationKind]:
    """Gives the dwells (of a stepped sine) and the kind of a record without period or schedule.

    Args:
        drive: Input, (time,).
        response: Output, (time,).
        rate: Samples per second [Hz].
        inertia: Input per unit of output that inertia alone would take (the mass, where the output is an
            acceleration), or None where it is unknown; it distinguishes a small input from none.

    Returns:
        Dwells and kind.
    """
    if _dies_out(response):
        if _is_brief(drive):
            return (), "impulse"
        if _is_idle(drive, response, rate, inertia):
            return (), "free_decay"
    crossings = rising_crossings(drive, rate)
    if crossings.size < _FEWEST_CROSSINGS:
        return (), "broadband"
    periods = np.diff(crossings)
    if float(np.median(np.abs(np.diff(periods)))) > _PERIODIC * float(np.median(periods)):
        return (), "broadband"
    dwells = segment_dwells(drive, rate)
    covered = sum(dwell.stop - dwell.start for dwell in dwells)
    if len(dwells) > 1 and _glides(crossings, dwells, rate):
        return (), "swept"
    if covered < _STEPPED * drive.size:
        return (), "swept" if _is_monotone(periods) else "broadband"
    return dwells, "stepped_sine"


def _glides(crossings: Float[np.ndarray, " crossing"], dwells: tuple[Dwell, ...], rate: float) -> bool:
    """Whether the period changes as much within the detected dwells as between them."""
    periods, middle = np.diff(crossings), 0.5 * (crossings[1:] + crossings[:-1])
    within, centres = [], []
    for dwell in dwells:
        inside = (middle >= dwell.start / rate) & (middle < dwell.stop / rate)
        if np.count_nonzero(inside) >= 3:
            slope = np.polyfit(middle[inside], periods[inside], 1)[0]
            within.append(abs(slope) * (dwell.stop - dwell.start) / rate)
            centres.append(float(np.mean(periods[inside])))
    if len(within) < 2:
        return False
    return float(np.median(within)) > _GLIDING * float(np.median(np.abs(np.diff(centres))))


def _is_monotone(periods: Float[np.ndarray, " cycle"]) -> bool:
    smooth = np.convolve(periods, np.full(5, 0.2), mode="valid") if periods.size >= 10 else periods
    steps = np.diff(smooth)
    return abs(int(np.sum(np.sign(steps)))) > _ONE_WAY * steps.size


def _dies_out(response: Float[np.ndarray, " time"]) -> bool:
    """Whether the motion is largest near its start and has decayed by its end."""
    sections = np.array_split(response - rest_position(response), _TENTHS)
    size = np.array([np.sqrt(np.mean(section**2)) for section in sections])
    return bool(np.argmax(size) < _EARLY_TENTHS and size[-1] < _DIED_OUT * np.max(size))


def _is_brief(drive: Float[np.ndarray, " time"]) -> bool:
    """Whether the drive exceeds its noise in a small share of the record only."""
    peak = float(np.max(np.abs(drive - np.median(drive))))
    share = np.count_nonzero(driven_samples(drive)) / drive.size
    return bool(peak > _CLEAR_BLOW * ABOVE_NOISE * resting_noise(drive) and share < BRIEF)


def _is_idle(
    drive: Float[np.ndarray, " time"],
    response: Float[np.ndarray, " time"],
    rate: float,
    inertia: float | None,
) -> bool:
    """Whether the drive did not cause the motion: it is zero, or noise far below the inertia."""
    if np.ptp(drive) == 0.0:
        return True
    frequency, motion = power_spectrum(response, rate)
    noise = power_spectrum(drive, rate)[1]
    ringing = ringing_frequency(response, rate)
    band = (frequency >= 0.5 * ringing) & (frequency <= 2.0 * ringing)
    if np.mean(noise[band]) > _FEATURELESS * np.median(noise[1:]):
        return False
    if inertia is None:
        return True
    return bool(np.sum(noise[band]) < _NO_DRIVE**2 * inertia**2 * np.sum(motion[band]))
