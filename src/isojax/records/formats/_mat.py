"""MATLAB files up to v7 by SciPy, v7.3 as the HDF5 it is."""

import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from ._hdf5 import read_hdf5_columns
from ._leaves import Leaf, leaf_columns
from ._mat_bounds import check_mat_elements
from ._matlab_object import matlab_object
from ._samples import Column


def read_mat_columns(file: Path, names: Sequence[str] | None) -> dict[str, Column]:
    """Gives the named variables of a .mat file.

    Args:
        file: The file, of any MATLAB version.
        names: Variable names; a field of a struct is "struct.field", of the second struct of an array
            "struct[1].field", a column of a matrix "data[:, 2]", counted from 0. None for all.

    Returns:
        Name to column.

    Raises:
        ValueError: If it is no .mat file, a variable is missing, or one is text, a struct, a cell or a
            matrix.
    """
    import h5py

    if h5py.is_hdf5(file):
        return read_hdf5_columns(file, names)
    wanted = None if names is None else [re.match(r"\w*", name.strip("/ "))[0] for name in names]  # type: ignore[index]
    others = check_mat_elements(file, wanted)
    held = scipy.io.loadmat(file, appendmat=False, variable_names=wanted)
    leaves = [Leaf(name, lambda: None) for name in others]
    leaves += [
        leaf
        for name, value in held.items()
        if not name.startswith("__")
        for leaf in _leaves(file, name, value)
    ]
    return leaf_columns(file, names, leaves)


def _leaves(file: Path, path: str, value: Any) -> Iterator[Leaf]:
    if isinstance(value, scipy.io.matlab.MatlabOpaque):
        yield Leaf(path, _refusal(file, path))
    elif isinstance(value, np.ndarray) and (value.dtype.names or value.dtype == object):
        for i, one in enumerate(value.reshape(-1)):
            place = path if value.size == 1 else f"{path}[{i}]"
            if value.dtype.names:
                for field in value.dtype.names:
                    yield from _leaves(file, f"{place}.{field}", one[field])
            else:
                yield from _leaves(file, place, one)
    else:
        yield Leaf(path, lambda: value)


def _refusal(file: Path, path: str) -> Callable[[], Any]:
    def refuse() -> Any:
        raise matlab_object(file, path)

    return refuse
