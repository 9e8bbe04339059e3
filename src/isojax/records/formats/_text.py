"""Text tables (.csv, .txt, .dat): any common separator, decimal point or comma, encoding and heading."""

import csv
import io
import itertools
import math
import re
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from jaxtyping import Float

from .._wording import row
from ._clock import read_clock, seconds_since_first
from ._layout import Layout, find_layout, numeric_cells, pick_columns
from ._limits import check_demand
from ._samples import Column, as_samples

_LOOKED_AT = 500
"""Lines from which separator and heading are found."""

_MOST_LOOKED_AT = 2**18
"""Letters in these lines; of a table with long rows fewer lines are looked at."""

_CELLS_A_ROW = 1024
_LONGEST_LINE = 2**16
"""Bytes of a line: 64 a column."""

_BYTE, _LINE, _NUMBER_BYTES, _TEXT_BYTES = 12, 32, 24, 100
"""Bytes of memory that a byte takes, a line, a cell that is a number, and a cell of a column with texts."""

_SPACES = r"\s+"
_SEPARATORS = (",", ";", "\t", _SPACES)
"""The earlier one is taken where two give equally many numbers."""

_NAMES = {",": "commas", ";": "semicolons", "\t": "tabs", _SPACES: "spaces"}
_NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eEdD][+-]?\d+)?|[+-]?(nan|inf|infinity)", re.IGNORECASE)
_DECIMAL_COMMA = re.compile(r"\s*[+-]?\d+,\d+([eE][+-]?\d+)?\s*")
_MARKS = "#%!"
"""Signs before a heading, as NumPy and other programs write them."""


@dataclass(frozen=True, eq=False)
class TextTable:
    """The cells of a text table.

    Attributes:
        file: The file.
        headings: One a column.
        units: Unit that the file states, one a column, or None.
        cells: Gives a column: numbers, or objects where a cell is text.
        text: The rows of values as they are written.
        first: Lines of the file above them.
        decimal: Decimal sign.
    """

    file: Path
    headings: tuple[str, ...]
    units: tuple[str | None, ...]
    cells: Callable[[int], np.ndarray]
    text: str
    first: int
    decimal: str

    def numbers(self, column: int) -> Float[np.ndarray, " time"] | np.ndarray:
        """Gives a column as numbers, times of day as seconds since the first; an empty cell is NaN.

        Raises:
            ValueError: At the first cell that holds text; names the row, the line and the text.
        """
        cells = self.cells(column)
        if cells.dtype.kind in "iufb":
            return cells
        if self.is_clock(column):
            return self._times(column)
        found = np.full(cells.size, np.nan)
        for index, cell in enumerate(cells):
            if isinstance(cell, str):
                text = cell.strip()
                if not _number_test(self.decimal)(text):
                    raise self._wrong(column, index, f"not a number{self._cause(text)}")
                found[index] = float(re.sub("[dD]", "e", text).replace(self.decimal, "."))
            else:
                found[index] = float(cell)
        return found

    def is_clock(self, column: int) -> bool:
        """Says whether a column starts with a time of day."""
        first = next((cell for cell in self.cells(column) if cell == cell), None)
        return isinstance(first, str) and read_clock(first) is not None

    def _times(self, column: int) -> Float[np.ndarray, " time"]:
        cells = self.cells(column)
        clocks = [read_clock(cell) if isinstance(cell, str) else None for cell in cells]
        for index, (cell, clock) in enumerate(zip(cells, clocks, strict=True)):
            if clock is None and cell == cell:
                raise self._wrong(column, index, "not a time of day as in the rows before")
        return seconds_since_first(clocks)

    def _wrong(self, column: int, index: int, what: str) -> ValueError:
        cell = self.cells(column)[index]
        return ValueError(
            f"{self.file}: column `{self.headings[column]}` holds the text {str(cell)!r} at {row(index)}, "
            f"line {_line(self.text, self.first, index)} of the file, {what}"
        )

    def _cause(self, text: str) -> str:
        if _number_test("," if self.decimal == "." else ".")(text):
            return f"; the other rows have a decimal {'point' if self.decimal == '.' else 'comma'}"
        return ""


def read_text_columns(file: Path, names: Sequence[str] | None) -> dict[str, Column]:
    """Gives the named columns of a text table.

    Args:
        file: The file.
        names: Headings, with or without the unit in them; "[:, 0]", "[:, 1]", ... where the file has none;
            None for all columns of numbers.

    Returns:
        Name to column; an empty cell is NaN.

    Raises:
        ValueError: If the file holds no table, a heading is missing or stands twice, or a cell is no number.
    """
    table = read_table(file)

    def column(i: int) -> Column:
        unit = table.units[i] or ("s" if table.is_clock(i) else None)
        return Column(as_samples(table.numbers(i), file, table.headings[i]), unit=unit)

    return pick_columns(file, names, table.headings, column)


