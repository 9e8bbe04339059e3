"""Wording of the reader's errors: what was found, what was expected, and the nearest right name."""

import difflib
from collections.abc import Iterable


def nearest(name: str, known: Iterable[str]) -> str:
    """Gives "; did you mean `x`?" for the known name most like `name`, or nothing."""
    known = [str(one) for one in known]
    lowered = {one.lower(): one for one in reversed(known)}
    found = difflib.get_close_matches(name.lower(), list(lowered), n=1, cutoff=0.5)
    return f"; did you mean `{lowered[found[0]]}`?" if found else ""


def listing(names: Iterable[str], limit: int = 20) -> str:
    """Gives the names in back quotes, separated by commas, at most `limit` of them."""
    names = list(names)
    shown = ", ".join(f"`{name}`" for name in names[:limit])
    return (shown + (f" and {len(names) - limit} more" if len(names) > limit else "")) or "nothing"


def row(index: int) -> str:
    """Gives the place of a sample both ways of counting: "row 18 (index 17)"."""
    return f"row {index + 1} (index {index})"
