"""How large a spreadsheet becomes, seen before it is read: its reader makes a cell of every empty place."""

import copy
import re
import zipfile
import zlib
from pathlib import Path

from ._unreadable import unreadable

MOST_CELLS = 2**25
"""Cells of all sheets: all rows of one, of 32 columns."""

MOST_TEXT = 2**30
"""Bytes of all XML: some 32 a cell."""

_PIECE = 2**20
_PLACE = re.compile(rb"\sr=[\"']([A-Z]{1,3})([0-9]{1,7})[\"']")
_CELL = re.compile(rb"<(?:\w+:)?c[\s/>]")


def check_sheets(file: Path) -> None:
    """Refuses a spreadsheet that its reader would unpack to more than a table of samples can be.

    Every part is unpacked once, whatever its name and whatever size the directory of the archive states: the
    reader believes neither.

    Args:
        file: The file; what is no ZIP archive is left to the reader.

    Raises:
        ValueError: If a part is damaged or too large, or the cells are too many or lie too far apart.
    """
    if not zipfile.is_zipfile(file):
        return  # the reader says what is wrong
    try:
        with zipfile.ZipFile(file) as archive:
            size, cells = 0, 0
            for part in archive.infolist():
                own = _check_part(file, archive, part, size, cells)
                size, cells = size + own[0], cells + own[1]
    except (zipfile.BadZipFile, zlib.error, OSError, EOFError, NotImplementedError, RuntimeError) as error:
        raise unreadable(file, "a spreadsheet", error) from error


def _check_part(
    file: Path, archive: zipfile.ZipFile, part: zipfile.ZipInfo, before: int, others: int
) -> tuple[int, int]:
    """Gives the bytes and the cells of a part, which with those before it must not be too many."""
    _check_text(file, part, before + part.file_size)
    own = copy.copy(part)
    own.file_size = MOST_TEXT + 1
    own.CRC = None  # type: ignore[assignment]  # of what the directory states; `None` is not compared
    count, rows, columns, size, tail = 0, 0, 0, 0, b""
    with archive.open(own) as handle:
        while chunk := handle.read(_PIECE):
            size += len(chunk)
            _check_text(file, part, before + size)
            text = tail + chunk
            places = _PLACE.findall(text)
            count += len(_CELL.findall(text))
            rows = max([rows, *(int(number) for _, number in places)])
            columns = max([columns, *(_column(letters) for letters in {one for one, _ in places})])
            tail = chunk[-32:]
    cells = max(count, rows * columns)
    if others + cells > MOST_CELLS:
        reach = f"reaches to row {rows} and column {columns}" if rows else f"has {count} cells"
        raise ValueError(
            f"{file}: its sheet {part.filename} {reach}; expected at most "
            f"{MOST_CELLS} cells. Likely cause: a stray entry far from the table; delete the empty rows and "
            "columns, or export it as .csv"
        )
    return size, cells


def _check_text(file: Path, part: zipfile.ZipInfo, size: int) -> None:
    if size > MOST_TEXT:
        raise ValueError(
            f"{file}: its sheet {part.filename} has {size / 1e9:.3g} GB, unpacked; expected at "
            f"most {MOST_TEXT / 1e9:.3g} GB. Export the record as .csv or .parquet; if it should be "
            "small, it is damaged"
        )


def _column(letters: bytes) -> int:
    """Gives the number of a column: A is 1, AA is 27."""
    number = 0
    for one in letters:
        number = 26 * number + one - ord("A") + 1
    return number
