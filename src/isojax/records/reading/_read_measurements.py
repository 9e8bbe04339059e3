"""The data files of a declaration as one `Campaign` in SI."""

import filecmp
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from .._campaign import Campaign, Filter, FloorChannel, InputChannel, OutputChannel
from .._record import Dwell, Kind, Record
from .._wording import row
from ..spectrum import compensate_butterworth, ringing_frequency, unsure_samples, zero_phase_butterworth
from ._channel_units import si_factor
from ._data_file import read_columns
from ._declaration import Declaration
from ._excitation_kind import detect_kind
from ._find_dwells import check_dwells, segment_dwells
from ._floor import floor_acceleration
from ._schedule import read_schedule, scheduled_dwells
from ._time_base import find_rate

_INPUT_MEASURES = {
    "force": "force",
    "base_acceleration": "acceleration",
    "reaction_mass_acceleration": "acceleration",
    "command": "command",
}
_FEWEST_SAMPLES = 16


def read_measurements(declared: Declaration) -> Campaign:
    """Gives the campaign that a declaration describes, its records in SI units and in the order of the test.

    Paths of data files and schedules are relative to the campaign.toml. Units are converted, and a reaction
    mass becomes a force. The filter runs where `applied = false` and is compensated where
    `compensate = true`. Dwells come from the schedule or are detected, and so is the kind of each record.

    Args:
        declared: The checked contents of the campaign.toml, as `read_declaration` gives them.

    Returns:
        The campaign.

    Raises:
        ValueError: At the first unit or data file that is wrong: which file, which field or row, what was
            found and what was expected.
    """
    file, sections = declared.file, declared.sections
    drive = InputChannel(**sections["input"])
    response = OutputChannel(**sections["output"])
    floor = None if sections["floor"] is None else FloorChannel(**sections["floor"])
    reader_filter = None if sections["filter"] is None else Filter(**sections["filter"])
    sign = -drive.moving_mass if drive.moving_mass is not None else 1.0
    factors = (
        sign * drive.gain * si_factor(drive.unit, _INPUT_MEASURES[drive.quantity], f"{file}: [input] unit"),
        si_factor(response.unit, response.quantity, f"{file}: [output] unit"),
        1.0 if floor is None else floor.gain * si_factor(floor.unit, floor.quantity, f"{file}: [floor] unit"),
    )
    names = _record_names(declared)
    records = tuple(
        _read_record(declared, i, names[i], factors, reader_filter) for i in range(len(declared.records))
    )
    _check_apart(declared, records)
    rate = records[0].rate
    for record in records:
        if abs(record.rate / rate - 1.0) > 1e-3:
            raise ValueError(
                f"{file}: {record.file} is sampled at {record.rate:.9g} Hz, but {records[0].file} at "
                f"{rate:.9g} Hz; "
                "all records of a campaign must have one rate"
            )
    return Campaign(
        title=sections["campaign"]["title"] or file.resolve().parent.name,
        file=file,
        mass=sections["campaign"]["mass"],
        mass_free=sections["campaign"]["mass_free"],
        input=drive,
        output=response,
        filter=reader_filter,
        rate=rate,
        stiffness=tuple(sections["model"]["stiffness"]),
        damping=tuple(sections["model"]["damping"]),
        elements=tuple(sections["model"]["elements"]),
        records=_clocked(records),
        floor=floor,
    )


def _record_names(declared: Declaration) -> list[str]:
    """Gives the file stem of each record; with its folder, ending and samples where it is not unique."""
    paths = [Path(entry["file"]) for entry in declared.records]
    files: dict[str, set[str]] = {}
    for path in paths:
        files.setdefault(path.stem, set()).add(path.as_posix())
    names = [path.stem if len(files[path.stem]) == 1 else path.as_posix() for path in paths]
    spans = [
        f"[{entry['start']}:{'' if entry['stop'] is None else entry['stop']}]" for entry in declared.records
    ]
    return [name + span if names.count(name) > 1 else name for name, span in zip(names, spans, strict=True)]


def _clocked(records: tuple[Record, ...]) -> tuple[Record, ...]:
    """Tell each record which share of the test it is; pauses between records are not known."""
    ends = np.cumsum([0.0, *(record.input.size / record.rate for record in records)])
    shares = (ends / ends[-1]).tolist()
    return tuple(
        replace(record, clock=(begin, end))
        for record, begin, end in zip(records, shares[:-1], shares[1:], strict=True)
    )


