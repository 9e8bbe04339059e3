"""CSV: comma, semicolon or tab, decimal point or comma, byte-order mark, heading behind "#" as NumPy writes
it.
"""

import csv
import re
import warnings
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from .._wording import row
from ._samples import Column, as_samples, missing_column


def read_csv_columns(file: Path, names: Sequence[str]) -> dict[str, Column]:
    """Gives the named columns of a CSV file.

    Args:
        file: The file.
        names: Headings.

    Returns:
        Name to column; an empty cell is NaN.

    Raises:
        ValueError: If the file is empty, a heading is missing or stands twice, or a cell is not a number.
    """
    present, cells = read_table(file)
    columns = {}
    for name in names:
        if name not in present:
            raise missing_column(file, name, present)
        if present.count(name) > 1:
            raise ValueError(
                f"{file}: the heading `{name}` stands {present.count(name)} times; expected once"
            )
        columns[name] = Column(as_samples(numbers(cells[present.index(name)], file, name), file, name))
    return columns


def read_table(file: Path) -> tuple[list[str], list[np.ndarray]]:
    """Gives the headings of a CSV file, and for each its cells: numbers, or objects where one is text.

    Raises:
        ValueError: If it is empty, holds no row, or its rows differ in length.
    """
    raw = file.read_bytes()
    encoding = "utf-8-sig" if _is_utf8(raw) else "latin-1"
    lines = raw[:65536].decode(encoding, errors="ignore").splitlines()
    head = [line for line in lines if line.strip()]
    if not head:
        raise ValueError(f"{file} is empty; expected a heading and rows of numbers")
    comments = 0
    while comments < len(head) and head[comments].lstrip().startswith("#"):
        comments += 1
    behind_hash = comments > 0 and (comments == len(head) or _is_numeric(head[comments]))
    heading = head[comments - 1].lstrip().lstrip("#") if behind_hash else head[comments]
    first = head[comments + (0 if behind_hash else 1) :][:1]
    separator = max(",;\t", key=heading.count)
    decimal = "," if separator != "," and first and re.search(r"\d,\d", first[0]) else "."
    titles = [title.strip() for title in next(csv.reader([heading], delimiter=separator))]
    skip = lines.index(head[comments - 1] if behind_hash else head[comments]) + 1
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", pd.errors.ParserWarning)
            table = pd.read_csv(
                file,
                sep=separator,
                decimal=decimal,
                header=None,
                skiprows=skip,
                encoding=encoding,
                skipinitialspace=True,
                low_memory=False,
                index_col=False,
            )
    except pd.errors.EmptyDataError as error:
        raise ValueError(f"{file} has a heading but no rows; expected rows of numbers") from error
    except (pd.errors.ParserError, pd.errors.ParserWarning, UnicodeDecodeError) as error:
        raise ValueError(f"{file} is no table of {len(titles)} columns: {error}") from error
    if table.shape[1] > len(titles) and table.iloc[:, len(titles) :].isna().to_numpy().all():
        table = table.iloc[:, : len(titles)]
    if table.shape[1] != len(titles):
        raise ValueError(f"{file} has {len(titles)} headings but {table.shape[1]} columns of values")
    return titles, [table.iloc[:, i].to_numpy() for i in range(len(titles))]


def numbers(cells: np.ndarray, file: Path, name: str) -> np.ndarray:
    """Gives a column of cells as numbers; an empty cell is NaN.

    Raises:
        ValueError: At the first cell that holds text; names the row and the text.
    """
    if cells.dtype.kind in "iufb":
        return cells
    for index, cell in enumerate(cells):
        if isinstance(cell, str) and not _is_numeric(cell):
            raise ValueError(f"{file}: column `{name}` holds the text {cell!r} at {row(index)}, not a number")
    return np.array([float(cell) for cell in cells])


def _is_utf8(raw: bytes) -> bool:
    try:
        raw.decode("utf-8")
    except UnicodeDecodeError:
        return False
    return True


def _is_numeric(line: str) -> bool:
    try:
        return len([float(cell) for cell in re.split(r"[,;\t]", line.strip()) if cell.strip()]) > 0
    except ValueError:
        return False
