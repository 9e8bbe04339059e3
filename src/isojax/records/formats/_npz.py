"""NumPy archives."""

import zipfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ._leaves import Leaf, leaf_columns
from ._samples import Column
from ._unreadable import unreadable


def read_npz_columns(file: Path, names: Sequence[str] | None) -> dict[str, Column]:
    """Gives the named arrays of an .npz archive; "data[:, 2]" is a column of a matrix.

    Raises:
        ValueError: If it is no archive, an array is missing, or one is not a row or column of real numbers.
    """
    with file.open("rb") as handle:  # NumPy leaves a file open that it cannot read
        try:
            archive = np.load(handle, allow_pickle=False)
        except Exception as error:  # zipfile and NumPy raise a dozen kinds on a broken file
            raise unreadable(file, "a NumPy .npz archive", error) from error
        if not isinstance(archive, np.lib.npyio.NpzFile):
            raise ValueError(f"{file} holds a single array without a name; expected a NumPy .npz archive")
        with archive, zipfile.ZipFile(handle) as members:
            sizes = {one.filename.removesuffix(".npy"): one.file_size for one in members.infolist()}
            leaves = [
                Leaf(name, _reader(file, archive, name), size=sizes.get(name, 0)) for name in archive.files
            ]
            return leaf_columns(file, names, leaves)


def _reader(file: Path, archive: Any, name: str) -> Callable[[], Any]:
    def read() -> np.ndarray:
        try:
            return archive[name]
        except Exception as error:  # zipfile, zlib and NumPy raise a dozen kinds on a broken file
            raise ValueError(f"{file}: array `{name}` cannot be read as numbers: {error}") from error

    return read
