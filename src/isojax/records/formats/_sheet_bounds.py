"""How large a spreadsheet becomes, seen before it is read: its reader makes a cell of every empty place."""

import re
import zipfile
import zlib
from pathlib import Path

MOST_CELLS = 2**25
"""Cells of a sheet: all of its rows, of 32 columns."""

MOST_TEXT = 2**30
"""Bytes of a sheet's XML: some 32 a cell."""

_PIECE = 2**20
_PLACE = re.compile(rb"\sr=[\"']([A-Z]{1,3})([0-9]{1,7})[\"']")


def check_sheets(file: Path) -> None:
    """Refuses a spreadsheet that its reader would unpack to more than a table of samples can be.

    Args:
        file: The file; what is no ZIP archive is left to the reader.

    Raises:
        ValueError: If the XML of a sheet is too large, or its cells lie too far apart.
    """
    try:
        with zipfile.ZipFile(file) as archive:
            for part in archive.infolist():
                if part.filename.endswith(".xml"):
                    _check_part(file, archive, part)
    except (zipfile.BadZipFile, zlib.error, OSError, EOFError, NotImplementedError, RuntimeError):
        return  # the reader says what is wrong


def _check_part(file: Path, archive: zipfile.ZipFile, part: zipfile.ZipInfo) -> None:
    if part.file_size > MOST_TEXT:
        raise ValueError(
            f"{file}: its sheet {part.filename} has {part.file_size / 1e9:.3g} GB, unpacked; expected at "
            f"most {MOST_TEXT / 1e9:.3g} GB. Export the record as .csv or .parquet; if it should be "
            "small, it is damaged"
        )
    rows, columns, tail = 1, 1, b""
    with archive.open(part) as handle:
        while chunk := handle.read(_PIECE):
            text = tail + chunk
            places = _PLACE.findall(text)
            rows = max([rows, *(int(number) for _, number in places)])
            columns = max([columns, *(_column(letters) for letters in {one for one, _ in places})])
            tail = chunk[-32:]
    if rows * columns > MOST_CELLS:
        raise ValueError(
            f"{file}: its sheet {part.filename} reaches to row {rows} and column {columns}; expected at most "
            f"{MOST_CELLS} cells. Likely cause: a stray entry far from the table; delete the empty rows and "
            "columns, or export it as .csv"
        )


def _column(letters: bytes) -> int:
    """Gives the number of a column: A is 1, AA is 27."""
    number = 0
    for one in letters:
        number = 26 * number + one - ord("A") + 1
    return number
