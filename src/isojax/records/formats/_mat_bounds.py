"""What the data elements of a MAT file of version 5 announce, seen before SciPy makes anything of them."""

import math
import struct
import zlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from ._limits import SAMPLE, check_count, check_demand, check_levels

_MATRIX, _COMPRESSED = 14, 15
_HEADER = 128
_HEAD = 512
"""Bytes of an element in which the class, the dimensions and the name of its array stand."""

_NESTING = (1, 2, 3)
"""Classes of arrays that hold others: cells, structures, objects."""

_FULL = (4, *range(6, 16))
"""Classes of arrays with a number or letter for each place: all but sparse ones and objects."""

_OBJECT = 1000
"""Bytes of memory that an array takes beside its numbers."""


class _Array(NamedTuple):
    levels: int
    kind: int
    name: str
    numbers: int


def check_mat_elements(file: Path, wanted: Sequence[str] | None) -> list[str]:
    """Refuses a MAT file whose wanted variables take too much, or are too many or nested too deep.

    SciPy allocates what an element announces, and follows nested structures down the stack of the process,
    which it overruns. A file of another version is not packed, and left to SciPy.

    Args:
        file: The file.
        wanted: Variables that are to be read; None for all.

    Returns:
        The variables that are not.

    Raises:
        ValueError: If it exceeds the bounds.

    Source: MathWorks, "MAT-File Format", chapter 1: level 5 data elements.
    """
    check_demand(file, file.stat().st_size)
    raw = memoryview(file.read_bytes())
    order = {b"IM": "<", b"MI": ">"}.get(bytes(raw[126:_HEADER]))
    if order is None:
        check_demand(file, SAMPLE * len(raw))
        return []
    others: list[str] = []
    memory, arrays, place = float(len(raw)), 0, _HEADER
    while place + 8 <= len(raw):
        kind, size = struct.unpack_from(f"{order}II", raw, place)
        element, place = raw[place : place + 8 + size], place + 8 + size
        arrays += 1
        check_count(file, arrays)
        head = _unpacked(element[8:], _HEAD) if kind == _COMPRESSED else bytes(element[:_HEAD])
        first = next(_arrays(file, memoryview(head), order), None)
        if first is None:
            continue
        if wanted is not None and first.name not in wanted:
            others.append(first.name)
            continue
        if kind == _COMPRESSED:
            size = struct.unpack_from(f"{order}II", head)[1]
        memory += 2 * size
        check_demand(file, memory)
        held: Iterator[_Array] = iter((first,))
        if first.kind in _NESTING:
            whole = _unpacked(element[8:], size + 8) if kind == _COMPRESSED else element
            held = _arrays(file, memoryview(whole), order)
        for one in held:
            arrays, memory = arrays + 1, memory + _OBJECT + SAMPLE * one.numbers
            check_levels(file, one.levels)
            check_count(file, arrays)
        check_demand(file, memory)
    return others


def _unpacked(packed: memoryview, most: int) -> bytes:
    try:
        return zlib.decompressobj().decompress(packed, most)
    except zlib.error:
        return b""  # SciPy says what is wrong


def _arrays(file: Path, element: memoryview, order: str) -> Iterator[_Array]:
    """Gives the arrays of an element, each before those within it."""
    place, steps, ends = 0, 0, [len(element)]
    while place + 8 <= len(element):
        while ends and place >= ends[-1]:
            ends.pop()
        kind, size = struct.unpack_from(f"{order}II", element, place)
        place, steps = place + 8, steps + 1
        check_count(file, steps // 8)  # an array has six elements of its own
        if kind == _MATRIX:
            ends.append(place + size)
            try:
                yield _Array(len(ends) - 1, *_described(element, place, order))
            except struct.error:
                return  # cut short; SciPy says so
        elif kind <= 0xFFFF:  # else a small element, whose data stand in its tag
            place += size + -size % 8


def _described(element: memoryview, place: int, order: str) -> tuple[int, str, int]:
    """Gives class, name and count of numbers of the array whose elements start at a place."""
    kind = struct.unpack_from(f"{order}I", element, place + 8)[0] & 0xFF
    (size,) = struct.unpack_from(f"{order}I", element, place + 20)
    sides = struct.unpack_from(f"{order}{min(size // 4, 64)}I", element, place + 24)
    place += 24 + size + -size % 8
    small, length = struct.unpack_from(f"{order}II", element, place)
    place, length = (place + 4, small >> 16) if small >> 16 else (place + 8, length)
    name = bytes(element[place : place + min(length, _HEAD)]).decode(errors="replace")
    return kind, name, math.prod(sides) if kind in _FULL else 0
