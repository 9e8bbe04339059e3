"""Data in memory: arrays by name, pandas tables, xarray, and channels as SEP 005 lists them."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ._heading import split_heading
from ._layout import pick_columns
from ._leaves import Leaf, leaf_columns, structured_leaves
from ._samples import Column, as_samples, find_channel, unit_of_time
from ._time_steps import uniform_rate


def columns_of(data: Any, file: Path, names: Sequence[str] | None) -> dict[str, Column]:
    """Gives the named columns of data in memory.

    Args:
        data: Name to array, nested or not; a pandas `DataFrame`; an xarray `Dataset` or `DataArray`; a NumPy
            array, structured or plain; a list of channels as SEP 005 describes them: mappings with `name`,
            `data`, `unit_str` and `fs` or `time`.
        file: What the data are called, for errors.
        names: Names of columns as in a file: headings, "group.name", "data[:, 2]"; None for all.

    Returns:
        Name to column, with the unit that `attrs` or `unit_str` states, and the rate of SEP 005.

    Raises:
        ValueError: If the data are of another kind, a column is missing, or one holds no numbers.

    Source: SEP 005, timeseries of the SDyPy project, https://sdypy.org.
    """
    if isinstance(data, pd.DataFrame):
        return _frame_columns(data, file, names)
    if hasattr(data, "data_vars") or (hasattr(data, "coords") and hasattr(data, "dims")):
        return leaf_columns(file, names, list(_labelled_leaves(data)))
    if isinstance(data, Mapping) and {"name", "data"} <= set(data):
        data = [data]
    if isinstance(data, Mapping):
        return leaf_columns(file, names, list(_mapping_leaves("", data)))
    if isinstance(data, np.ndarray):
        return leaf_columns(file, names, list(structured_leaves("", data)))
    if isinstance(data, list | tuple) and data and all(isinstance(one, Mapping) for one in data):
        return _listed_columns(data, file, names)
    raise ValueError(
        f"{file}: data of the type {type(data).__name__} cannot be read; expected a mapping of names to "
        "arrays, a pandas DataFrame, an xarray Dataset, a NumPy array or a list of SEP 005 channels"
    )


def _frame_columns(frame: pd.DataFrame, file: Path, names: Sequence[str] | None) -> dict[str, Column]:
    if frame.index.name is not None or not isinstance(frame.index, pd.RangeIndex):
        frame = frame.rename_axis(frame.index.name or "index").reset_index()
    headings = [str(one) for one in frame.columns]
    units = frame.attrs.get("units", {})

    def column(i: int) -> Column:
        values = frame.iloc[:, i].to_numpy()
        unit = units.get(frame.columns[i]) or split_heading(headings[i])[1] or unit_of_time(values)
        return Column(as_samples(values, file, headings[i]), unit=unit)

    return pick_columns(file, names, headings, column)


def _labelled_leaves(data: Any) -> Iterator[Leaf]:
    """Gives coordinates and variables of an xarray object; that of a `DataArray` without a name is ""."""
    variables = dict(data.data_vars) if hasattr(data, "data_vars") else {data.name or "": data}
    for name, one in {**dict(data.coords), **variables}.items():
        values = np.asarray(one)
        unit = one.attrs.get("units") or one.attrs.get("unit")
        yield Leaf(str(name), lambda values=values: values, None if unit is None else str(unit))


def _mapping_leaves(path: str, data: Mapping[str, Any]) -> Iterator[Leaf]:
    for name, one in data.items():
        place = f"{path}.{name}" if path else str(name)
        if isinstance(one, Mapping):
            yield from _mapping_leaves(place, one)
            continue
        attributes = getattr(one, "attrs", {})
        unit = attributes.get("units") or attributes.get("unit")
        for leaf in structured_leaves(place, np.asarray(one)):
            yield Leaf(leaf.path, leaf.read, leaf.unit or (None if unit is None else str(unit)))


def _listed_columns(
    channels: Sequence[Mapping[str, Any]], file: Path, names: Sequence[str] | None
) -> dict[str, Column]:
    for place, one in enumerate(channels):
        lacking = [field for field in ("name", "data") if field not in one]
        if lacking:
            raise ValueError(
                f"{file}: channel {place + 1} lacks the field `{lacking[0]}`; a SEP 005 channel has name, "
                "data, unit_str, and fs or time"
            )
    known = [[str(one["name"])] for one in channels]
    if names is None:
        names = [own[0] for own in known if known.count(own) == 1]
    return {name: _listed_column(channels[find_channel(file, name, known)], file, name) for name in names}


def _listed_column(channel: Mapping[str, Any], file: Path, name: str) -> Column:
    samples, rate, start = as_samples(channel["data"], file, name), channel.get("fs"), None
    if channel.get("time") is not None:
        time = as_samples(channel["time"], file, f"{name}: time")
        if time.size != samples.size:
            raise ValueError(
                f"{file}: channel `{name}` has {samples.size} samples, but {time.size} times; expected "
                "as many"
            )
        rate, start = uniform_rate(file, time, name, 0) if rate is None else float(rate), float(time[0])
    unit = channel.get("unit_str") or channel.get("unit")
    rate = None if rate is None else float(rate)
    return Column(samples, rate, start, None if not unit else str(unit))
