"""Times of day written as text, "12:03:04.5" or "2026-03-05 12:03:04.5", as seconds since the first."""

import datetime
import re
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

_CLOCK = re.compile(r"(?:(\d{4}-\d\d-\d\d)[T ]+)?(\d{1,2}):([0-5]\d):([0-5]\d(?:[.,]\d*)?)Z?")
_DAY = 86400.0


def read_clock(text: str) -> tuple[int, float] | None:
    """Gives the day and the seconds since its midnight, or None for another text; without a date day 0."""
    match = _CLOCK.fullmatch(text.strip())
    if match is None:
        return None
    try:
        day = 0 if match[1] is None else datetime.date.fromisoformat(match[1]).toordinal()
    except ValueError:
        return None
    return day, 3600.0 * int(match[2]) + 60.0 * int(match[3]) + float(match[4].replace(",", "."))


def seconds_since_first(clocks: Sequence[tuple[int, float] | None]) -> Float[np.ndarray, " time"]:
    """Gives seconds since the first time; NaN where there is none.

    Args:
        clocks: Days and seconds, as `read_clock` gives them. A clock without a date that jumps back by more
            than half a day has passed midnight.
    """
    origin = next(one for one in clocks if one is not None)
    passed, before, seconds = 0, origin[1], []
    for one in clocks:
        if one is None:
            seconds.append(np.nan)
            continue
        passed += one[0] == 0 and one[1] < before - 0.5 * _DAY
        before = one[1]
        seconds.append((one[0] - origin[0] + passed) * _DAY + (one[1] - origin[1]))
    return np.array(seconds)
