"""Parquet files, by pyarrow."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ._heading import split_heading
from ._layout import pick_columns
from ._limits import SAMPLE, check_demand
from ._samples import Column, as_samples, missing_extra, unit_of_time


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
    held = pyarrow.parquet.ParquetFile(file)
    schema = held.schema_arrow
    groups = [held.metadata.row_group(i).num_rows for i in range(held.num_row_groups)]
    rows = max(held.metadata.num_rows, sum(groups))
    read = [name for name in schema.names if names is None or {name, split_heading(name)[0]} & {*names}]
    check_demand(file, SAMPLE * rows * len(read))

    def column(i: int) -> Column:
        name, kind = schema.names[i], schema.types[i]
        if not _is_number(pyarrow.types, kind):
            raise ValueError(f"{file}: column `{name}` holds {kind} values; expected numbers")
        table = held.read(columns=[name])
        place = [j for j, one in enumerate(table.column_names) if one == name][schema.names[:i].count(name)]
        values = table.column(place).to_numpy()
        stated = {key.decode(): value.decode() for key, value in (schema.field(i).metadata or {}).items()}
        unit = split_heading(name)[1] or stated.get("unit") or stated.get("units") or unit_of_time(values)
        return Column(as_samples(values, file, name), unit=unit)

    return pick_columns(file, names, schema.names, column)


def _is_number(types: Any, kind: Any) -> bool:
    kind = kind.value_type if types.is_dictionary(kind) else kind
    return types.is_integer(kind) or types.is_floating(kind) or types.is_temporal(kind)
