"""One data file: its channels, its rate, and how it was excited."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from ..._show import shown
from .._record import Direction, Dwell, ExcitationKind
from ..formats import Column, channel_unit, split_heading, time_jitter, uniform_rate
from ..reading import RATE_TOLERANCE, detect_kind, find_reader, given_columns
from ..spectrum import ringing_frequency
from ._channel import ChannelInspection, inspect_channel
from ._guess import drive_and_response, guess_quantity, is_time
from ._period import find_period

_FEWEST_ROWS = 16
"""Values without which a column is no channel."""

_PARTS = 8
"""Parts of a sweep whose frequencies are compared."""


@shown
@dataclass(frozen=True, eq=False)
class FileInspection:
    """What is in a data file.

    Attributes:
        file: The file.
        channels: Its channels, without the time, all of one length.
        rate: Samples per second [Hz], or None where neither the file nor the caller states it.
        rate_from: Where the rate comes from, in words.
        time: Name of the time column, or None.
        time_unit: Unit of the time column that the file states, or None.
        time_fault: What is wrong with the time column, such as a gap and its row, or "".
        time_jitter: rms by which its times scatter about an even grid, beyond their rounding [s].
        drive: Name of the channel that seems to drive, or None where there is only one channel.
        response: Name of the channel that seems to respond, or None.
        kind: What the excitation is, or None where it cannot be seen.
        dwells: Dwells of a stepped sine, else empty; frequencies are in cycles per sample without a rate.
        period: Samples in a period of a periodic excitation, or None.
        direction: Of a stepped or swept sine.
        left_out: Columns that are no channels, as they are shorter than the others.
    """

    file: Path
    channels: tuple[ChannelInspection, ...]
    rate: float | None
    rate_from: str
    time: str | None
    time_unit: str | None
    time_fault: str
    drive: str | None
    response: str | None
    kind: ExcitationKind | None
    dwells: tuple[Dwell, ...]
    period: int | None
    direction: Direction
    left_out: tuple[str, ...]
    time_jitter: float = 0.0

    def channel(self, name: str | None) -> ChannelInspection | None:
        """Gives the channel of a name, or None."""
        return next((one for one in self.channels if one.name == name), None)

    @property
    def size(self) -> int:
        """Samples of each channel."""
        return self.channels[0].samples.size


def inspect_file(file: str | Path, rate: float | None = None, data: Any = None) -> FileInspection:
    """Gives what is in a data file: channels, rate, units, ranges, clipping, gaps, drift, noise, excitation.

    Nothing is declared: what a channel measures is guessed from its unit and its name, and the kind of the
    excitation is detected as a campaign detects it. A period is sought where the drive is neither a sine nor
    a blow.

    Args:
        file: A data file of any format that a campaign may have; with `data`, what these are called.
        rate: Samples per second [Hz], where the file does not state them.
        data: Data in memory in place of the file, as `read_campaign` takes them.

    Returns:
        The inspection.

    Raises:
        ValueError: If the file cannot be read, holds no channel, or contradicts the given rate.

    Example:
        >>> time = np.arange(4000) / 500.0
        >>> force = np.sin(2 * np.pi * 5.0 * time)
        >>> held = ij.records.inspect_file("run", data={"t [s]": time, "F [N]": force, "a [g]": 0.1 * force})
        >>> held.rate, held.drive, held.response, held.kind
        (500.0, 'F [N]', 'a [g]', 'stepped_sine')
    """
    path = Path(file)
    columns = find_reader(path)(path, None) if data is None else given_columns(path, None, data)
    sizes = [one.samples.size for one in columns.values() if one.samples.size >= _FEWEST_ROWS]
    if not sizes:
        raise ValueError(f"{path} holds no channel; expected columns of at least {_FEWEST_ROWS} numbers")
    size = max(sizes, key=lambda one: (sizes.count(one), one))
    held = {name: one for name, one in columns.items() if one.samples.size == size}
    time = next(
        (name for name, one in held.items() if is_time(split_heading(name)[0], one.unit, one.samples)), None
    )
    seconds = None if time is None else _seconds(held[time])
    found, origin, fault = _rate(path, rate, time, seconds, held)
    channels = tuple(
        inspect_channel(name, one.unit, guess_quantity(split_heading(name)[0], one.unit), one.samples)
        for name, one in held.items()
        if name != time
    )
    if not channels:
        raise ValueError(f"{path} holds no channel beside the time column `{time}`")
    drive, response = drive_and_response(channels)
    kind, dwells, period, direction = _excitation(drive, response, found or 1.0)
    return FileInspection(
        path,
        channels,
        found,
        origin,
        time,
        None if time is None else held[time].unit,
        fault,
        None if drive is None or response is None else drive.name,
        None if response is None else response.name,
        kind,
        dwells,
        period,
        direction,
        tuple(name for name in columns if name not in held),
        0.0 if seconds is None or fault else time_jitter(seconds),
    )


def _seconds(column: Column) -> Float[np.ndarray, " time"]:
    """Gives a time column in seconds, whose unit the file states or is one."""
    unit = channel_unit(column.unit or "s")
    return column.samples * (unit.factor if unit is not None else 1.0)


def _rate(
    file: Path,
    given: float | None,
    time: str | None,
    seconds: Float[np.ndarray, " time"] | None,
    held: Mapping[str, Column],
) -> tuple[float | None, str, str]:
    """Gives the rate, where it comes from, and what is wrong with the time column."""
    stated = next((one.rate for one in held.values() if one.rate is not None), None)
    measured, fault = None, ""
    if time is not None and seconds is not None:
        try:
            measured = uniform_rate(file, seconds, time, 0)
        except ValueError as error:
            fault = str(error).removeprefix(f"{file}: ")
            steps = np.diff(seconds[np.isfinite(seconds)])
            usual = float(np.median(steps)) if steps.size else 0.0
            measured = 1.0 / usual if usual > 0.0 else None
    found = stated or measured
    origin = "stated by the file" if stated is not None else f"time column `{time}`"
    if given is None or found is None:
        return (
            (given or found),
            ("given" if given is not None else origin if found is not None else ""),
            fault,
        )
    if abs(given / found - 1.0) > RATE_TOLERANCE:
        raise ValueError(
            f"{file}: the given rate is {given:.7g} Hz, but {found:.7g} Hz by what the file says ({origin}); "
            "they must agree"
        )
    return given, f"given, and {origin}", fault


def _excitation(
    drive: ChannelInspection | None, response: ChannelInspection | None, rate: float
) -> tuple[ExcitationKind | None, tuple[Dwell, ...], int | None, Direction]:
    """Gives kind, dwells, period and direction; nothing where samples are missing."""
    if drive is None or response is None or drive.missing or response.missing or drive.samples.size < 64:
        return None, (), None, "none"
    dwells, kind = detect_kind(drive.samples, response.samples, rate)
    if kind == "broadband":
        period = find_period(drive.samples)
        return ("broadband" if period is None else "periodic"), (), period, "none"
    return kind, dwells, None, _direction(kind, drive.samples, dwells)


def _direction(
    kind: ExcitationKind, drive: Float[np.ndarray, " time"], dwells: tuple[Dwell, ...]
) -> Direction:
    """Gives which way the frequency runs in most steps."""
    if kind == "stepped_sine":
        frequency = np.array([one.frequency for one in dwells])
    elif kind == "swept":
        frequency = np.array([ringing_frequency(part, 1.0) for part in np.array_split(drive, _PARTS)])
    else:
        return "none"
    way = float(np.sum(np.sign(np.diff(frequency))))
    return "forward" if way > 0 else "backward" if way < 0 else "none"
