"""NumPy archives."""

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ._archive import check_directory
from ._leaves import Leaf, leaf_columns
from ._limits import SAMPLE, check_count
from ._samples import Column


def read_npz_columns(file: Path, names: Sequence[str] | None) -> dict[str, Column]:
    """Gives the named arrays of an .npz archive; "data[:, 2]" is a column of a matrix.

    Raises:
        ValueError: If it is no archive, an array is missing, or one is not a row or column of real numbers.
    """
    with file.open("rb") as handle:  # NumPy leaves a file open that it cannot read
        if handle.read(6) == np.lib.format.MAGIC_PREFIX:
            raise ValueError(f"{file} holds a single array without a name; expected a NumPy .npz archive")
        check_directory(file, handle)
        handle.seek(0)
        with np.load(handle, allow_pickle=False) as archive:
            check_count(file, len(archive.files))
            leaves = [
                Leaf(name, _reader(file, archive, name), size=_memory(archive, name))
                for name in archive.files
            ]
            return leaf_columns(file, names, leaves)


def _memory(archive: Any, name: str) -> int:
    """Gives the bytes that an array takes, by its header; without one, by the archive's directory."""
    member = name if name in archive.zip.NameToInfo else f"{name}.npy"
    try:
        with archive.zip.open(member) as packed:
            major, _ = np.lib.format.read_magic(packed)
            read = np.lib.format.read_array_header_1_0 if major == 1 else np.lib.format.read_array_header_2_0
            shape, _, dtype = read(packed)
        return math.prod(shape) * max(SAMPLE, 2 * dtype.itemsize)
    except Exception:  # `_reader` says what is wrong, if the array is wanted
        return archive.zip.getinfo(member).file_size


def _reader(file: Path, archive: Any, name: str) -> Callable[[], Any]:
    def read() -> np.ndarray:
        try:
            return archive[name]
        except Exception as error:  # zipfile, zlib and NumPy raise a dozen kinds on a broken file
            raise ValueError(f"{file}: array `{name}` cannot be read as numbers: {error}") from error

    return read
