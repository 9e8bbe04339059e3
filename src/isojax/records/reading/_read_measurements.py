"""The data files of a declaration as one `Campaign` in SI."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..._quantities import CONDITIONS
from .._campaign import TIME_DERIVATIVES, Campaign, Filter, FloorChannel, InputChannel, OutputChannel
from .._record import Dwell, ExcitationKind, Record
from .._windows import from_release
from ..spectrum import ringing_frequency
from ._channel_factor import check_units
from ._declaration import Declaration
from ._excitation_kind import detect_kind
from ._find_dwells import check_dwells, segment_dwells
from ._leaks import refuse_leaks
from ._reader_filter import filter_channels
from ._record_channels import RecordChannels, read_channels
from ._schedule import read_schedule, scheduled_dwells
from ._time_base import RATE_TOLERANCE


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
    check_units(declared)
    reader_filter = None if sections["filter"] is None else Filter(**sections["filter"])
    names = _record_names(declared)
    read = [_read_record(declared, i, names[i], reader_filter) for i in range(len(declared.records))]
    records, units = tuple(record for record, _ in read), read[0][1].units
    drive = InputChannel(**{**sections["input"], "unit": units["input"]})
    response = OutputChannel(**{**sections["output"], "unit": units["output"]})
    floor = (
        None if sections["floor"] is None else FloorChannel(**{**sections["floor"], "unit": units["floor"]})
    )
    _check_apart(declared, records)
    refuse_leaks(file, records, [channels.rounding for _, channels in read])
    rate = records[0].rate
    for record in records:
        if abs(record.rate / rate - 1.0) > RATE_TOLERANCE:
            raise ValueError(
                f"{file}: {record.file} is sampled at {record.rate:.9g} Hz, but {records[0].file} at "
                f"{rate:.9g} Hz; all records of a campaign must have one rate"
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
        random_force=sections["model"]["random_force"],
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
    """Gives each record its share of the test's duration; pauses between records are not known."""
    ends = np.cumsum([0.0, *(record.input.size / record.rate for record in records)])
    shares = (ends / ends[-1]).tolist()
    return tuple(
        replace(record, clock=(start, stop))
        for record, start, stop in zip(records, shares[:-1], shares[1:], strict=True)
    )


def _read_record(
    declared: Declaration,
    number: int,
    name: str,
    reader_filter: Filter | None,
) -> tuple[Record, RecordChannels]:
    """Gives a record, and its channels as they were read."""
    entry = declared.records[number]
    where = f"{declared.file}: [[record]] number {number + 1}"
    file = declared.file.parent / entry["file"]
    channels = read_channels(where, file, declared, entry)
    if reader_filter is not None:
        channels = filter_channels(where, declared.file, entry, reader_filter, channels)
    dwells, kind = _excitation(where, declared, entry, channels)
    if kind != "free_decay" and not np.any(channels.raw_input):
        raise ValueError(
            f"{file}: column `{declared.sections['input']['column']}` is 0 throughout, and the output does "
            'not decay; expected a force that varies, or kind = "free_decay"'
        )
    record = Record(
        name=name,
        file=file,
        time=np.arange(channels.stop - channels.start) / channels.rate,
        rate=channels.rate,
        input=np.zeros_like(channels.input) if kind == "free_decay" else channels.input,
        output=channels.output,
        raw_input=channels.raw_input,
        raw_output=channels.raw_output,
        level=entry["level"],
        direction=entry["direction"],
        repeat=entry["repeat"],
        role=entry["role"],
        period=entry["period"],
        settle=channels.settle,
        dwells=dwells,
        kind=kind,
        start=channels.start,
        floor=channels.floor_acceleration(declared),
        time_jitter=channels.time_jitter,
        resampled=channels.resampled,
        removed_spikes=channels.removed_spikes,
        **{name: entry[name] for name in CONDITIONS},
    )
    return from_release(record), channels


def _excitation(
    where: str, declared: Declaration, entry: Mapping[str, Any], channels: RecordChannels
) -> tuple[tuple[Dwell, ...], ExcitationKind]:
    """Gives the dwells and the kind of a record: as declared, else as detected."""
    if entry["period"] is not None:
        return (), "periodic"
    drive, rate = channels.input, channels.rate
    if entry["schedule"] is not None:
        file = declared.file.parent / entry["schedule"]
        span = channels.start, channels.stop, channels.total
        dwells = scheduled_dwells(file, read_schedule(file), rate, *span)
        check_dwells(file, drive, rate, dwells)
        return dwells, "stepped_sine"
    kind = entry["kind"]
    if kind == "stepped_sine":
        dwells = segment_dwells(drive, rate)
        if not dwells:
            raise ValueError(
                f'{where} has kind = "stepped_sine", but no dwell of four equal cycles is detected in its '
                "input; give its `schedule`"
            )
        return dwells, kind
    if kind is not None:
        return (), kind
    sections = declared.sections
    based = sections["input"]["quantity"] == "base_acceleration"
    mass = 1.0 if based else sections["campaign"]["mass"]
    ringing = 2.0 * np.pi * ringing_frequency(channels.output, rate)
    order = TIME_DERIVATIVES["acceleration"] - TIME_DERIVATIVES[sections["output"]["quantity"]]
    return detect_kind(drive, channels.output, rate, mass * ringing**order)


def _check_apart(declared: Declaration, records: tuple[Record, ...]) -> None:
    """Refuses samples that are counted twice, above all held-out ones that are also used to fit."""
    files = [record.file.resolve() for record in records]
    for i, record in enumerate(records):
        for j, other in enumerate(records[:i]):
            starts = [declared.records[place]["start"] + records[place].held for place in (i, j)]
            # Settle samples only set the state, but a fitted record must not have held-out ones for it.
            mine, its = (
                start + (0 if one.role == "fit" and record.role != other.role else one.settle)
                for start, one in zip(starts, (record, other), strict=True)
            )
            first = max(mine, its)
            last = min(starts[0] + record.time.size, starts[1] + other.time.size)
            if first >= last or not (files[i] == files[j] or _same_samples(record, other, first, last)):
                continue
            shared = (
                f"[[record]] number {j + 1} and number {i + 1} share samples {first}:{last} of {record.file}"
            )
            if record.role == other.role:
                raise ValueError(f"{declared.file}: {shared}; each sample may count only once")
            raise ValueError(
                f'{declared.file}: {shared}, once with role = "{other.role}", once with role = '
                f'"{record.role}"; held-out samples must not be used to fit'
            )


def _same_samples(one: Record, other: Record, first: int, last: int) -> bool:
    """Says whether two records are one measurement under two names: equal in samples [first, last)."""
    # Where a filter is taken out, samples at either end are lost.
    first = max(first, one.start, other.start)
    last = min(last, one.start + one.raw_input.size, other.start + other.raw_input.size)
    return first < last and all(
        np.array_equal(
            getattr(one, channel)[first - one.start : last - one.start],
            getattr(other, channel)[first - other.start : last - other.start],
        )
        for channel in ("raw_input", "raw_output")
    )
