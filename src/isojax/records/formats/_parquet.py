"""Parquet files, by pyarrow."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from ._heading import split_heading
from ._layout import pick_columns
from ._limits import check_size
from ._samples import Column, as_samples, missing_extra, unit_of_time
from ._unreadable import unreadable


def read_parquet_columns(file: Path, names: Sequence[str] | None) -> dict[str, Column]:
    """Gives the named columns of a Parquet file.

    Args:
        file: The file.
        names: Column names, with or without the unit in them; None for all columns of numbers.

    Returns:
        Name to column, with the unit from its name or from the field `unit` of its metadata; a missing value
        is NaN, and points in time are seconds since the first.

    Raises:
        ValueError: If pyarrow is not installed, the file is no Parquet file, or a column is missing or holds
            no numbers.
    """
    try:
        import pyarrow.parquet
    except ImportError as error:
        raise missing_extra(file, "pyarrow", "Parquet files") from error
    held = _or_unreadable(file, lambda: pyarrow.parquet.ParquetFile(file))
    check_size(file, 8 * held.metadata.num_rows * held.metadata.num_columns)
    table = _or_unreadable(file, held.read)

    def column(i: int) -> Column:
        name = table.column_names[i]
        values = table.column(i).to_numpy()
        held = {key.decode(): value.decode() for key, value in (table.schema.field(i).metadata or {}).items()}
        unit = split_heading(name)[1] or held.get("unit") or held.get("units") or unit_of_time(values)
        return Column(as_samples(values, file, name), unit=unit)

    return pick_columns(file, names, table.column_names, column)


def _or_unreadable(file: Path, work: Callable[[], Any]) -> Any:
    try:
        return work()
    except Exception as error:  # pyarrow raises a dozen kinds on a broken file
        raise unreadable(file, "a Parquet file", error) from error
