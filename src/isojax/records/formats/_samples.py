"""What every reader returns: named columns of float64 samples, and the checks they share."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from .._wording import listing, nearest
from ._limits import check_demand


@dataclass(frozen=True, eq=False)
class Column:
    """One channel as the file holds it.

    Attributes:
        samples: Its values in the file's own unit.
        rate: Samples per second that the file itself states [Hz], or None.
        start: Time of the first sample that the file itself states [s], or None.
        unit: Unit that the file itself states, in a heading or beside the samples, or None.
    """

    samples: Float[np.ndarray, " time"]
    rate: float | None = None
    start: float | None = None
    unit: str | None = None


def missing_column(file: Path, name: str, present: Iterable[str]) -> ValueError:
    """Gives the error for a column that the file does not have; lists those it has."""
    present = list(present)
    return ValueError(f"{file} has no column `{name}`; it has {listing(present)}{nearest(name, present)}")


def missing_extra(file: Path, package: str, what: str) -> ValueError:
    """Gives the error for a format whose package is not installed, with the command that installs it.

    pip finds the extra in the installed isojax, whether that came from a clone, a wheel or an index.
    """
    return ValueError(
        f"{file}: reading {what} needs the package {package}; to install it: "
        'python -m pip install "isojax[io]"'
    )


def find_channel(file: Path, name: str, names: Sequence[Sequence[str]]) -> int:
    """Gives the index of the one channel of a name.

    Args:
        file: For the error.
        name: The name sought.
        names: All names of each channel, its full one first: that goes before a short one of another channel.

    Returns:
        Its index in `names`.

    Raises:
        ValueError: If no channel has the name, or several have; lists names that only one channel has.
    """
    matches = [i for i, own in enumerate(names) if name == own[0]]
    matches = matches or [i for i, own in enumerate(names) if name in own]
    if not matches:
        raise missing_column(file, name, dict.fromkeys(one for own in names for one in own))
    if len(matches) > 1:
        unique = [one for i in matches for one in names[i] if sum(one in own for own in names) == 1]
        hint = f"use one of {listing(unique)}" if unique else "rename them before the export"
        raise ValueError(f"{file}: {len(matches)} channels are called `{name}`; {hint}")
    return matches[0]


def as_samples(values: Any, file: Path, name: str) -> Float[np.ndarray, " time"]:
    """Gives a real (n,), (n, 1) or (1, n) array as float64 (n,); points in time as seconds since the first.

    Raises:
        ValueError: If it is text, complex, a structure, a single number or a table of several columns.
    """
    array = np.asarray(values)
    if array.dtype.kind not in "iufmM":
        held = {
            "c": "complex numbers",
            "U": "text",
            "S": "text",
            "b": "true/false",
            "O": "objects, not numbers",
        }
        found = held.get(array.dtype.kind, "a structure" if array.dtype.names else str(array.dtype))
        raise ValueError(f"{file}: column `{name}` holds {found}; expected one row or column of real numbers")
    if array.size == 0:
        raise ValueError(f"{file}: column `{name}` is empty; expected one row or column of numbers")
    if array.ndim == 0 or array.size != max(array.shape) or array.size == 1:
        raise ValueError(
            f"{file}: column `{name}` has the shape {array.shape}; expected one row or column of numbers"
            + _one_of(name, array.shape)
        )
    check_demand(file, 8 * array.size)  # that of a view of one number may be any
    array = array.reshape(-1)
    if array.dtype.kind == "M":
        array = array - array[0]
    if array.dtype.kind == "m":
        return np.where(np.isnat(array), np.nan, array / np.timedelta64(1, "s"))
    return array.astype(np.float64)


def unit_of_time(values: Any) -> str | None:
    """Gives "s" for points in time, which `as_samples` turns into seconds, else None."""
    return "s" if np.asarray(values).dtype.kind in "mM" else None


def _one_of(name: str, shape: tuple[int, ...]) -> str:
    """Says how one column of a matrix is named."""
    if len(shape) != 2 or min(shape) < 2:
        return ""
    picked = [f"{name}[:, {i}]" if shape[0] >= shape[1] else f"{name}[{i}, :]" for i in (0, min(shape) - 1)]
    return f"; one of them is named `{picked[0]}` to `{picked[1]}`, counted from 0"
