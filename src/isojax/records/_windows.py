"""Records cut into windows, each with a start of its own."""

import dataclasses

import numpy as np

from ._blow import held_samples
from ._campaign import Campaign
from ._record import Record

_LONGEST_HEAD = 1.0
"""Longest time before a window whose samples set its initial state, as the first second of a free run does
[s]."""

_SHORTEST_HEAD = 8
"""And its fewest samples."""


def cut_into_windows(campaign: Campaign, seconds: float) -> Campaign:
    """Give a campaign whose fitted records are cut into windows that a model has to predict.

    The time before a window, as long as the window but a second at most, sets its initial state, as `settle`
    samples do; the error counts from there on. A mass without a spring remembers every error of its force for
    ever, so that the error of its free run measures the drift of an integrator. Fitted to windows it predicts
    over their length.

    Args:
        campaign: the measurements.
        seconds: length of a window [s].

    Returns:
        The campaign. Records too short for a window are left out; held-out records stay whole.

    Raises:
        ValueError: if a window would be shorter than two samples, or longer than every fitted record.

    Source: Ljung 1999, System Identification, sec. 3.2 (k-step-ahead prediction).

    Example:
        The record that starts the demo, in windows of five seconds:

        >>> from isojax.records import cut_into_windows
        >>> windows = cut_into_windows(campaign, 5.0)
        >>> windows.records[0].output.size == 6 * campaign.rate
        True
    """
    records = [
        window
        for record in campaign.records
        for window in (windows_of(record, seconds) if record.role == "fit" else [record])
    ]
    if not any(record.role == "fit" for record in records):
        longest = max((record.output.size for record in campaign.fit_records), default=0) / campaign.rate
        raise ValueError(
            "Argument `seconds` must leave room for a window and its head in a fitted record, but is "
            f"{seconds}; the longest has {longest:g} s."
        )
    return dataclasses.replace(campaign, records=tuple(records))


def check_window(seconds: float, rate: float) -> None:
    """Refuse a window that holds no motion.

    Args:
        seconds: its length [s].
        rate: samples per second [Hz].

    Raises:
        ValueError: if it is shorter than two samples.
    """
    if not seconds * rate >= 2.0:
        raise ValueError(
            f"Argument `seconds` must span two samples and more, {2.0 / rate:g} s, but is {seconds}."
        )


def windows_of(record: Record, seconds: float, most: int | None = None) -> list[Record]:
    """Give the windows of one record.

    Args:
        record: the record.
        seconds: length of a window [s].
        most: how many, evenly spread over the record; all that fit into it without overlap if omitted.

    Returns:
        The windows, each with its head as `settle` samples; none where the record is too short.

    Raises:
        ValueError: if a window would be shorter than two samples.
    """
    check_window(seconds, record.rate)
    length = round(seconds * record.rate)
    head = max(_SHORTEST_HEAD, round(min(_LONGEST_HEAD, seconds) * record.rate))
    first = max(0, record.settle - head)
    starts = np.arange(first, record.output.size - head - length + 1, length)
    if most is not None and starts.size > most:
        starts = starts[np.linspace(0, starts.size - 1, most).astype(int)]
    return [_window(record, start, start + head + length, head) for start in starts.tolist()]


def from_release(record: Record) -> Record:
    """Gives a free decay from the release on: before it the mass was held still, and no model of it moves so.

    Args:
        record: The record.

    Returns:
        The record, without the samples before the release; itself where it begins in motion.
    """
    held = held_samples(record.output, record.rate) if record.kind == "free_decay" else 0
    if not held:
        return record
    free = _window(record, held, record.output.size, max(0, record.settle - held))
    return dataclasses.replace(free, name=record.name, kind=record.kind, clock=record.clock, held=held)


def _window(record: Record, start: int, stop: int, settle: int) -> Record:
    own = slice(start, stop)
    span = record.clock[1] - record.clock[0]
    clock = tuple(record.clock[0] + span * place / record.output.size for place in (start, stop))
    return dataclasses.replace(
        record,
        name=f"{record.name}[{start}:{stop}]",
        time=record.time[own] - record.time[start],
        input=record.input[own],
        output=record.output[own],
        raw_input=record.raw_input[own],
        raw_output=record.raw_output[own],
        floor=None if record.floor is None else record.floor[own],
        settle=settle,
        period=None,
        dwells=(),
        kind="broadband",
        clock=(clock[0], clock[1]),
        start=record.start + start,
    )
