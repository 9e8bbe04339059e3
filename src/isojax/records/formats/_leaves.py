"""Arrays in a tree of names, as NPZ, MAT and HDF5 files hold them: "run.force", "data[:, 2]"."""

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .._wording import listing
from ._heading import split_heading
from ._limits import check_demand
from ._samples import Column, as_samples, find_channel, missing_column, unit_of_time

_INDEX = re.compile(r"(.*?)\[([\d\s]*:?[\d\s]*(?:,\s*(?:\d+|:)\s*)+)\]")
_MOST_COLUMNS = 64
"""Columns of a matrix beyond which they are not listed one by one."""


@dataclass(frozen=True, eq=False)
class Leaf:
    """An array of a file, not read yet.

    Attributes:
        path: Its full name, such as "run.force" or "bench/force".
        read: Gives the array; may raise ValueError where it holds no numbers.
        unit: Unit that the file states, or None.
        size: Bytes of memory that reading it takes, where the file says so before it is read.
    """

    path: str
    read: Callable[[], Any]
    unit: str | None = None
    size: int = 0


def leaf_columns(file: Path, names: Sequence[str] | None, leaves: Sequence[Leaf]) -> dict[str, Column]:
    """Gives columns of a tree of arrays.

    Args:
        file: For the error.
        names: Paths, whose levels a point or a slash separates; of a matrix with what is picked of it, as
            "data[:, 2]", counted from 0; None for all rows and columns that hold numbers.
        leaves: All arrays of the file.

    Returns:
        Name to column.

    Raises:
        ValueError: If there is no array of a name, it holds no row or column of numbers, or it is too large.
    """
    if names is None:
        check_demand(file, sum(leaf.size for leaf in leaves))
        return dict(_all_columns(file, leaves))
    found = {name: _leaf_of(file, name, leaves) for name in names}
    check_demand(file, sum(leaf.size for leaf in dict.fromkeys(leaf for leaf, _ in found.values())))
    columns = {}
    for name, (leaf, index) in found.items():
        values = _picked(file, leaf.path, np.asarray(leaf.read()), index) if index else leaf.read()
        unit = leaf.unit or split_heading(leaf.path)[1] or unit_of_time(values)
        columns[name] = Column(as_samples(values, file, name), unit=unit)
    return columns


def structured_leaves(path: str, values: Any) -> Iterator[Leaf]:
    """Gives the leaves under an array: its fields, as "path.field", where it is a structure, else itself."""
    array = values if isinstance(values, np.ndarray) else np.asarray(values)
    if array.dtype.names is None:
        yield Leaf(path, lambda: array)
        return
    for field in array.dtype.names:
        yield from structured_leaves(f"{path}.{field}" if path else field, array[field])


def _all_columns(file: Path, leaves: Sequence[Leaf]) -> Iterator[tuple[str, Column]]:
    for leaf in leaves:
        try:
            values = np.asarray(leaf.read())
        except ValueError:
            continue
        held = [Leaf(leaf.path, lambda values=values: values, leaf.unit)]
        names = [leaf.path]
        if values.ndim == 2 and 1 < min(values.shape) <= _MOST_COLUMNS:
            tall = values.shape[0] >= values.shape[1]
            names = [
                f"{leaf.path}[:, {i}]" if tall else f"{leaf.path}[{i}, :]" for i in range(min(values.shape))
            ]
        for name in names:
            try:
                yield from leaf_columns(file, [name], held).items()
            except ValueError:
                continue  # text, a single number, an empty array: no channel


def _key(path: str) -> str:
    return path.strip("/").replace("/", ".")


def _leaf_of(file: Path, name: str, leaves: Sequence[Leaf]) -> tuple[Leaf, str]:
    """Gives the array of a name, and what is picked of it."""
    leaf = _find(file, name, leaves)
    if leaf is not None:
        return leaf, ""
    path, index = _split_index(name)
    leaf = _find(file, path, leaves) if index else None
    if leaf is None:
        raise _missing(file, name, leaves)
    return leaf, index


def _find(file: Path, name: str, leaves: Sequence[Leaf]) -> Leaf | None:
    known = [
        list(dict.fromkeys([leaf.path, leaf.path.strip("/"), _key(leaf.path), split_heading(leaf.path)[0]]))
        for leaf in leaves
    ]
    for sought in (name, _key(name)):
        if any(sought in own for own in known):
            return leaves[find_channel(file, sought, known)]
    return None


def _split_index(name: str) -> tuple[str, str]:
    match = _INDEX.fullmatch(name.strip())
    return (match[1].strip(), match[2]) if match and match[2].count(":") == 1 else (name, "")


def _picked(file: Path, path: str, values: np.ndarray, index: str) -> np.ndarray:
    parts = [part.strip() for part in index.split(",")]
    place = tuple(slice(None) if part == ":" else int(part) for part in parts)
    inside = [
        part if isinstance(part, slice) else part < size
        for part, size in zip(place, values.shape, strict=False)
    ]
    if values.ndim != len(place) or not all(inside):
        raise ValueError(
            f"{file}: `{path}` has the shape {values.shape}, so there is no `{path}[{', '.join(parts)}]`; "
            "places count from 0"
        )
    return values[place]


def _missing(file: Path, name: str, leaves: Sequence[Leaf]) -> ValueError:
    inside = [leaf.path for leaf in leaves if re.match(re.escape(_key(name)) + r"[.\[]", _key(leaf.path))]
    if inside:
        return ValueError(
            f"{file}: column `{name}` holds a structure; name one of the arrays in it: {listing(inside)}"
        )
    return missing_column(file, name, [leaf.path for leaf in leaves])
