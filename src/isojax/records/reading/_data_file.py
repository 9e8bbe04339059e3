"""The reader of each file ending, and channels aligned to one time base."""

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from .._physical_limits import RATE, TIME
from .._wording import nearest
from ..formats import (
    Column,
    columns_of,
    door,
    file_size,
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


@dataclass(frozen=True)
class Reader:
    """What reads the files of an ending, behind the door that every file passes.

    Attributes:
        read: Gives the named columns of a file; None for all that hold numbers.
        what: What such a file is, in words.
    """

    read: Callable[[Path, Sequence[str] | None], dict[str, Column]]
    what: str

    def __call__(self, file: Path, names: Sequence[str] | None) -> dict[str, Column]:
        """Gives the named columns of a file.

        Raises:
            ValueError: If it is missing, empty, no file on a disk, asks for too much, is broken, or lacks a
                column; no other exception leaves it.
        """
        with door(file, self.what):
            size = file_size(file)
            if size is None:
                raise ValueError(f"{file} does not exist; expected a data file")
            if size == 0:
                raise ValueError(f"{file} is empty (0 bytes); expected {self.what}")
            return _possible(file, self.read(file, names))


_TEXT = Reader(read_text_columns, "a table of text")
_SHEET = Reader(read_sheet_columns, "a spreadsheet")
_HDF5 = Reader(read_hdf5_columns, "HDF5")
_UNIVERSAL = Reader(read_universal_columns, "a universal file")
READERS: Mapping[str, Reader] = {
    ".csv": _TEXT,
    ".txt": _TEXT,
    ".dat": _TEXT,
    ".tsv": _TEXT,
    ".lvm": Reader(read_lvm_columns, "a LabVIEW measurement file"),
    ".xlsx": _SHEET,
    ".xls": _SHEET,
    ".ods": _SHEET,
    ".parquet": Reader(read_parquet_columns, "a Parquet file"),
    ".npz": Reader(read_npz_columns, "a NumPy .npz archive"),
    ".mat": Reader(read_mat_columns, "a MATLAB .mat file"),
    ".h5": _HDF5,
    ".hdf5": _HDF5,
    ".uff": _UNIVERSAL,
    ".unv": _UNIVERSAL,
    ".tdms": Reader(read_tdms_columns, "TDMS"),
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
    return _aligned(
        file, find_reader(file)(file, names) if data is None else given_columns(file, names, data)
    )


def given_columns(file: Path, names: Sequence[str] | None, data: Any) -> dict[str, Column]:
    """Gives the named columns of data in memory, None for all, behind the door of a file."""
    with door(file, "data in memory"):
        return _possible(file, columns_of(data, file, names))


def find_reader(file: Path) -> Reader:
    """Gives what reads a file, by its ending.

    Raises:
        ValueError: If the file is missing, or its ending unknown.
    """
    if file_size(file) is None:
        siblings = [one.name for one in file.parent.glob("*")] if os.path.isdir(file.parent) else []
        raise ValueError(f"{file} does not exist; expected a data file{nearest(file.name, siblings)}")
    reader = READERS.get(file.suffix.lower())
    if reader is None:
        raise ValueError(
            f'{file} has the unknown ending "{file.suffix}"; expected one of {", ".join(READERS)}'
        )
    return reader


def _possible(file: Path, columns: dict[str, Column]) -> dict[str, Column]:
    for name, column in columns.items():
        rate, start = column.rate, abs(column.start or 0.0)
        for what, found, limits in (("rate", rate, RATE), ("start time", start, TIME)):
            if found is not None and not limits.hold(found):
                raise ValueError(
                    f"{file}: channel `{name}` states a {what} of {found:g}; expected one {limits.words}"
                )
    return columns


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
