"""HDF5 files, and MATLAB v7.3 files, which are HDF5 with MATLAB's class written on each dataset."""

from collections.abc import Sequence
from pathlib import Path

import h5py
import numpy as np

from .._wording import listing
from ._samples import Column, as_samples, missing_column


def read_hdf5_columns(file: Path, names: Sequence[str]) -> dict[str, Column]:
    """Gives the named datasets of an HDF5 file.

    Args:
        file: The file.
        names: Paths of datasets, with or without the leading slash.

    Returns:
        Name to column.

    Raises:
        ValueError: If it is not HDF5, a dataset is missing, or one is a group, text or a matrix.
    """
    try:
        handle = h5py.File(file, "r")
    except OSError as error:
        raise ValueError(f"{file} cannot be read as HDF5: {error}") from error
    with handle:
        return {name: Column(as_samples(_dataset(handle, file, name), file, name)) for name in names}


def _dataset(handle: h5py.File, file: Path, name: str) -> np.ndarray:
    found = handle.get(name)
    if found is None:
        present: list[str] = []
        handle.visititems(lambda path, node: present.append(path) if isinstance(node, h5py.Dataset) else None)
        raise missing_column(file, name, [path for path in present if not path.startswith("#")])
    if not isinstance(found, h5py.Dataset):
        inside = listing(f"{name}/{key}" for key in found) if isinstance(found, h5py.Group) else "no numbers"
        raise ValueError(
            f"{file}: `{name}` is a group or struct, not a dataset of numbers; it holds {inside}"
        )
    matlab = found.attrs.get("MATLAB_class", b"")
    matlab = matlab.decode() if isinstance(matlab, bytes) else str(matlab)
    if matlab in ("char", "cell", "struct", "logical", "function_handle", "string"):
        raise ValueError(f"{file}: `{name}` is a MATLAB {matlab}; expected one row or column of real numbers")
    if "MATLAB_empty" in found.attrs:
        raise ValueError(f"{file}: column `{name}` is empty; expected one row or column of numbers")
    return np.asarray(found[()])
