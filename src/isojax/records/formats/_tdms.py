"""TDMS files of LabVIEW, whose channels may start at different times."""

import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ._heading import split_heading
from ._limits import SAMPLE, check_count, check_demand
from ._samples import Column, as_samples, find_channel, missing_extra, unit_of_time

_LEAD = 28
"""Bytes of the lead-in of a segment."""

_SEGMENT = 4096
"""Bytes of memory that a segment takes."""

_BIG_ENDIAN = 1 << 6
"""Mark of a segment of the other byte order, in its table of contents."""

_UNIT_NAMES = ("unit_string", "NI_UnitDescription", "Unit", "unit")
"""Properties under which LabVIEW, DIAdem and others write the unit of a channel."""


def read_tdms_columns(file: Path, names: Sequence[str] | None) -> dict[str, Column]:
    """Gives the named channels of a TDMS file.

    Args:
        file: The file.
        names: Channel names, as "channel" or "group/channel"; None for all channels of numbers.

    Returns:
        Name to column, with the rate and, relative to the first of them, the start time that the file states.

    Raises:
        ValueError: If npTDMS is not installed, the file is no TDMS, or there are no or several channels of a
            name.
    """
    try:
        from nptdms import TdmsFile
    except ImportError as error:
        raise missing_extra(file, "npTDMS", "TDMS") from error
    _check_segments(file)
    with file.open("rb") as handle, TdmsFile.open(handle) as held:
        channels = [channel for group in held.groups() for channel in group.channels()]
        known = [(f"{one.group_name}/{one.name}", one.name) for one in channels]
        check_count(file, len(known))
        if names is None:
            names = [
                _shortest(own, known) for own, one in zip(known, channels, strict=True) if _is_channel(one)
            ]
        chosen = {name: channels[find_channel(file, name, known)] for name in names}
        for name, channel in chosen.items():
            if len(channel) and not _is_channel(channel):
                raise ValueError(f"{file}: column `{name}` holds text or one value; expected real numbers")
        check_demand(file, SAMPLE * sum(len(one) for one in chosen.values()))
        clocks = [channel.properties.get("wf_start_time") for channel in chosen.values()]
        origin = next((clock for clock in clocks if clock is not None), None)
        return {name: _channel_column(file, name, channel, origin) for name, channel in chosen.items()}


def _check_segments(file: Path) -> None:
    """Refuses a file that is no TDMS, or has more segments than can be looked through."""
    place, count, size = 0, 0, file.stat().st_size
    with file.open("rb") as handle:
        while place + _LEAD <= size:
            handle.seek(place)
            lead = handle.read(_LEAD)
            if lead[:4] != b"TDSm":
                break
            (following,) = struct.unpack_from(">Q" if lead[4] & _BIG_ENDIAN else "<Q", lead, 12)
            place, count = place + _LEAD + following, count + 1
            check_demand(file, _SEGMENT * count)
    if not count:
        raise LookupError("the mark TDSm at its start is missing")


def _shortest(own: tuple[str, str], known: Sequence[tuple[str, str]]) -> str:
    return own[1] if sum(own[1] in other for other in known) == 1 else own[0]


def _is_channel(channel: Any) -> bool:
    return len(channel) > 1 and channel.dtype is not None and np.dtype(channel.dtype).kind in "iufM"


def _channel_column(file: Path, name: str, channel: Any, origin: Any) -> Column:
    samples = as_samples(channel[:], file, name)
    unit = next((str(channel.properties[one]) for one in _UNIT_NAMES if channel.properties.get(one)), None)
    unit = unit or split_heading(channel.name)[1] or unit_of_time(channel[:2])
    increment = channel.properties.get("wf_increment")
    if increment is None or not float(increment) > 0:
        return Column(samples, unit=unit)
    start = float(channel.properties.get("wf_start_offset", 0.0))
    clock = channel.properties.get("wf_start_time")
    if clock is not None and origin is not None:
        start += float((np.datetime64(clock) - np.datetime64(origin)) / np.timedelta64(1, "us")) * 1e-6
    return Column(samples, rate=1.0 / float(increment), start=start, unit=unit)
