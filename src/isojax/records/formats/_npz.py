"""NumPy archives."""

import zipfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ._leaves import Leaf, leaf_columns
from ._samples import Column


def read_npz_columns(file: Path, names: Sequence[str] | None) -> dict[str, Column]:
    """Gives the named arrays of an .npz archive; "data[:, 2]" is a column of a matrix.

    Raises:
        ValueError: If it is no archive, an array is missing, or one is not a row or column of real numbers.
    """
    try:
        archive = np.load(file, allow_pickle=False)
    except (zipfile.BadZipFile, ValueError, EOFError, OSError) as error:
        raise ValueError(f"{file} cannot be read as a NumPy .npz archive: {error}") from error
    if not isinstance(archive, np.lib.npyio.NpzFile):
        raise ValueError(f"{file} holds a single array without a name; expected a NumPy .npz archive")

    def reader(name: str) -> Callable[[], Any]:
        def read() -> np.ndarray:
            try:
                return archive[name]
            except (ValueError, zipfile.BadZipFile, EOFError, OSError) as error:
                raise ValueError(f"{file}: array `{name}` cannot be read as numbers: {error}") from error

        return read

    with archive:
        return leaf_columns(file, names, [Leaf(name, reader(name)) for name in archive.files])
