"""What every reader returns: named columns of float64 samples, and the checks they share."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from .._wording import listing, nearest


@dataclass(frozen=True, eq=False)
class Column:
    """One channel as the file holds it.

    Attributes:
        samples: Its values in the file's own unit.
        rate: Samples per second that the file itself states [Hz], or None.
        start: Time of the first sample that the file itself states [s], or None.
    """

    samples: Float[np.ndarray, " time"]
    rate: float | None = None
    start: float | None = None


def missing_column(file: Path, name: str, present: Iterable[str]) -> ValueError:
    """Gives the error for a column that the file does not have; lists those it has."""
    present = list(present)
    return ValueError(f"{file} has no column `{name}`; it has {listing(present)}{nearest(name, present)}")


def find_channel(file: Path, name: str, names: Sequence[Sequence[str]]) -> int:
    """Gives the index of the one channel of a name.

    Args:
        file: For the error.
        name: The name sought.
        names: All names of each channel.

    Returns:
        Its index in `names`.

    Raises:
        ValueError: If no channel has the name, or several have; lists names that only one channel has.
    """
    matches = [i for i, own in enumerate(names) if name in own]
    if not matches:
        raise missing_column(file, name, dict.fromkeys(one for own in names for one in own))
    if len(matches) > 1:
        unique = [one for i in matches for one in names[i] if sum(one in own for own in names) == 1]
        hint = f"use one of {listing(unique)}" if unique else "rename them before the export"
        raise ValueError(f"{file}: {len(matches)} channels are called `{name}`; {hint}")
    return matches[0]


def as_samples(values: Any, file: Path, name: str) -> Float[np.ndarray, " time"]:
    """Gives a real (n,), (n, 1) or (1, n) array as float64 (n,).

    Raises:
        ValueError: If it is text, complex, a structure, a single number or a table of several columns.
    """
    array = np.asarray(values)
    if array.dtype.kind not in "iuf":
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
        )
    return array.reshape(-1).astype(np.float64)
