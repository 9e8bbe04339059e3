"""The sampling rate: declared, from a time column or stated by the file; all that are given must agree."""

from pathlib import Path

import numpy as np
from jaxtyping import Float

from .._physical_limits import RATE
from ..formats import uniform_rate

RATE_TOLERANCE = 1e-3
"""Relative difference of equal rates: a written time column is rounded, and a wrong rate differs by more."""


def find_rate(
    file: Path,
    declared: float | None,
    stated: float | None,
    time: Float[np.ndarray, " time"] | None,
    column: str | None,
    first: int,
) -> float:
    """Gives the sampling rate of a record [Hz].

    Args:
        file: For the error.
        declared: [sampling] rate [Hz], or None.
        stated: Rate that the data file itself states [Hz], or None.
        time: The record's time column [s], or None.
        column: Its name.
        first: Row of the record's first sample in the file, for the error.

    Returns:
        The declared rate if there is one, else that of the time column, else the stated one.

    Raises:
        ValueError: If there is none, if they contradict each other, or if the time column has a gap, runs
            backwards or repeats a time.
    """
    measured = None if time is None else uniform_rate(file, time, str(column), first)
    candidates = [
        ("[sampling] rate", declared),
        (f"time column `{column}`", measured),
        ("the file's own time base", stated),
    ]
    known = [(name, rate) for name, rate in candidates if rate is not None]
    if not known:
        raise ValueError(
            f'{file}: the sampling rate is not known; give [sampling] rate = ... or time = "column"'
        )
    first_name, chosen = known[0]
    if not RATE.hold(chosen):
        raise ValueError(f"{file}: {first_name} says {chosen:.9g} Hz; expected a rate {RATE.words} Hz")
    for name, rate in known[1:]:
        if abs(rate / chosen - 1.0) > RATE_TOLERANCE:
            raise ValueError(
                f"{file}: {first_name} says {chosen:.9g} Hz, but {name} says {rate:.9g} Hz; they must agree"
            )
    return chosen
