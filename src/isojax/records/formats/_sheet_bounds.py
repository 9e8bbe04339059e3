"""How large a spreadsheet becomes, seen before it is read: its reader makes a cell of every empty place."""

import copy
import functools
import re
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from ._archive import check_directory
from ._limits import check_count, check_demand

_CELL = 64
"""Bytes of memory a cell."""

_PIECE = 2**20
"""Bytes that are unpacked at a time; no tag and no text between two tags is longer."""

_TAG = re.compile(rb"<(?:\w+:)?(?:table-)?(row|cell|c|si)(?=[\s/>])([^>]*)")
_PLACE = re.compile(rb"\sr=[\"']([A-Z]{1,3})([0-9]{1,7})[\"']")
_REPEATED = re.compile(rb"-repeated=[\"']([0-9]{1,9})[\"']")


@dataclass
class _Counted:
    """What the tags of a spreadsheet add up to, so far.

    Attributes:
        size: Bytes, unpacked.
        others: Cells of the parts before this one.
        rows: Rows of this part, to the last one that holds a value.
        columns: Columns of this part, likewise.
        cells: Cells that are written out in this part.
        texts: Cells that hold a text, each as often as it is repeated.
        longest: Bytes of the longest text.
    """

    size: int = 0
    others: int = 0
    rows: int = 0
    columns: int = 0
    cells: int = 0
    texts: int = 0
    longest: int = 0
    _row: int = 0
    _repeat: int = 1
    _column: int = 0
    _text_at: int | None = None

    @property
    def places(self) -> int:
        """Cells that the reader makes."""
        return self.others + max(self.cells, self.rows * self.columns)

    def begin_part(self) -> None:
        """Begins to count rows and columns anew."""
        self._end_text(self.size)
        self.others, self.rows, self.columns, self.cells, self._row = self.places, 0, 0, 0, 0

    def add(self, piece: bytes) -> None:
        """Counts the tags of a piece, which ends where a tag begins."""
        for tag in _TAG.finditer(piece):
            name, attributes = tag.groups()
            at = self.size + tag.start()
            self._end_text(at)
            repeated = _REPEATED.search(attributes)
            times = int(repeated[1]) if repeated else 1
            if name == b"row":
                self._row, self._repeat, self._column = self._row + times, times, 0
            elif name == b"si":
                self._text_at = at
            else:
                self._add_cell(name, attributes, times, at)
        self.size += len(piece)

    def _add_cell(self, name: bytes, attributes: bytes, times: int, at: int) -> None:
        self.cells, self._column = self.cells + 1, self._column + times
        place = _PLACE.search(attributes)
        if place:
            self._row, self._column = int(place[2]), _column(place[1])
        if name == b"cell" and b"value" not in attributes:
            return  # an empty place of an OpenDocument sheet, which counts if a value follows
        self.rows, self.columns = max(self.rows, self._row), max(self.columns, self._column)
        if name == b"cell":
            self._text_at = at
        if b"string" in attributes or re.search(rb"\st=[\"']s[\"']", attributes):
            self.texts += times * self._repeat

    def _end_text(self, at: int) -> None:
        if self._text_at is not None:
            self.longest, self._text_at = max(self.longest, at - self._text_at), None


def check_sheets(file: Path) -> None:
    """Refuses a spreadsheet that its reader would unpack to more than a table of samples can be.

    Every part is unpacked once, whatever its name and whatever size the directory of the archive states: the
    reader believes neither.

    Args:
        file: The file; what is no ZIP archive is left to the reader.

    Raises:
        ValueError: If the parts are too large, or the cells too many or too far apart.
    """
    if not zipfile.is_zipfile(file):
        return  # the reader says what is wrong
    counted = _Counted()
    with file.open("rb") as handle:
        check_directory(file, handle)
        with zipfile.ZipFile(handle) as archive:
            check_count(file, len(archive.infolist()))
            for member in archive.infolist():
                for piece in _pieces(file, archive, member):
                    counted.add(piece)
                    _check_counted(file, counted)
                counted.begin_part()
    _check_counted(file, counted)


def _check_counted(file: Path, counted: _Counted) -> None:
    memory = _CELL * counted.places + counted.texts * counted.longest
    check_demand(
        file,
        memory,
        counted.size,
        f"A sheet reaches to row {counted.rows} and column {counted.columns}; all have {counted.places} "
        "cells. Likely cause: a stray entry far from the table; delete the empty rows and columns",
    )


def _pieces(file: Path, archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> Iterator[bytes]:
    """Gives a part unpacked, in pieces that end where a tag begins."""
    own = copy.copy(member)
    own.file_size = 2**62
    own.CRC = None  # type: ignore[assignment]  # of what the directory states; `None` is not compared
    tail = b""
    with archive.open(own) as handle:
        while chunk := handle.read(_PIECE):
            text = tail + chunk
            cut = text.rfind(b"<")
            cut = len(text) if cut < 0 else cut  # no XML: a picture, for one
            yield text[:cut]
            tail = text[cut:]
            if len(tail) > _PIECE:
                raise ValueError(
                    f"{file}: its part {member.filename} has a text of more than {_PIECE} bytes; expected "
                    "a table of samples"
                )
    yield tail


def _column(letters: bytes) -> int:
    """Gives the number of a column: A is 1, AA is 27."""
    return functools.reduce(lambda number, one: 26 * number + one - ord("A") + 1, letters, 0)
