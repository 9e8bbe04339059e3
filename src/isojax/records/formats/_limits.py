"""How much the reading of one file may ask for: memory and time, found before the file is read."""

import os
from pathlib import Path

MEMORY, SECONDS = "ISOJAX_READ_GIB", "ISOJAX_READ_SECONDS"
"""Environment variables that change how much a file may ask for."""

_ALLOWED = {MEMORY: 1.0, SECONDS: 60.0}
_GIB = 2.0**30

_SPEED = 1e7
"""Bytes of text, unpacked, that the slowest reader takes in a second."""

SAMPLE = 24
"""Bytes of memory that a number takes: as the file stores it, as it is unpacked, and as float64."""

MOST_ARRAYS = 2**14
"""Groups, structures and arrays in one file."""

DEEPEST = 64
"""Levels of groups or structures within each other."""

LONGEST_NAME = 500
"""Letters of a name: of a channel, a heading, a file."""


def check_demand(file: Path, memory: float, text: float = 0.0, cause: str = "") -> None:
    """Refuses a file of which the reading would take more memory or time than one may.

    Args:
        file: For the error.
        memory: Bytes that the reading takes at its peak.
        text: Bytes of text, unpacked, that are read letter by letter.
        cause: What the file holds and why it may be so much, in words.

    Raises:
        ValueError: If they exceed what is allowed: 1 GiB and 60 s, or what `MEMORY` and `SECONDS` say.
    """
    for variable, asked, unit in ((MEMORY, memory / _GIB, "GiB of memory"), (SECONDS, text / _SPEED, "s")):
        most = _allowed(variable)
        if asked > most:
            raise ValueError(
                f"{file}: to read it takes {asked:.3g} {unit}; expected at most {most:g}. Export fewer "
                "channels, or parts of the record to files of their own, or set the environment variable "
                f"{variable} to more. {cause or 'If the file should be small, it is damaged'}"
            )


def check_levels(file: Path, levels: int) -> None:
    """Refuses groups or structures that are nested deeper than `DEEPEST`."""
    if levels > DEEPEST:
        raise ValueError(
            f"{file} nests groups or structures more than {DEEPEST} levels deep; expected arrays in a "
            "few. Likely cause: a link or a field that leads back to what holds it"
        )


def check_count(file: Path, count: int) -> None:
    """Refuses more than `MOST_ARRAYS` groups, structures and arrays."""
    if count > MOST_ARRAYS:
        raise ValueError(
            f"{file} holds more than {MOST_ARRAYS} groups and arrays; expected the channels of a record. "
            "Export them alone"
        )


def _allowed(variable: str) -> float:
    text = os.environ.get(variable, "")
    try:
        most = float(text or _ALLOWED[variable])
    except ValueError:
        most = 0.0
    if not most > 0.0:
        raise ValueError(f"Environment variable {variable} must be a number above 0, but is {text!r:.80}.")
    return most
