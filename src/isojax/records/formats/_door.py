"""The door of a file: what is refused before a reader sees it, and whose errors leave the reader."""

import contextlib
import os
import stat
import warnings
from collections.abc import Iterator
from pathlib import Path

from ._unreadable import unreadable

_KINDS = {
    stat.S_ISDIR: "a folder",
    stat.S_ISFIFO: "a pipe",
    stat.S_ISSOCK: "a socket",
    stat.S_ISCHR: "a device",
    stat.S_ISBLK: "a device",
}


def file_size(file: Path) -> int | None:
    """Gives the bytes of a file, or None where there is none; a link stands for the file that it leads to.

    Raises:
        ValueError: If it is a folder, a pipe, a socket or a device.
    """
    try:
        found = os.stat(file)
    except (OSError, ValueError):  # missing, too long, not allowed, a zero byte in the name
        return None
    for is_kind, words in _KINDS.items():
        if is_kind(found.st_mode):
            raise ValueError(f"{file} is {words}; expected one file on a disk")
    return found.st_size


@contextlib.contextmanager
def door(file: Path, what: str) -> Iterator[None]:
    """Turns whatever a reading package raises into one error that names the file, and hides its warnings.

    Args:
        file: The file.
        what: What it should be, such as "a Parquet file".

    Raises:
        ValueError: In place of every other exception, and of a ValueError that does not name the file.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    except Exception as error:
        if isinstance(error, ValueError) and str(error).startswith((str(file), "Environment variable")):
            raise
        raise unreadable(file, what, error) from error
