"""A heading and the unit in it: "Time [ms]", "Force (N)", "a / m/s^2"."""

import re

from ._limits import LONGEST_NAME
from ._units import channel_unit

_FORMS = (r"(.+?)\s*\[([^\[\]]+)\]", r"(.+?)\s*\(([^()]+)\)", r"(.+?)\s+/\s+(\S+)", r"(.+?)\s+in\s+(\S+)")
"""Square brackets first: what stands in them is a unit more surely than in round ones."""


def split_heading(heading: str) -> tuple[str, str | None]:
    """Gives the name in a heading and its unit, or the whole heading and None.

    What stands in brackets is taken for a unit only if a channel may have it: "Force (table)" is a name, and
    so is "Force (A)", since sensors are called so.
    """
    text = heading.strip()
    if len(text) > LONGEST_NAME:
        return text, None
    for form in _FORMS:
        match = re.fullmatch(form, text)
        if match is None:
            continue
        found = channel_unit(match[2])
        if found is not None and (found.quantity != "current" or form is _FORMS[0]):
            return match[1], match[2].strip()
    return text, None


def bare_unit(cell: str) -> str | None:
    """Gives the unit in a cell of a row of units, without brackets round it, or None."""
    text = cell.strip()
    for opening, closing in ("[]", "()"):
        if text.startswith(opening) and text.endswith(closing):
            text = text[1:-1].strip()
    return text if channel_unit(text) is not None else None
