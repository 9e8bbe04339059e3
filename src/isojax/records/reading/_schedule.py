"""The schedule of a stepped sine: CSV with start_s, frequency_hz, cycles, turned into dwells."""

from pathlib import Path

import numpy as np
from jaxtyping import Float

from .._physical_limits import RATE, TIME
from .._record import Dwell
from .._wording import listing, nearest, row
from ..formats import door, file_size, read_table, split_heading

SCHEDULE_HEADINGS = ("start_s", "frequency_hz", "cycles")

_SHORTEST_DWELL = 2.0
"""A dwell that the record cuts shorter is left out."""


def read_schedule(file: Path) -> Float[np.ndarray, "segment 3"]:
    """Gives the rows start [s], frequency [Hz], cycles of a schedule.

    Raises:
        ValueError: If the file or a heading is missing, a value is no number or not possible, or starts do
            not increase; names the row.
    """
    with door(file, "a schedule"):
        if file_size(file) is None:
            raise ValueError(f"{file} does not exist; it is the schedule of a record")
        table = read_table(file)
        present = [split_heading(heading)[0] for heading in table.headings]
        for heading in SCHEDULE_HEADINGS:
            if heading not in present:
                raise ValueError(
                    f"{file}: a schedule needs the headings {listing(SCHEDULE_HEADINGS)}, but `{heading}` "
                    f"is not among {listing(present)}{nearest(heading, present)}"
                )
        columns = [table.numbers(present.index(heading)) for heading in SCHEDULE_HEADINGS]
        rows = np.stack(columns, axis=1).astype(np.float64)
    for i, (start, frequency, cycles) in enumerate(rows):
        if not TIME.hold(start):
            raise ValueError(f"{file}: start_s = {start:.9g} at {row(i)} must be a number, at least 0")
        for heading, value, limits in (("frequency_hz", frequency, RATE), ("cycles", cycles, TIME)):
            if not (limits.hold(value) and value > 0):
                raise ValueError(
                    f"{file}: {heading} = {value:.9g} at {row(i)} must be a number above 0, {limits.words}"
                )
        if i and start <= rows[i - 1, 0]:
            raise ValueError(
                f"{file}: start_s must increase strictly, but {start:.9g} at {row(i)} follows "
                f"{rows[i - 1, 0]:.9g}"
            )
        previous_end = rows[i - 1, 0] + rows[i - 1, 2] / rows[i - 1, 1] if i else start
        if previous_end - start > 1.0 / rows[i - 1, 1]:
            raise ValueError(
                f"{file}: the dwell at {row(i - 1)} lasts until {previous_end:.6g} s, but the next starts at "
                f"{start:.6g} s"
            )
    return rows


def scheduled_dwells(
    file: Path, rows: Float[np.ndarray, "segment 3"], rate: float, start: int, stop: int, total: int
) -> tuple[Dwell, ...]:
    """Gives the dwells that lie in samples [start, stop) of a file of `total` samples.

    A dwell that the file or the record cuts off is shortened. One of which less than two cycles remain is
    left out.

    Args:
        file: The schedule, for the error.
        rows: As read by `read_schedule`; its starts count from the first sample of the file.
        rate: Samples per second [Hz].
        start: First sample of the record.
        stop: One past its last sample.
        total: Number of samples of the file.

    Returns:
        Dwells, counted from the start of the record.

    Raises:
        ValueError: If the schedule runs more than a cycle past the end of the file, a frequency is not below
            half the rate, or no dwell is left.
    """
    ends = rows[:, 0] + rows[:, 2] / rows[:, 1]
    for i, (first, frequency, _) in enumerate(rows):
        if frequency >= 0.5 * rate:
            raise ValueError(
                f"{file}: frequency_hz = {frequency:.6g} at {row(i)} must be below half the sampling rate, "
                f"{0.5 * rate:.6g} Hz"
            )
        if first * rate >= total or ends[i] * rate > total + rate / frequency:
            raise ValueError(
                f"{file}: the dwell at {row(i)} runs from {first:.6g} s to {ends[i]:.6g} s, past the end "
                f"of the record at {total / rate:.6g} s"
            )
    following = np.append(rows[1:, 0], np.inf)
    dwells = []
    for opening, end, (_, frequency, _) in zip(rows[:, 0], np.minimum(ends, following), rows, strict=True):
        first, last = max(round(opening * rate), start), min(round(end * rate), stop)
        cycles = (last - first) * frequency / rate
        if cycles >= _SHORTEST_DWELL:
            dwells.append(Dwell(first - start, last - start, float(frequency), float(cycles)))
    if not dwells:
        raise ValueError(
            f"{file}: no dwell of two cycles or more lies in the record's samples {start}:{stop}"
        )
    return tuple(dwells)