def _read_record(
    declared: Declaration,
    number: int,
    name: str,
    factors: tuple[float, float, float],
    reader_filter: Filter | None,
) -> Record:
    entry, sections = declared.records[number], declared.sections
    where = f"{declared.file}: [[record]] number {number + 1}"
    file = declared.file.parent / entry["file"]
    drive, response, clock = (
        sections["input"]["column"],
        sections["output"]["column"],
        sections["sampling"]["time"],
    )
    ground = sections["floor"] or {}
    wanted = (drive, response, ground.get("column"), clock)
    columns = read_columns(file, list(dict.fromkeys(one for one in wanted if one)))
    total = columns[drive].samples.size
    start, stop = _span(where, file, entry, total)
    settle = entry["settle"]
    raw_input = _channel(file, drive, columns[drive].samples[start:stop], start) * factors[0]
    raw_output = _channel(file, response, columns[response].samples[start:stop], start) * factors[1]
    floor = None
    if ground:
        column = ground["column"]
        floor = _channel(file, column, columns[column].samples[start:stop], start) * factors[2]
        _check_not_constant(file, column, floor)
    time = columns[clock].samples[start:stop] if clock else None
    stated = next((column.rate for column in columns.values() if column.rate is not None), None)
    rate = find_rate(file, sections["sampling"]["rate"], stated, time, clock, start)
    _check_not_constant(file, response, raw_output)
    if np.ptp(raw_input) == 0.0 and raw_input[0] != 0.0:
        _check_not_constant(file, drive, raw_input)
    shown_input, shown_output = raw_input, raw_output
    if reader_filter is not None:
        if reader_filter.cutoff_hz >= 0.5 * rate:
            raise ValueError(
                f"{declared.file}: [filter] cutoff_hz = {reader_filter.cutoff_hz:g} must be below half the "
                "sampling "
                f"rate, {0.5 * rate:g} Hz"
            )
        if reader_filter.compensate and not reader_filter.applied:
            raise ValueError(
                f"{declared.file}: [filter] compensate = true takes out what the bench did, but "
                "applied = false says that it did nothing"
            )
        if reader_filter.compensate or not reader_filter.applied:
            run = compensate_butterworth if reader_filter.compensate else zero_phase_butterworth
            shape = rate, reader_filter.order, reader_filter.cutoff_hz
            shown_input, shown_output = run(raw_input, *shape), run(raw_output, *shape)
            floor = None if floor is None else run(floor, *shape)
        if reader_filter.compensate:
            unsure = unsure_samples(rate, reader_filter.order, reader_filter.cutoff_hz)
            start, stop, settle = start + unsure, stop - unsure, max(0, settle - unsure)
            if stop - start - settle < _FEWEST_SAMPLES:
                raise ValueError(
                    f"{where} is too short: of its samples {unsure} at either end are lost where [filter] "
                    f"compensate = true takes a filter out, and at least {_FEWEST_SAMPLES} must be left"
                )
            if entry["period"] is not None and entry["period"] > stop - start:
                raise ValueError(
                    f"{where} has {stop - start} samples left, because [filter] compensate = true loses "
                    f"{unsure} at either end; expected at least its period = {entry['period']}"
                )
            kept = slice(unsure, -unsure)
            if entry["kind"] != "free_decay":
                _check_not_lost(where, raw_input, kept)
            raw_input, raw_output = raw_input[kept], raw_output[kept]
            shown_input, shown_output = shown_input[kept], shown_output[kept]
            floor = None if floor is None else floor[kept]
    dwells, kind = _excitation(where, declared, entry, rate, (start, stop, total), shown_input, shown_output)
    if kind != "free_decay" and not np.any(raw_input):
        raise ValueError(
            f"{file}: column `{drive}` is 0 throughout, and the output does not decay; expected a force "
            'that varies, or kind = "free_decay"'
        )
    if kind == "free_decay":
        shown_input = np.zeros_like(shown_input)
    return Record(
        name=name,
        file=file,
        time=np.arange(stop - start) / rate,
        rate=rate,
        input=shown_input,
        output=shown_output,
        raw_input=raw_input,
        raw_output=raw_output,
        level=entry["level"],
        direction=entry["direction"],
        repeat=entry["repeat"],
        role=entry["role"],
        period=entry["period"],
        settle=settle,
        dwells=dwells,
        kind=kind,
        floor=floor if floor is None else floor_acceleration(floor, rate, ground["quantity"]),
    )


