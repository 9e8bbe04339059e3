"""HDF5 files, and MATLAB v7.3 files, which are HDF5 with MATLAB's class written on each dataset."""

import itertools
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ._leaves import Leaf, leaf_columns
from ._limits import check_count, check_levels
from ._matlab_object import matlab_object
from ._samples import Column
from ._unreadable import unreadable

_UNIT_NAMES = ("unit", "units", "Unit", "Units", "unit_str", "unit_string")


def read_hdf5_columns(file: Path, names: Sequence[str] | None) -> dict[str, Column]:
    """Gives the named datasets of an HDF5 file.

    Args:
        file: The file.
        names: Paths of datasets, with or without the leading slash, of a matrix as "path[:, 2]"; None for
            all.

    Returns:
        Name to column, with the unit that an attribute states.

    Raises:
        ValueError: If it is not HDF5, a dataset is missing, or one is a group, text or a matrix.
    """
    import h5py

    try:
        handle = h5py.File(file, "r")
    except OSError as error:
        raise unreadable(file, "HDF5", error) from error
    with handle:
        try:
            leaves = list(_leaves(file, "", handle, (), itertools.count(1)))
            return leaf_columns(file, names, leaves)
        except (OSError, RuntimeError, KeyError, TypeError, MemoryError) as error:  # h5py, on a broken file
            raise unreadable(file, "HDF5", error) from error


def _leaves(
    file: Path, path: str, node: Any, above: tuple[Any, ...], visited: Iterator[int]
) -> Iterator[Leaf]:
    """Gives the leaves under a node.

    Args:
        file: For errors.
        path: Name of the node.
        node: The node.
        above: Nodes that it lies in; a link back to one of them is passed over.
        visited: Counts the nodes.
    """
    import h5py

    if node in above:
        return
    check_levels(file, len(above))
    check_count(file, next(visited))
    above = (*above, node)
    if isinstance(node, h5py.Group):
        point = "." if "MATLAB_class" in node.attrs else "/"
        for name in map(str, node):
            if not name.startswith("#"):  # where MATLAB keeps what its cells and structs refer to
                inside = f"{path}{point}{name}" if path else name
                yield from _leaves(file, inside, node.get(name), above, visited)
    elif isinstance(node, h5py.Dataset):
        if node.dtype == h5py.ref_dtype:
            # The field of an array of structs, and a cell array: a list of references.
            parent, _, field = path.rpartition(".")
            cell = _matlab_class(node) == "cell" or not parent
            for i, reference in enumerate(np.asarray(node[()]).reshape(-1)):
                if reference:
                    place = f"{path}[{i}]" if cell else f"{parent}[{i}].{field}"
                    yield from _leaves(file, place, node.file[reference], above, visited)
        elif node.dtype.names:
            for field in node.dtype.names:
                yield Leaf(f"{path}.{field}", _field(node, field), size=_float64_bytes(node))
        else:
            yield Leaf(path, _reader(file, path, node), _unit(node), _float64_bytes(node))


def _field(node: Any, field: str) -> Callable[[], Any]:
    return lambda: node[field]


def _reader(file: Path, path: str, node: Any) -> Callable[[], Any]:
    def read() -> np.ndarray:
        matlab = _matlab_class(node)
        if matlab in ("char", "cell", "struct", "logical", "function_handle"):
            raise ValueError(
                f"{file}: `{path}` is a MATLAB {matlab}; expected one row or column of real numbers"
            )
        if "MATLAB_object_decode" in node.attrs:
            raise matlab_object(file, path)
        if "MATLAB_empty" in node.attrs:
            raise ValueError(f"{file}: column `{path}` is empty; expected one row or column of numbers")
        values = np.asarray(node[()])
        return values.T if matlab else values  # MATLAB writes columns first

    return read


def _float64_bytes(node: Any) -> int:
    return 8 * int(node.size or 0)


def _matlab_class(node: Any) -> str:
    found = node.attrs.get("MATLAB_class", b"")
    return found.decode() if isinstance(found, bytes) else str(found)


def _unit(node: Any) -> str | None:
    found = next((node.attrs[name] for name in _UNIT_NAMES if name in node.attrs), None)
    found = found.decode(errors="replace") if isinstance(found, bytes) else found
    return found.strip() or None if isinstance(found, str) else None
