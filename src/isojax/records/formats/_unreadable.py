"""The error for a file whose bytes are not those of its format."""

import os
import re
from pathlib import Path

_MARKS = {
    b"\x89HDF\r\n\x1a\n": "HDF5 (.h5, .mat of v7.3)",
    b"PK\x03\x04": "a ZIP archive (.npz, .xlsx, .ods)",
    b"PAR1": "Parquet (.parquet)",
    b"TDSm": "TDMS (.tdms)",
    b"MATLAB 5.0": "MATLAB (.mat)",
    b"LabVIEW Measurement": "LabVIEW (.lvm)",
    b"\xd0\xcf\x11\xe0": "a former Office file (.xls)",
}
"""First bytes of a format, and its name."""

_SAID = 120
"""Letters of the reading package's own message that are shown."""


def unreadable(file: Path, what: str, error: BaseException) -> ValueError:
    """Gives the error for a file that its reading package refuses.

    Args:
        file: The file.
        what: What it should be, such as "a Parquet file".
        error: What the package raised.

    Returns:
        The error: the file, what was expected, the likely cause, and what the package says.
    """
    try:
        with file.open("rb") as handle:
            head = handle.read(32)
    except (OSError, ValueError) as refused:
        if os.path.exists(file):
            return ValueError(f"{file} cannot be read: {getattr(refused, 'strerror', refused)}")
        head = b""  # data in memory, or a file that is gone
    seen = next((name for mark, name in _MARKS.items() if head.startswith(mark)), None)
    cause = "it is cut short or damaged" if head else "it is of another form"
    if seen is not None and file.suffix.lower() not in seen:
        cause = f"it has the wrong ending, since it begins as {seen}"
    words = str(getattr(error, "strerror", None) or error)  # of an OSError without its number
    said = " ".join(re.sub("<[^>]* at 0x[^>]*>", "...", words).split())[:_SAID] or type(error).__name__
    return ValueError(f"{file} cannot be read as {what}. Likely cause: {cause} (the reader says: {said})")
