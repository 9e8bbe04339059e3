"""What an undeclared excitation is: free decay, stepped sine, sweep, or anything else (broadband)."""

import numpy as np
from jaxtyping import Float

from ._record import Dwell, Kind
from ._segment import rising_crossings, segment_dwells


def detect_kind(
    drive: Float[np.ndarray, " time"],
    response: Float[np.ndarray, " time"],
    rate: float,
    inertia: float | None = None,
) -> tuple[tuple[Dwell, ...], Kind]:
    """Gives the dwells (of a stepped sine) and the kind of a record without period or schedule.

    Args:
        drive: Input, (time,).
        response: Output, (time,).
        rate: Samples per second [Hz].
        inertia: Input per unit of output that inertia alone would take (the mass, where the output is an
            acceleration), or None; it tells a small input from none.

    Returns:
        Dwells and kind.
    """
    if _is_free_decay(drive, response, inertia):
        return (), "free_decay"
    crossings = rising_crossings(drive, rate)
    if crossings.size < 6:
        return (), "broadband"
    periods = np.diff(crossings)
    if float(np.median(np.abs(np.diff(periods)))) > 0.1 * float(np.median(periods)):
        return (), "broadband"
    dwells = segment_dwells(drive, rate)
    covered = sum(dwell.stop - dwell.start for dwell in dwells)
    if len(dwells) > 1 and _glides(crossings, dwells, rate):
        return (), "swept"
    if covered < 0.5 * drive.size:
        return (), "swept" if _is_monotone(periods) else "broadband"
    return dwells, "stepped_sine"


def _glides(crossings: Float[np.ndarray, " crossing"], dwells: tuple[Dwell, ...], rate: float) -> bool:
    """Whether the period changes as much within the found dwells as between them."""
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
    return float(np.median(within)) > 0.5 * float(np.median(np.abs(np.diff(centres))))


def _is_monotone(periods: Float[np.ndarray, " cycle"]) -> bool:
    smooth = np.convolve(periods, np.full(5, 0.2), mode="valid") if periods.size >= 10 else periods
    steps = np.diff(smooth)
    return abs(int(np.sum(np.sign(steps)))) > 0.7 * steps.size


def _is_free_decay(
    drive: Float[np.ndarray, " time"], response: Float[np.ndarray, " time"], inertia: float | None
) -> bool:
    parts = np.array_split(response - np.mean(response[-max(response.size // 10, 1) :]), 10)
    size = np.array([np.sqrt(np.mean(part**2)) for part in parts])
    if not size[-1] < 0.3 * np.max(size[:3]):
        return False
    centred = drive - np.median(drive)
    peak = float(np.max(np.abs(centred)))
    if peak == 0.0:
        return True
    brief = np.count_nonzero(np.abs(centred) > 0.05 * peak) < 0.05 * drive.size
    first = float(np.sqrt(np.mean(parts[0] ** 2)))
    small = inertia is not None and float(np.sqrt(np.mean(drive**2))) < 0.02 * inertia * first
    return bool(brief or small)
