"""The directory of a ZIP archive, measured before it is read: .npz, .xlsx, .ods."""

import struct
from pathlib import Path
from typing import BinaryIO

from ._limits import check_demand

_END = b"PK\x05\x06"
_TAIL = 2**16 + 22
"""Bytes at the end of an archive in which the end of its directory lies, behind a comment."""

_ENTRY = 12
"""Bytes of memory a byte of the directory: an entry has 46 bytes and a name."""


def check_directory(file: Path, handle: BinaryIO) -> None:
    """Refuses an archive whose list of members would fill the memory.

    Source: PKWARE, APPNOTE.TXT, 4.3.16: end of central directory record.
    """
    handle.seek(max(0, handle.seek(0, 2) - _TAIL))
    _, mark, end = handle.read(_TAIL).rpartition(_END)
    if mark and len(end) >= 12:
        check_demand(file, _ENTRY * struct.unpack_from("<I", end, 8)[0])
