"""The catalogue as pages, from what the elements declare; a hook of mkdocs, or a script that writes them.

    python docs/build_catalogue.py FOLDER

A page has the law, the parameters, the look-alikes and the source of an effect, all from its class. What is
written by hand, such as a signature or a picture, stands in `docs/effects/<name>.md` and is put in between.
Look-alikes written there and those that the classes declare come into one table.
An effect without such a file has a complete page all the same. Pages are made when the site is built and are
not kept in the repository, so that none can be out of date.
"""

import inspect
import math
import re
import sys
from pathlib import Path
from typing import get_args

from isojax._parameters import ParameterSpec, own_parameters
from isojax.elements import CATALOGUE, AbstractElement, Group

NOTES = Path(__file__).parent / "effects"

_ROWS = r"\| it could be [^\n]*\n\|[-|]+\n((?:\|[^\n]*\n)*)"
_BY_HAND = re.compile(rf"^## Look-alikes\n\n(?:{_ROWS})?", re.MULTILINE)
_CELLS = re.compile(r"(?<!\\)\|")
_NAME = re.compile(r"^`(\w+)`$")


def sections(kind: type[AbstractElement]) -> tuple[str, dict[str, str], str]:
    """Split the docstring of an element: its law, the meaning of each parameter, and where it comes from."""
    text = inspect.getdoc(kind) or ""
    law, _, rest = text.partition("\nAttributes:\n")
    fields, _, source = rest.partition("\nSource:")
    entries = re.findall(r"^    (\w+): (.*(?:\n     +.*)*)", fields, re.MULTILINE)
    # The unit has a column of its own.
    meaning = {name: re.sub(r" \[[^]]*\]|\.$", "", " ".join(words.split())) for name, words in entries}
    return law.strip(), meaning, " ".join(source.split())


def bounds(spec: ParameterSpec) -> str:
    """Word the bounds of a parameter."""
    low, high = (f"{value:g}" if math.isfinite(value) else "" for value in (spec.lower, spec.upper))
    return f"{low} to {high}" if low and high else f">= {low}" if low else f"<= {high}" if high else "none"


def look_alikes(name: str, by_hand: str = "") -> str:
    """Give the table of the effects that records can confuse with one: the declared, and those by hand.

    Args:
        name: catalogue name.
        by_hand: rows of two cells, what it could be and what separates the two.
    """
    own = [[cell.strip() for cell in _CELLS.split(row)[1:-1]] for row in by_hand.splitlines()]
    # What is said of an effect alone, with no condition beside its name, goes into the row of that effect.
    cells = [(row, cell) for row in own for cell in row[0].split(", ")]
    words = {other: (row, cell) for row, cell in cells for other in _NAME.findall(cell)}
    placed, rows = [f"`{name}`"], []
    for other in CATALOGUE:
        for declarer, kind in CATALOGUE.items():
            for alike in kind.look_alikes:
                if other != name and alike.separates(declarer, {name, other}):
                    (_, said), cell = words.get(other, (("", ""), ""))
                    placed.append(cell)
                    likely = likeness(alike.exact, alike.beside)
                    rows.append(f"| [`{other}`]({other}.md) | {likely} | {said} | {alike.test} |")
    for cell, said in own:
        others = ", ".join(one for one in cell.split(", ") if one not in placed)
        if others:
            rows.append(f"| {others} | not declared | {said} | |")
    if not rows:
        return "None is declared: one level lower and one higher separate most laws."
    head = ["| it could be | alike | what separates the two | the test for it |", "|---|---|---|---|"]
    return "\n".join([*head, *rows])


def likeness(exact: bool, beside: tuple[str, ...]) -> str:
    """Word how alike two effects are."""
    free = " and ".join(f"`{name}`" for name in beside)
    return f"exactly, beside a free {free}" if exact and beside else "exactly" if exact else "nearly"


def page(name: str, notes: str = "") -> str:
    """Give the page of an effect.

    Args:
        name: catalogue name.
        notes: what is written by hand about it.

    Returns:
        Markdown.
    """
    kind = CATALOGUE[name]
    law, meaning, source = sections(kind)
    title = kind.words[0].upper() + kind.words[1:]
    rows = [
        f"| `{field}`{' (strength)' if field == kind.strength else ''} | {spec.symbol} | {spec.unit} "
        f"| {bounds(spec)} | {'yes' if spec.fitted else 'on request'} | {meaning[field]} |"
        for field, spec in own_parameters(kind)
    ]
    head = [f"# {title}: `{name}`", law]
    if kind.active:
        head.append("The law may feed energy in: no check of passivity refuses it.")
    if kind.needs:
        head.append("Only beside " + " and ".join(f"`{other}`" for other in kind.needs) + ".")
    if kind.absorbs:
        head.append("It takes the place of " + " and ".join(f"`{other}`" for other in kind.absorbs) + ".")
    if kind.freed_by:
        section, field = kind.freed_by.split(".")
        head.append(f"`{field} = true` in section [{section}] of campaign.toml frees it from the start.")
    table = [
        "| parameter | symbol | unit | bounds | fitted | what it is |",
        "|---|---|---|---|---|---|",
        *rows,
    ]
    before, by_hand, after = [*_BY_HAND.split(notes, maxsplit=1), "", ""][:3]
    alike = f"## Look-alikes\n\n{look_alikes(name, by_hand or '')}"
    body = [*head, "\n".join(table), before.strip(), alike, after.strip(), f"Source: {source}"]
    return "\n\n".join(part for part in body if part) + "\n"


def index() -> str:
    """Give the list of all effects, by group."""
    lines = ["# The catalogue, a page for each effect", "`isojax effects` lists the same names."]
    for group in get_args(Group):
        members = [kind for kind in CATALOGUE.values() if kind.group == group]
        lines.append(f"## {group}")
        lines.append("\n".join(f"- [{kind.name}]({kind.name}.md): {kind.words}" for kind in members))
    return "\n\n".join(lines) + "\n"


def pages() -> dict[str, str]:
    """Give every page of the catalogue by its file name, the list of effects included."""
    found = {"README.md": index()}
    for name in CATALOGUE:
        notes = NOTES / f"{name}.md"
        found[f"{name}.md"] = page(name, notes.read_text(encoding="utf-8") if notes.exists() else "")
    return found


def on_files(files, config):
    """Put the pages into the site: a hook of mkdocs."""
    from mkdocs.structure.files import File

    for name, text in pages().items():
        own = files.get_file_from_path(f"effects/{name}")
        if own is not None:
            files.remove(own)
        files.append(File.generated(config, f"effects/{name}", content=text))
    return files


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in pages().items():
        (folder / name).write_text(text, encoding="utf-8")
