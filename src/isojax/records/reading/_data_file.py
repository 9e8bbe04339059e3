"""The reader of each file ending, and channels aligned to one time base."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from .._wording import nearest
from ..formats import (
    Column,
    columns_of,
    read_hdf5_columns,
    read_lvm_columns,
    read_mat_columns,
    read_npz_columns,
    read_parquet_columns,
    read_sheet_columns,
    read_tdms_columns,
    read_text_columns,
    read_universal_columns,
)

READERS: Mapping[str, Callable[[Path, Sequence[str] | None], dict[str, Column]]] = {
    ".csv": read_text_columns,
    ".txt": read_text_columns,
    ".dat": read_text_columns,
    ".tsv": read_text_columns,
    ".lvm": read_lvm_columns,
    ".xlsx": read_sheet_columns,
    ".xls": read_sheet_columns,
    ".ods": read_sheet_columns,
    ".parquet": read_parquet_columns,
    ".npz": read_npz_columns,
    ".mat": read_mat_columns,
    ".h5": read_hdf5_columns,
    ".hdf5": read_hdf5_columns,
    ".uff": read_universal_columns,
    ".unv": read_universal_columns,
    ".tdms": read_tdms_columns,
}

_RATE_MATCH = 1e-6
"""Relative difference of the rates of two channels that are sampled together."""

_WHOLE_SHIFT = 0.05
"""Fraction of a sample by which the starts of two channels may miss a whole number of samples."""


def read_columns(file: Path, names: Sequence[str], data: Any = None) -> dict[str, Column]:
    """Gives the named columns of a data file, all of one length and starting at one time.

    Channels that the file says start a whole number of samples apart are cut to the time they share.

    Args:
        file: The file; its ending says how to read it.
        names: Column names.
        data: What was given in memory in place of the file, or None.

    Returns:
        Name to column.

    Raises:
        ValueError: If the file is missing, empty or broken, its ending unknown, a column missing or no list
            of numbers, or if the columns differ in length, rate or (by a fraction of a sample) in start.
    """
    if data is not None:
        return _aligned(file, columns_of(data, file, names))
    reader = find_reader(file)
    if file.stat().st_size == 0:
        raise ValueError(f"{file} is empty (0 bytes); expected the columns {', '.join(names)}")
    return _aligned(file, reader(file, names))


def find_reader(file: Path) -> Callable[[Path, Sequence[str] | None], dict[str, Column]]:
    """Gives what reads a file, by its ending.

    Raises:
        ValueError: If the file is missing, or its ending unknown.
    """
    if file.is_dir():
        raise ValueError(f"{file} is a folder; a record must be one file, ending in {', '.join(READERS)}")
    if not file.is_file():
        near = nearest(file.name, [one.name for one in file.parent.glob("*")] if file.parent.is_dir() else [])
        raise ValueError(f"{file} does not exist; expected a data file{near}")
    reader = READERS.get(file.suffix.lower())
    if reader is None:
        raise ValueError(
            f'{file} has the unknown ending "{file.suffix}"; expected one of {", ".join(READERS)}'
        )
    return reader


def _aligned(file: Path, columns: dict[str, Column]) -> dict[str, Column]:
    stated = {name: column for name, column in columns.items() if column.rate is not None}
    if stated:
        first, reference = next(iter(stated.items()))
        for name, column in stated.items():
            if abs(column.rate / reference.rate - 1.0) > _RATE_MATCH:  # type: ignore[operator]
                raise ValueError(
                    f"{file}: channel `{name}` is sampled at {column.rate:.9g} Hz, but `{first}` at "
                    f"{reference.rate:.9g} Hz; resample them to one rate"
                )
        columns = _cut(file, columns, float(reference.rate or 1.0))
    first, size = next((name, column.samples.size) for name, column in columns.items())
    for name, column in columns.items():
        if column.samples.size != size:
            raise ValueError(
                f"{file}: column `{name}` has {column.samples.size} samples, but `{first}` has {size}; "
                "they must be equally long"
            )
    return columns


def _cut(file: Path, columns: dict[str, Column], rate: float) -> dict[str, Column]:
    starts = {name: column.start or 0.0 for name, column in columns.items()}
    last = max(starts.values())
    late = next(name for name, start in starts.items() if start == last)
    shifts: dict[str, int] = {}
    for name, start in starts.items():
        shift = (last - start) * rate
        if abs(shift - round(shift)) > _WHOLE_SHIFT:
            raise ValueError(
                f"{file}: channel `{late}` starts {shift:.3f} samples after `{name}`; "
                "channels must start together or a whole number of samples apart"
            )
        shifts[name] = round(shift)
    if not any(shifts.values()):
        return columns
    size = min(column.samples.size - shifts[name] for name, column in columns.items())
    if size < 2:
        raise ValueError(
            f"{file}: channel `{late}` starts {max(shifts.values())} samples late: none are shared"
        )
    return {
        name: replace(column, samples=column.samples[shifts[name] : shifts[name] + size], start=last)
        for name, column in columns.items()
    }