def read_table(file: Path) -> TextTable:
    """Gives the cells of a text table.

    Free lines above the heading are passed over, and a row of units under it is understood. Separators are
    commas, semicolons, tabs or spaces; a decimal comma is one where commas do not separate.

    Raises:
        ValueError: If it is empty, holds no row of numbers, or its rows differ in length.
    """
    check_demand(file, _BYTE * file.stat().st_size)
    raw = file.read_bytes()
    check_demand(file, _BYTE * len(raw) + _LINE * (raw.count(b"\n") + raw.count(b"\r")))
    _check_lines(file, raw)
    text = decoded(raw).replace("\r\n", "\n").replace("\r", "\n")
    del raw
    lines = text.split("\n", 5 * _LOOKED_AT)[: 5 * _LOOKED_AT]
    written = [i for i, line in enumerate(lines) if line.strip()][:_LOOKED_AT]
    length = itertools.accumulate(len(lines[i]) for i in written)
    written = written[: max(sum(one <= _MOST_LOOKED_AT for one in length), 1)]
    if not written:
        raise ValueError(f"{file} is empty; expected a heading and rows of numbers")
    separator, decimal = _dialect([lines[i] for i in written])
    is_number = _number_test(decimal)
    rows = [_cells(lines[i], separator) for i in written]

    def divide(place: int, width: int) -> list[str]:
        return _heading_cells(lines[written[place]], separator, width)

    layout = find_layout(rows, is_number, divide)
    if layout is None:
        raise ValueError(
            f"{file} has a heading but no rows of numbers; expected rows of numbers under "
            f"{lines[written[0]]!r:.80}"
        )
    first = written[layout.first]
    if len(layout.headings) != layout.width:
        raise ValueError(
            f"{file} has {len(layout.headings)} headings but {layout.width} columns of values "
            f"(line {first + 1}); expected one heading a column. Separated by {_NAMES[separator]}; is one of "
            "these within a heading, or is it a decimal comma?"
        )
    values = text[sum(len(line) + 1 for line in lines[:first]) :]
    del text
    table = _parsed(file, values, first, separator, decimal, layout)

    def cells(i: int) -> np.ndarray:
        if table.dtypes.iloc[i].kind not in "iufb":
            check_demand(file, _TEXT_BYTES * len(table))
        return np.asarray(table.iloc[:, i].to_numpy())

    return TextTable(file, layout.headings, layout.units, cells, values, first, decimal)


def _check_lines(file: Path, raw: bytes) -> None:
    """Refuses a line that is longer than a row of values can be, before anything is made of it."""
    signs = np.frombuffer(raw, dtype=np.uint8)
    ends = np.concatenate([[-1], np.flatnonzero((signs == ord("\n")) | (signs == ord("\r"))), [signs.size]])
    length = np.diff(ends) - 1
    at = int(np.argmax(length))
    if length[at] > _LONGEST_LINE:
        raise _lying(file, f"a line from byte {ends[at] + 1} on has {length[at]} bytes")


def _lying(file: Path, found: str) -> ValueError:
    return ValueError(
        f"{file}: {found}; expected a row a sample, of at most {_CELLS_A_ROW} columns and {_LONGEST_LINE} "
        "bytes. Likely cause: the samples of a channel stand in one row; transpose the table, or export "
        "channels as columns"
    )


def decoded(raw: bytes) -> str:
    """Gives the text of a file in UTF-8, UTF-16 or, where it is neither, the Western European code page."""
    if raw.startswith((b"\xff\xfe", b"\xfe\xff")):
        return raw.decode("utf-16", errors="replace")
    head = raw[:4096]
    if head.count(0) > len(head) // 4:
        # Without a mark: the zero bytes of ASCII signs stand at odd places in the little-endian form.
        return raw.decode("utf-16-le" if head[1::2].count(0) > head[::2].count(0) else "utf-16-be", "replace")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("cp1252", errors="replace")


