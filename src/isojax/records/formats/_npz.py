"""NumPy archives."""

import zipfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ._samples import Column, as_samples, missing_column


def read_npz_columns(file: Path, names: Sequence[str]) -> dict[str, Column]:
    """Gives the named arrays of an .npz archive.

    Raises:
        ValueError: If it is no archive, an array is missing, or one is not a row or column of real numbers.
    """
    try:
        archive = np.load(file, allow_pickle=False)
    except (zipfile.BadZipFile, ValueError, EOFError, OSError) as error:
        raise ValueError(f"{file} cannot be read as a NumPy .npz archive: {error}") from error
    if not isinstance(archive, np.lib.npyio.NpzFile):
        raise ValueError(f"{file} holds a single array without a name; expected a NumPy .npz archive")
    with archive:
        columns = {}
        for name in names:
            if name not in archive.files:
                raise missing_column(file, name, archive.files)
            try:
                values = archive[name]
            except (ValueError, zipfile.BadZipFile, EOFError, OSError) as error:
                raise ValueError(f"{file}: array `{name}` cannot be read as numbers: {error}") from error
            columns[name] = Column(as_samples(values, file, name))
    return columns
