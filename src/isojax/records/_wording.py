"""Wording of the reader's errors: what was found, what was expected, and the nearest right name."""

import difflib
from collections.abc import Iterable
from typing import Any

_LONG = 200
"""Letters beyond which a name is compared with no other, and a value is shown in part."""


def nearest(name: str, known: Iterable[str]) -> str:
    """Gives "; did you mean `x`?" for the known name most like `name`, or nothing."""
    if len(name) > _LONG:
        return ""
    known = [one for one in map(str, known) if len(one) <= _LONG]
    lowered = {one.lower(): one for one in reversed(known)}
    found = difflib.get_close_matches(name.lower(), list(lowered), n=1, cutoff=0.5)
    return f"; did you mean `{lowered[found[0]]}`?" if found else ""


def written(value: Any) -> str:
    """Gives a value as Python writes it, of a long one the start."""
    try:
        text = repr(value)
    except Exception:  # of numbers with thousands of digits, and of what belongs to a caller
        text = f"<{type(value).__name__}>"
    return text if len(text) <= _LONG else f"{text[:_LONG]}..."


def listing(names: Iterable[str], limit: int = 20) -> str:
    """Gives the names in back quotes, separated by commas, at most `limit` of them."""
    names = list(names)
    shown = ", ".join(f"`{name!s:.{_LONG}}`" for name in names[:limit])
    return (shown + (f" and {len(names) - limit} more" if len(names) > limit else "")) or "nothing"


def row(index: int) -> str:
    """Gives the place of a sample both ways of counting: "row 18 (index 17)"."""
    return f"row {index + 1} (index {index})"
