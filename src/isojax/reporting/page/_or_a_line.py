"""A picture that cannot be drawn is a line of the report, and everything else is written."""

import textwrap
from collections.abc import Callable
from typing import TypeVar

_Shown = TypeVar("_Shown")

_LONGEST_REASON = 300
"""Letters of an error's message that a reader gets to see."""


def or_a_line(name: str, draw: Callable[[], _Shown], instead: Callable[[str], _Shown]) -> _Shown:
    """Give what a picture shows; where that fails, whatever the error, what stands in its place.

    Args:
        name: what the picture shows, a few words.
        draw: works it out.
        instead: gives what stands in its place, for a line that says why.

    Returns:
        What one of the two gives.
    """
    try:
        return draw()
    except Exception as problem:
        reason = textwrap.shorten(str(problem), _LONGEST_REASON) or type(problem).__name__
        return instead(f"Picture of {name} could not be drawn: {reason.rstrip('.')}.")