def _dialect(lines: Sequence[str]) -> tuple[str, str]:
    """Gives the separator and the decimal sign with which most cells are numbers, and fewest texts."""
    if len(lines) > 2 and "," not in lines[0] and all(map(_DECIMAL_COMMA.fullmatch, lines[1:])):
        return ";", ","  # a heading of one column, above what would else be two columns of whole numbers
    best, chosen = -math.inf, (",", ".")
    for separator in _SEPARATORS:
        rows = [_cells(line, separator) for line in lines]
        for decimal in (".",) if separator == "," else (".", ","):
            width, which = numeric_cells(rows, _number_test(decimal))
            # Of a wrong separator some pieces are numbers as well, so that texts count against it.
            rows_of_numbers = [one for one in which if one.size == width and np.any(one)]
            found = sum(3 * int(np.count_nonzero(one)) - 2 * one.size for one in rows_of_numbers)
            if width and found > best:
                best, chosen = found, (separator, decimal)
    return chosen


def _number_test(decimal: str) -> Callable[[str], bool]:
    if decimal == ",":
        return lambda cell: "." not in cell and _NUMBER.fullmatch(cell.strip().replace(",", ".")) is not None
    return lambda cell: _NUMBER.fullmatch(cell.strip()) is not None


def _cells(line: str, separator: str) -> list[str]:
    """Gives the cells of a line, without the empty ones at its end."""
    if separator == _SPACES:
        cells = line.split()
    elif '"' not in line:
        cells = line.split(separator)
    else:
        try:
            cells = next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])
        except csv.Error:
            cells = line.split(separator)
    while cells and not cells[-1].strip():
        cells.pop()
    return cells


def _heading_cells(line: str, separator: str, width: int) -> list[str]:
    """Gives the cells of a heading: separated as the numbers are, else in the way that gives as many."""
    line = line.strip("\ufeff").lstrip(" " + _MARKS)
    first = _cells(line, separator)
    if len(first) == width:
        return first
    # "Time [ms]" has a space within a heading; a unit in brackets belongs to the name before it.
    others = [re.split(r"\s+(?=[^\[(])", line.strip()), re.split(r"\s{2,}", line.strip())]
    others += [_cells(line, other) for other in _SEPARATORS]
    return next((cells for cells in others if len(cells) == width), first)


def _line(text: str, first: int, index: int) -> int:
    """Gives the line of the file, from 1 on, in which a row of values stands; empty lines are no rows."""
    written = (i for i, line in enumerate(io.StringIO(text)) if line.strip())
    return first + 1 + next(itertools.islice(written, index, None), 0)


def _parsed(file: Path, text: str, first: int, separator: str, decimal: str, layout: Layout) -> pd.DataFrame:
    head = text.partition("\n")[0]
    count = layout.width if separator == _SPACES else max(layout.width, head.count(separator) + 1)
    if count > _CELLS_A_ROW:
        raise _lying(file, f"line {first + 1} has {count} columns")
    check_demand(file, _BYTE * len(text) + _NUMBER_BYTES * count * (text.count("\n") + 1))
    # pandas takes the number of columns from the first row, which may lack cells.
    full = (" " if separator == _SPACES else separator).join(["0"] * count)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", pd.errors.ParserWarning)
            table = pd.read_csv(
                io.BytesIO(f"{full}\n{text}".encode(errors="replace")),
                sep=separator,
                decimal=decimal,
                header=None,
                skipinitialspace=separator != _SPACES,
                low_memory=False,
                index_col=False,
            )
    except (ValueError, OverflowError, pd.errors.ParserWarning) as error:
        raise _ragged(file, text, first, separator, layout) from error
    table = table.iloc[1:]
    extra = table.iloc[:, layout.width :]
    if table.shape[1] < layout.width or not extra.isna().to_numpy().all():
        raise _ragged(file, text, first, separator, layout)
    return table.iloc[:, : layout.width]


def _ragged(file: Path, text: str, first: int, separator: str, layout: Layout) -> ValueError:
    """Gives the error of a table whose rows differ in length, at the first one that does."""
    rows = (line for line in io.StringIO(text) if line.strip())
    for index, line in enumerate(rows):
        count = len(_cells(line, separator))
        if count > layout.width:
            cause = "a decimal comma, or one comma too many" if separator == "," else "one separator too many"
            return ValueError(
                f"{file} is no table of {layout.width} columns: {row(index)}, line "
                f"{_line(text, first, index)} of the file, has {count} cells, separated by "
                f"{_NAMES[separator]}; expected {layout.width}. Likely cause: {cause}"
            )
    return ValueError(
        f"{file} is no table of {layout.width} columns separated by {_NAMES[separator]}: from line "
        f"{first + 1} on its rows cannot be told apart. Likely cause: a quotation mark that is never closed"
    )
