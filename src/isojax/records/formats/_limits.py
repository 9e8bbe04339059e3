"""How much a file may hold: reading takes bounded time and memory, whatever its bytes are."""

from pathlib import Path

MOST_BYTES = 2**31
"""Bytes of the samples, unpacked, that one file may hold: four channels at 10 kHz for two hours."""

MOST_ARRAYS = 2**14
"""Groups, structures and arrays in one file."""

DEEPEST = 64
"""Levels of groups or structures within each other."""


def check_size(file: Path, size: int) -> None:
    """Refuses a file that unpacks to more than a record can be.

    Args:
        file: For the error.
        size: Bytes that its samples take, as it declares or as they are unpacked.

    Raises:
        ValueError: If they exceed `MOST_BYTES`.
    """
    if size > MOST_BYTES:
        raise ValueError(
            f"{file} holds {size / 1e9:.3g} GB of samples, unpacked; expected at most "
            f"{MOST_BYTES / 1e9:.3g} GB. Export fewer channels, or parts of the record to files of their "
            "own; if it should be small, it is damaged"
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
