"""LabVIEW measurement files (.lvm), by lvm_read: a header with rate and units, then one or more segments."""

import re
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from ._layout import pick_columns
from ._limits import check_demand
from ._samples import Column, as_samples, missing_extra
from ._text import decoded, read_text_columns

_BYTE, _LINE, _CELL = 12, 400, 48
"""Bytes of memory that a byte of the file takes, a line, which may be a segment, and a cell."""

_WHOLE = 0.05
"""Share of a sample by which a segment may miss the end of the one before it."""


def read_lvm_columns(file: Path, names: Sequence[str] | None) -> dict[str, Column]:
    """Gives the named channels of a LabVIEW measurement file.

    Segments that follow each other without a pause are one record. A file without LabVIEW's header is read as
    a text table.

    Args:
        file: The file.
        names: Channel names; None for all channels.

    Returns:
        Name to column, with the rate, start time and unit that the header states.

    Raises:
        ValueError: If lvm_read is not installed, the file cannot be read, a channel is missing or holds no
            numbers, or a segment starts after a pause.
    """
    check_demand(file, _BYTE * file.stat().st_size)
    text = decoded(file.read_bytes())
    if not text.lstrip().startswith("LabVIEW Measurement"):
        return read_text_columns(file, names)
    try:
        import lvm_read
    except ImportError as error:
        raise missing_extra(file, "lvm_read", "LabVIEW measurement files") from error
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    mark = re.search("^Separator(.)", text, re.MULTILINE)
    separators = f"[\t{re.escape(mark[1])}]" if mark else "\t"
    lines = text.count("\n")
    check_demand(file, _BYTE * len(text) + _LINE * lines, text=len(text))
    cells = lines * max(len(re.findall(separators, line)) + 1 for line in text.splitlines())
    check_demand(file, _BYTE * len(text) + _LINE * lines + _CELL * cells)
    held: Any = lvm_read.read_str(text)
    segments = [held[i] for i in range(held["Segments"])]
    headings = [str(name).strip() for name in segments[0]["Channel names"]]
    values = [np.asarray(one["data"], dtype=np.float64) for one in segments]
    wide = [one.shape[1] if one.ndim == 2 else 0 for one in values]
    if headings and headings[-1] == "Comment":
        headings = headings[:-1]
    if min(wide) < len(headings):
        raise ValueError(
            f"{file}: the header names {len(headings)} channels, but a segment has {min(wide)} columns "
            "of values"
        )
    clocked = bool(headings) and headings[0] == "X_Value"
    _check_pauses(file, segments, values)

    def column(i: int) -> Column:
        samples = np.concatenate([one[:, i] for one in values])
        if clocked and i == 0:
            return Column(as_samples(samples, file, headings[i]), unit="s")
        own = i - clocked
        step, start = _of_channel(segments[0], "Delta_X", own), _of_channel(segments[0], "X0", own)
        unit = _of_channel(segments[0], "Y_Unit_Label", own)
        rate = 1.0 / float(step) if step is not None and float(step) > 0.0 else None
        return Column(
            as_samples(samples, file, headings[i]),
            rate,
            None if rate is None or start is None else float(start),
            str(unit).strip() or None if unit is not None else None,
        )

    return pick_columns(file, names, headings, column)


def _of_channel(segment: dict[str, Any], field: str, place: int) -> Any:
    held = segment.get(field, ())
    return held[place] if place < len(held) and not (held[place] != held[place]) else None


def _check_pauses(file: Path, segments: Sequence[dict[str, Any]], values: Sequence[np.ndarray]) -> None:
    for i, (earlier, later) in enumerate(pairwise(segments)):
        step, start, following = (
            _of_channel(earlier, "Delta_X", 0),
            _of_channel(earlier, "X0", 0),
            _of_channel(later, "X0", 0),
        )
        if step is None or start is None or following is None:
            continue
        missed = (following - start) / step - len(values[i])
        if abs(missed) > _WHOLE:
            raise ValueError(
                f"{file}: segment {i + 2} starts {missed:.6g} samples after the end of segment {i + 1}; "
                "expected segments that follow each other. Write each to a file of its own"
            )
