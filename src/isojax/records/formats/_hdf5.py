"""HDF5 files, and MATLAB v7.3 files, which are HDF5 with MATLAB's class written on each dataset."""

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ._door import file_size
from ._leaves import Leaf, leaf_columns
from ._limits import SAMPLE, check_count, check_levels
from ._matlab_object import matlab_object
from ._samples import Column

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

    with h5py.File(file, "r") as handle:
        return leaf_columns(file, names, list(_leaves(file, "", handle, (), itertools.count(1))))


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
                link = node.get(name, getlink=True)
                if isinstance(link, h5py.ExternalLink):
                    yield Leaf(inside, _refusal(file, inside, f"is a link into the file {link.filename}"))
                else:
                    yield from _leaves(file, inside, node.get(name), above, visited)
    elif isinstance(node, h5py.Dataset):
        if h5py.check_ref_dtype(node.dtype) is h5py.Reference:
            check_count(file, int(node.size or 0))
            # The field of an array of structs, and a cell array: a list of references.
            parent, _, field = path.rpartition(".")
            cell = _matlab_class(node) == "cell" or not parent
            for i, reference in enumerate(np.asarray(node[()]).reshape(-1)):
                if reference:
                    place = f"{path}[{i}]" if cell else f"{parent}[{i}].{field}"
                    try:
                        held = node.file[reference]
                    except (ValueError, KeyError, RuntimeError, OSError):  # h5py, where it was deleted
                        yield Leaf(place, _refusal(file, place, "refers to what is gone"))
                    else:
                        yield from _leaves(file, place, held, above, visited)
        elif node.dtype.names:
            for field in node.dtype.names:
                yield Leaf(f"{path}.{field}", _reader(file, path, node, field), size=_memory(node))
        elif node.dtype.kind in "iufbcmM":
            yield Leaf(path, _reader(file, path, node), _unit(node), _memory(node))
        else:
            yield Leaf(path, _refusal(file, path, "holds text or lists"))


def _refusal(file: Path, path: str, found: str) -> Callable[[], Any]:
    def refuse() -> Any:
        raise ValueError(f"{file}: column `{path}` {found}; expected real numbers that stand in the file")

    return refuse


def _reader(file: Path, path: str, node: Any, field: str | None = None) -> Callable[[], Any]:
    def read() -> np.ndarray:
        _check_written(file, path, node)
        matlab = _matlab_class(node)
        if matlab in ("char", "cell", "struct", "logical", "function_handle"):
            raise ValueError(
                f"{file}: `{path}` is a MATLAB {matlab}; expected one row or column of real numbers"
            )
        if "MATLAB_object_decode" in node.attrs:
            raise matlab_object(file, path)
        if "MATLAB_empty" in node.attrs:
            raise ValueError(f"{file}: column `{path}` is empty; expected one row or column of numbers")
        values = np.asarray(node[() if field is None else field])
        return values.T if matlab else values  # MATLAB writes columns first

    return read


def _check_written(file: Path, path: str, node: Any, levels: int = 0) -> None:
    """Refuses samples that HDF5 would take from beside the file, or make up where none were written."""
    import h5py

    check_levels(file, levels)
    if node.external:
        _refusal(file, path, "is stored outside the file")()
    if not node.is_virtual:
        if node.size and node.id.get_space_status() != h5py.h5d.SPACE_STATUS_ALLOCATED:
            _refusal(file, path, "has samples that were never written")()
        return
    mapped = 0
    for part in node.virtual_sources():
        mapped += part.vspace.get_select_npoints()
        source = file if part.file_name == "." else file.parent / part.file_name
        if not file_size(source):
            _refusal(file, path, f"is made of the file {part.file_name}, which does not exist,")()
        with h5py.File(source, "r") as handle:
            held = handle.get(part.dset_name)
            wanted = part.src_space.get_simple_extent_dims()
            if not isinstance(held, h5py.Dataset) or np.any(np.less(held.shape, wanted)):
                _refusal(file, path, f"lacks its part `{part.dset_name}` of {part.file_name}")()
            _check_written(source, part.dset_name, held, levels + 1)
    if mapped < node.size:
        _refusal(file, path, f"has {node.size - mapped} samples that come from nowhere")()


def _memory(node: Any) -> int:
    """Gives the bytes that reading a dataset takes; a chunk is unpacked whole."""
    size = max(SAMPLE, 2 * node.dtype.itemsize)
    return size * int(node.size or 0) + node.dtype.itemsize * math.prod(node.chunks or (0,))


def _matlab_class(node: Any) -> str:
    found = node.attrs.get("MATLAB_class", b"")
    return found.decode(errors="replace") if isinstance(found, bytes) else str(found)


def _unit(node: Any) -> str | None:
    found = next((node.attrs[name] for name in _UNIT_NAMES if name in node.attrs), None)
    found = found.decode(errors="replace") if isinstance(found, bytes) else found
    return found.strip() or None if isinstance(found, str) else None