def _span(where: str, file: Path, entry: Mapping[str, Any], total: int) -> tuple[int, int]:
    start, stop = entry["start"], total if entry["stop"] is None else entry["stop"]
    if start >= total or stop > total:
        wrong = f"start = {start}" if start >= total else f"stop = {stop}"
        raise ValueError(f"{where} {wrong} lies outside {file}, which has {total} samples")
    if stop <= start:
        raise ValueError(f"{where} stop = {stop} must be above start = {start}")
    size = stop - start
    if size < _FEWEST_SAMPLES:
        raise ValueError(f"{where} covers {size} samples of {file}; at least {_FEWEST_SAMPLES} are needed")
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


def _channel(
    file: Path, column: str, samples: Float[np.ndarray, " time"], start: int
) -> Float[np.ndarray, " time"]:
    wrong = np.flatnonzero(~np.isfinite(samples))
    if wrong.size:
        at = int(wrong[0])
        more = f" (and at {wrong.size - 1} more)" if wrong.size > 1 else ""
        raise ValueError(
            f"{file}: column `{column}` is {samples[at]} at {row(start + at)}{more}; every sample must be "
            "a finite "
            "number"
        )
    return samples


def _check_not_constant(file: Path, column: str, samples: Float[np.ndarray, " time"]) -> None:
    if np.ptp(samples) == 0.0:
        raise ValueError(
            f"{file}: column `{column}` is constant ({samples[0]:.6g} in SI throughout); expected a "
            "channel that "
            "varies"
        )


def _excitation(
    where: str,
    declared: Declaration,
    entry: Mapping[str, Any],
    rate: float,
    span: tuple[int, int, int],
    drive: Float[np.ndarray, " time"],
    response: Float[np.ndarray, " time"],
) -> tuple[tuple[Dwell, ...], Kind]:
    """Gives the dwells and the kind of a record: as declared, else as detected."""
    if entry["period"] is not None:
        return (), "periodic"
    if entry["schedule"] is not None:
        file = declared.file.parent / entry["schedule"]
        dwells = scheduled_dwells(file, read_schedule(file), rate, *span)
        check_dwells(file, drive, rate, dwells)
        return dwells, "stepped_sine"
    kind = entry["kind"]
    if kind == "stepped_sine":
        dwells = segment_dwells(drive, rate)
        if not dwells:
            raise ValueError(
                f'{where} has kind = "stepped_sine", but no dwell of four like cycles is found in its input; '
                "give its `schedule`"
            )
        return dwells, kind
    if kind is not None:
        return (), kind
    sections = declared.sections
    based = sections["input"]["quantity"] == "base_acceleration"
    mass = 1.0 if based else sections["campaign"]["mass"]
    ringing = 2.0 * np.pi * ringing_frequency(response, rate)
    order = {"acceleration": 0, "velocity": 1, "displacement": 2}[sections["output"]["quantity"]]
    return detect_kind(drive, response, rate, mass * ringing**order)


def _check_not_lost(where: str, drive: Float[np.ndarray, " time"], kept: slice) -> None:
    """Refuses a record of which only the ends were driven: a blow, say, that a filter's ends take away."""
    size = np.abs(drive - np.median(drive))
    whole, left = float(np.max(size)), float(np.max(size[kept]))
    if left < 0.5 * whole:
        raise ValueError(
            f"{where}: [filter] compensate = true loses {kept.start} samples at either end, in which the "
            f"drive reaches {whole:.4g} (SI), and {left:.4g} between them; expected a record that begins "
            "earlier, or compensate = false"
        )


def _check_apart(declared: Declaration, records: tuple[Record, ...]) -> None:
    """Refuses samples that are counted twice, above all held-out ones that are also used to fit."""
    files = [record.file.resolve() for record in records]
    for i, record in enumerate(records):
        for j, other in enumerate(records[:i]):
            # settle samples only set the state; but a fit sees its own, so they must not be held-out ones
            mine, its = (
                entry["start"] + (0 if one.role == "fit" and record.role != other.role else one.settle)
                for entry, one in ((declared.records[i], record), (declared.records[j], other))
            )
            first = max(mine, its)
            last = min(
                declared.records[i]["start"] + record.time.size,
                declared.records[j]["start"] + other.time.size,
            )
            if first >= last or not _same_content(files[i], files[j]):
                continue
            shared = (
                f"[[record]] number {j + 1} and number {i + 1} share samples {first}:{last} of {record.file}"
            )
            if record.role == other.role:
                raise ValueError(f"{declared.file}: {shared}; each sample may count only once")
            raise ValueError(
                f'{declared.file}: {shared}, once with role = "{other.role}", once with role = '
                f'"{record.role}"; '
                "held-out samples must not be used to fit"
            )


def _same_content(first: Path, second: Path) -> bool:
    """Says whether two paths lead to the same measurement: one file, or a copy under another name."""
    return first == second or filecmp.cmp(first, second, shallow=False)
