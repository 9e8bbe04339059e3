r"""A user's text in each language that it enters: one function a language.

Titles, units and names of files, records and columns are a user's. Sentences hold them as they are; what
writes a sentence calls the function of its language. JSON needs none, since `json.dumps` escapes every text.
No text of a user is written into a table for a spreadsheet.
"""

import html
import json
import re
import unicodedata
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.text import Text

_HIDDEN = ("Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp")
"""Unicode categories of characters that cannot be seen: controls, formats, separators of lines."""

_MARKDOWN = re.compile(r"([\\`*_{}\[\]<>|~$&#])|^(?:([-+=])(?!\d)|(\d+)([.)])(?=\s|$))")
"""What CommonMark and its table and mathematics extensions may read: anywhere, and where a line begins."""


def printable(text: str, keep: str = "") -> str:
    r"""Give a text in which every character can be seen.

    Line breaks, control characters, marks that turn the direction of writing, unpaired surrogates and
    unassigned characters become what Python writes for them, such as "\n" and "\u202e".

    Args:
        text: of a user, or holding one.
        keep: characters that stay all the same.

    Returns:
        One line, unless line breaks are kept.
    """
    shown = (one if one in keep or not _is_hidden(one) else ascii(one)[1:-1] for one in text)
    return "".join(shown)


def _is_hidden(one: str) -> bool:
    """Whether a character cannot be seen."""
    return unicodedata.category(one) in _HIDDEN


def as_mathtext(text: str) -> str:
    """Give a text as Matplotlib shows it letter by letter: no "$" begins mathematics.

    A label that begins with "_" would be left out of legends, so that a blank stands before it.
    """
    words = printable(text).replace("$", r"\$")
    return f" {words}" if words.startswith("_") else words


def as_rich(text: str, style: str = "", keep: str = "") -> "Text":
    """Give a text for the terminal: no markup, no emoji code, no control sequence; one line, unless kept."""
    from rich.text import Text

    return Text(printable(text, keep), style=style)


def as_html(text: str) -> str:
    """Give a text for HTML, between tags or as an attribute in quotes."""
    return html.escape(printable(text, keep="\n"))


def as_markdown(text: str) -> str:
    """Give a text as one line of Markdown, also in a cell of a table."""
    return _MARKDOWN.sub(lambda one: _escaped(*one.groups()), printable(text).strip())


def _escaped(anywhere: str | None, marker: str | None, number: str | None, point: str | None) -> str:
    """Give a character of Markdown as itself; a number of a list keeps its digits."""
    return f"{number or ''}\\{anywhere or marker or point}"


def as_code(text: str) -> str:
    """Give a text of several lines as a block of code in Markdown, whose fence is longer than any in it."""
    fence = "`" * max(3, 1 + max(map(len, re.findall("`+", text)), default=0))
    return "\n".join((fence, printable(text, keep="\n"), fence))


def as_toml(text: str) -> str:
    """Give a text as a string of TOML, in its quotes."""
    written = json.dumps(text, ensure_ascii=False)
    return "".join(f"\\U{ord(one):08x}" if _is_hidden(one) else one for one in written)
