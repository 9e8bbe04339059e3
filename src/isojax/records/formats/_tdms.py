"""TDMS files of LabVIEW, whose channels may start at different times."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ._samples import Column, as_samples, find_channel


def read_tdms_columns(file: Path, names: Sequence[str]) -> dict[str, Column]:
    """Gives the named channels of a TDMS file.

    Args:
        file: The file.
        names: Channel names, as "channel" or "group/channel".

    Returns:
        Name to column, with the rate and, relative to the first of them, the start time that the file states.

    Raises:
        ValueError: If npTDMS is not installed, the file is no TDMS, or there are no or several channels of a
            name.
    """
    try:
        from nptdms import TdmsFile
    except ImportError as error:
        raise ValueError(f"{file}: reading TDMS needs npTDMS; pip install isojax[io]") from error
    try:
        held = TdmsFile.read(str(file))
        channels = [channel for group in held.groups() for channel in group.channels()]
    except Exception as error:  # npTDMS raises ValueError, KeyError, struct.error, ... on a broken file
        raise ValueError(f"{file} cannot be read as TDMS: {error}") from error
    known = [(f"{one.group_name}/{one.name}", one.name) for one in channels]
    chosen = {name: channels[find_channel(file, name, known)] for name in names}
    clocks = [channel.properties.get("wf_start_time") for channel in chosen.values()]
    origin = next((clock for clock in clocks if clock is not None), None)
    return {name: _channel_column(file, name, channel, origin) for name, channel in chosen.items()}


def _channel_column(file: Path, name: str, channel: Any, origin: Any) -> Column:
    samples = as_samples(channel[:], file, name)
    increment = channel.properties.get("wf_increment")
    if increment is None or not float(increment) > 0:
        return Column(samples)
    start = float(channel.properties.get("wf_start_offset", 0.0))
    clock = channel.properties.get("wf_start_time")
    if clock is not None and origin is not None:
        start += float((np.datetime64(clock) - np.datetime64(origin)) / np.timedelta64(1, "us")) * 1e-6
    return Column(samples, rate=1.0 / float(increment), start=start)
