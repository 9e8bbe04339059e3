"""Spreadsheets (.xlsx, .xls, .ods), by python-calamine."""

import datetime
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .._wording import row
from ._layout import find_layout, pick_columns
from ._samples import Column, as_samples, missing_extra
from ._sheet_bounds import check_sheets

_LOOKED_AT = 500
"""Rows from which the heading is found."""


def read_sheet_columns(file: Path, names: Sequence[str] | None) -> dict[str, Column]:
    """Gives the named columns of a spreadsheet.

    Args:
        file: The file.
        names: Headings, as "heading" or "sheet/heading"; None for all columns of numbers.

    Returns:
        Name to column; an empty cell is NaN, and points in time are seconds since the first.

    Raises:
        ValueError: If python-calamine is not installed, the file is no spreadsheet or holds no table, a
            heading is missing or not unique, or a cell is no number.
    """
    try:
        import python_calamine
    except ImportError as error:
        raise missing_extra(file, "python-calamine", "spreadsheets") from error
    check_sheets(file)
    book = python_calamine.CalamineWorkbook.from_path(str(file))
    sheets = {
        name: book.get_sheet_by_name(name).to_python(skip_empty_area=False) for name in book.sheet_names
    }
    places: list[tuple[str, int, int, str | None]] = []
    headings: list[str] = []
    for name, rows in sheets.items():
        shown = [_shown(cells) for cells in rows[:_LOOKED_AT]]
        layout = find_layout(shown, _is_number)
        if layout is None or len(layout.headings) != layout.width:
            continue
        headings += layout.headings
        places += [(name, layout.first, i, layout.units[i]) for i in range(layout.width)]
    if not places:
        raise ValueError(f"{file} holds no table; expected a sheet with a heading and rows of numbers")

    def column(i: int) -> Column:
        sheet, first, place, unit = places[i]
        cells = [cells[place] if place < len(cells) else "" for cells in sheets[sheet][first:]]
        while cells and cells[-1] == "":
            cells.pop()
        values, timed = _values(file, sheet, headings[i], cells, first)
        return Column(as_samples(values, file, headings[i]), unit="s" if timed else unit)

    return pick_columns(file, names, headings, column, [place[0] for place in places])


def _shown(cells: Sequence[Any]) -> list[str]:
    """Gives the cells of a row as text, without the empty ones at its end."""
    shown = [cell if isinstance(cell, str) else repr(_seconds(cell)) for cell in cells]
    while shown and not shown[-1].strip():
        shown.pop()
    return shown


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _seconds(cell: Any) -> float:
    if isinstance(cell, datetime.datetime):
        return (cell.replace(tzinfo=None) - datetime.datetime(1970, 1, 1)).total_seconds()
    if isinstance(cell, datetime.timedelta):
        return cell.total_seconds()
    if isinstance(cell, datetime.time):
        return 3600.0 * cell.hour + 60.0 * cell.minute + cell.second + 1e-6 * cell.microsecond
    return float(cell) if isinstance(cell, (int, float)) else float("nan")


def _values(
    file: Path, sheet: str, heading: str, cells: Sequence[Any], first: int
) -> tuple[np.ndarray, bool]:
    """Gives cells as numbers, and whether they are points in time."""
    for index, cell in enumerate(cells):
        if isinstance(cell, bool) or (isinstance(cell, str) and cell.strip()):
            raise ValueError(
                f"{file}: column `{heading}` holds the text {str(cell)!r} at {row(index)}, row "
                f"{first + index + 1} of the sheet `{sheet}`, not a number"
            )
    timed = any(isinstance(cell, datetime.datetime | datetime.timedelta | datetime.time) for cell in cells)
    values = np.array([np.nan if isinstance(cell, str) else _seconds(cell) for cell in cells])
    return (values - values[0] if timed and values.size else values), timed
