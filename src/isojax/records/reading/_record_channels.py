"""The channels of one record in SI, cut to its samples and checked."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from .._physical_limits import SIZE
from .._spikes import without_spikes
from .._wording import row
from ..formats import last_digit, time_jitter
from ._channel_factor import channel_factor
from ._data_file import read_columns
from ._declaration import Declaration
from ._floor_channel import floor_acceleration
from ._resample import on_even_grid
from ._time_base import find_rate

FEWEST_SAMPLES = 16
"""Samples without which a record is refused."""

MOST_JITTER = 0.02
"""rms by which times may scatter about an even grid, over its step. A sine of ten samples a cycle is then off
by 1 %, about what a good sensor is."""


@dataclass(frozen=True, eq=False)
class RecordChannels:
    """Samples [start, stop) of a data file.

    Attributes:
        start: First sample, counted from the start of the file.
        stop: One past the last sample.
        total: Samples of the file.
        settle: Samples at the start that count in no error.
        rate: Samples per second [Hz].
        raw_input: Input before the reader's [filter], in SI.
        raw_output: Output before the reader's [filter], in SI.
        input: Input after it.
        output: Output after it.
        floor: Measured motion of the floor after it, in SI, or None.
        units: Units of the columns of input, output and floor in the file, as far as they are channels.
        time_jitter: rms by which the time column departs from the even grid, beyond its rounding [s].
        removed_spikes: Samples that were replaced, of both channels.
        resampled: Whether the channels were brought from scattered times to the even grid.
        rounding: rms error that the digits of the output in the file leave, in SI.
    """

    start: int
    stop: int
    total: int
    settle: int
    rate: float
    raw_input: Float[np.ndarray, " time"]
    raw_output: Float[np.ndarray, " time"]
    input: Float[np.ndarray, " time"]
    output: Float[np.ndarray, " time"]
    floor: Float[np.ndarray, " time"] | None
    units: Mapping[str, str]
    time_jitter: float = 0.0
    removed_spikes: int = 0
    resampled: bool = False
    rounding: float = 0.0

    def floor_acceleration(self, declared: Declaration) -> Float[np.ndarray, " time"] | None:
        """Gives the acceleration of the floor [m/s^2], or None."""
        if self.floor is None:
            return None
        return floor_acceleration(self.floor, self.rate, declared.sections["floor"]["quantity"])


def read_channels(
    where: str,
    file: Path,
    declared: Declaration,
    entry: Mapping[str, Any],
) -> RecordChannels:
    """Gives the channels of a record as they were measured.

    Args:
        where: The [[record]], for errors.
        file: Its data file.
        declared: What the channels are called.
        entry: The [[record]] as declared.

    Returns:
        The channels; nothing is filtered yet.

    Raises:
        ValueError: If the file, a channel, its unit or the span of the record is wrong.
    """
    sections, clock = declared.sections, declared.sections["sampling"]["time"]
    named: dict[str, str] = {
        one: sections[one]["column"] for one in ("input", "output", "floor") if sections[one] is not None
    }
    wanted: list[str] = [*named.values(), clock] if clock else [*named.values()]
    columns = read_columns(file, list(dict.fromkeys(wanted)), declared.given(entry))
    total = columns[named["input"]].samples.size
    start, stop = _checked_span(where, file, entry, total)
    measured, units, removed, rounding = {}, {}, 0, 0.0
    for name, column in named.items():
        unit, factor = channel_factor(declared, name, columns[column], file)
        units[name] = unit
        measured[name] = _finite(file, column, columns[column].samples[start:stop], start, factor)
        if sections[name].get("remove_spikes"):
            measured[name], count = without_spikes(measured[name])
            removed += count
        if name == "output":
            digits = last_digit(columns[column].samples[start:stop])
            rounding = abs(factor) * float(np.sqrt(np.mean(digits**2) / 12.0))
    raw_input, raw_output, floor = measured["input"], measured["output"], measured.get("floor")
    if floor is not None:
        _check_not_constant(file, named["floor"], floor)
    time = None
    if clock:
        seconds = channel_factor(declared, "sampling", columns[clock], file)[1]
        time = columns[clock].samples[start:stop] * seconds
    stated = next((column.rate for column in columns.values() if column.rate is not None), None)
    rate = find_rate(file, sections["sampling"]["rate"], stated, time, clock, start)
    _check_not_constant(file, named["output"], raw_output)
    if np.any(raw_input):
        _check_not_constant(file, named["input"], raw_input)
    jitter, resampled = (0.0 if time is None else time_jitter(time)), False
    if time is not None and jitter > 0.0 and sections["sampling"]["resample"]:
        present = [one for one in (raw_input, raw_output, floor) if one is not None]
        first, (raw_input, raw_output, *rest) = on_even_grid(time, rate, *present)
        floor, start, resampled = (rest[0] if rest else None), start + first, True
        stop = start + raw_output.size
    elif jitter * rate > MOST_JITTER:
        raise ValueError(
            f"{file}: the times of column `{clock}` scatter by {1e3 * jitter:.3g} ms rms about an even grid, "
            f"{100.0 * jitter * rate:.3g} % of its step; expected at most {100.0 * MOST_JITTER:.2g} %. If "
            "the samples were taken at these times, set [sampling] resample = true; if only the time stamps "
            "scatter, give their rate in place of time"
        )
    channels = raw_input, raw_output, raw_input, raw_output, floor
    told = units, jitter, removed, resampled, rounding
    return RecordChannels(start, stop, total, entry["settle"], rate, *channels, *told)


def _checked_span(where: str, file: Path, entry: Mapping[str, Any], total: int) -> tuple[int, int]:
    start, stop = entry["start"], total if entry["stop"] is None else entry["stop"]
    if start >= total or stop > total:
        wrong = f"start = {start}" if start >= total else f"stop = {stop}"
        raise ValueError(f"{where} {wrong} lies outside {file}, which has {total} samples")
    if stop <= start:
        raise ValueError(f"{where} stop = {stop} must be above start = {start}")
    size = stop - start
    if size < FEWEST_SAMPLES:
        raise ValueError(f"{where} covers {size} samples of {file}; at least {FEWEST_SAMPLES} are needed")
    if entry["settle"] >= size:
        raise ValueError(
            f"{where} settle = {entry['settle']} must be below the record's {size} samples ({file})"
        )
    if entry["period"] is not None and entry["period"] > size:
        raise ValueError(f"{where} period = {entry['period']} exceeds the record's {size} samples ({file})")
    if entry["period"] is not None and entry["schedule"] is not None:
        raise ValueError(
            f"{where} has both a period and a schedule; a record is periodic or stepped, not both"
        )
    return start, stop


def _finite(
    file: Path, column: str, samples: Float[np.ndarray, " time"], start: int, factor: float
) -> Float[np.ndarray, " time"]:
    """Gives samples in SI, all of a size that can be computed with."""
    wrong = np.flatnonzero(~(np.abs(samples) <= SIZE.most / abs(factor)))
    if wrong.size:
        at = int(wrong[0])
        more = f" (and at {wrong.size - 1} more)" if wrong.size > 1 else ""
        size = f", at most {SIZE.most:g} in SI" if np.isfinite(samples[at]) else ""
        raise ValueError(
            f"{file}: column `{column}` is {samples[at]} at {row(start + at)}{more}; every sample must be "
            f"a finite number{size}"
        )
    return samples * factor


def _check_not_constant(file: Path, column: str, samples: Float[np.ndarray, " time"]) -> None:
    if np.ptp(samples) < SIZE.least:
        raise ValueError(
            f"{file}: column `{column}` is constant ({samples[0]:.6g} in SI throughout); expected a "
            "channel that varies"
        )
