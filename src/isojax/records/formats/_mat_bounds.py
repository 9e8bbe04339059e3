"""What the data elements of a MAT file of version 5 announce, seen before SciPy makes anything of them."""

import struct
import zlib
from pathlib import Path

from ._limits import check_count, check_levels, check_size

_MATRIX, _COMPRESSED = 14, 15
_HEADER = 128
_NESTING = (1, 2, 3)
"""Classes of arrays that hold others: cells, structures, objects."""

_CLASS_AT = 16
"""Place of the class within an array's element: after two tags of 8 bytes."""


def check_mat_elements(file: Path) -> None:
    """Refuses a MAT file that unpacks to too much, or whose structures are too many or nested too deep.

    SciPy allocates what an element announces, and follows nested structures down the stack of the process,
    which it overruns. A file of another version is left to SciPy.

    Args:
        file: The file.

    Raises:
        ValueError: If it exceeds the bounds.

    Source: MathWorks, "MAT-File Format", chapter 1: level 5 data elements.
    """
    raw = memoryview(file.read_bytes())
    order = {b"IM": "<", b"MI": ">"}.get(bytes(raw[126:_HEADER]))
    if order is None:
        return
    total, arrays, place = 0, 0, _HEADER
    while place + 8 <= len(raw):
        kind, size = struct.unpack_from(f"{order}II", raw, place)
        element, place = raw[place : place + 8 + size], place + 8 + size
        if kind == _COMPRESSED:
            head = _unpacked(element[8:], 64)
            size = struct.unpack_from(f"{order}II", head)[1] if len(head) >= 8 else 0
        else:
            head = bytes(element[:64])
        total += size
        check_size(file, total)
        if (
            len(head) > _CLASS_AT + 4
            and struct.unpack_from(f"{order}I", head, _CLASS_AT)[0] & 0xFF in _NESTING
        ):
            whole = _unpacked(element[8:], size + 8) if kind == _COMPRESSED else element
            levels, count = _levels(memoryview(whole), order)
            check_levels(file, levels)
            arrays += count
            check_count(file, arrays)


def _unpacked(packed: memoryview, most: int) -> bytes:
    try:
        return zlib.decompressobj().decompress(packed, most)
    except zlib.error:
        return b""  # SciPy says what is wrong


def _levels(element: memoryview, order: str) -> tuple[int, int]:
    """Gives how deep arrays are nested in each other, and how many there are."""
    place, ends, deepest, count = 0, [len(element)], 0, 0
    while place + 8 <= len(element):
        while ends and place >= ends[-1]:
            ends.pop()
        kind, size = struct.unpack_from(f"{order}II", element, place)
        place += 8
        if kind == _MATRIX:
            ends.append(place + size)
            deepest, count = max(deepest, len(ends) - 1), count + 1
        elif kind <= 0xFFFF:  # else a small element, whose data stand in its tag
            place += size + -size % 8
    return deepest, count
