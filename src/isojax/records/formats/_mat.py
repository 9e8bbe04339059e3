"""MATLAB files up to v7 by SciPy, v7.3 as the HDF5 it is."""

from collections.abc import Sequence
from pathlib import Path

import h5py
import scipy.io

from ._hdf5 import read_hdf5_columns
from ._samples import Column, as_samples, missing_column


def read_mat_columns(file: Path, names: Sequence[str]) -> dict[str, Column]:
    """Gives the named variables of a .mat file.

    Args:
        file: The file, of any MATLAB version.
        names: Variable names; in v7.3 a field of a struct is "struct/field".

    Returns:
        Name to column.

    Raises:
        ValueError: If it is no .mat file, a variable is missing, or one is text, a struct, a cell or a
            matrix.
    """
    if h5py.is_hdf5(file):
        return read_hdf5_columns(file, names)
    try:
        held = scipy.io.loadmat(file, appendmat=False)
    except Exception as error:  # SciPy raises TypeError, ValueError, zlib.error, ... on a broken file
        raise ValueError(f"{file} cannot be read as a MATLAB .mat file: {error}") from error
    present = [name for name in held if not name.startswith("__")]
    columns = {}
    for name in names:
        if name not in present:
            raise missing_column(file, name, present)
        columns[name] = Column(as_samples(held[name], file, name))
    return columns
