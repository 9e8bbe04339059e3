"""How results show themselves: one renderer for terminal and notebook, fed by what a class already declares.

`@shown` gives a class `__repr__` and `_repr_html_`. A line a field comes from the docstring, which every
result has: the name, the value in brief, the meaning. Where a reader wants something else first, the class
has one or more of three hooks:

    _headline(self)   one sentence
    _rows(self)       names of fields or properties, or `Row`s made by hand
    _lines(self)      sentences or a picture in characters, below the rows

Hooks read numbers that are there, with NumPy: nothing is simulated and nothing compiled. Inside `jax.jit` and
`jax.vmap`, where there are no numbers, the fields are shown with their shapes instead.
"""

import dataclasses
import functools
import inspect
import os
import re
import textwrap
from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple, TypeVar

import numpy as np

from ._languages import as_html, printable
from ._quantities import typeset_unit, typeset_with_error

LINES = 30
"""Lines of text that a result takes at most."""

WIDTH = 100
"""Columns that it takes at most."""

_NAMED = 4
"""Entries of a list up to which each is named."""

_VALUE_WIDTH = 46
"""Columns of the column of values at most, so that the meaning beside it has room."""

_LEAST_MEANING = 16
"""Columns below which a meaning is left out rather than cut to a few letters."""

_Class = TypeVar("_Class", bound=type)


class Row(NamedTuple):
    """One line of what is shown.

    Attributes:
        name: of the quantity.
        value: in words and numbers, with its unit.
        meaning: what it is; cut where the line ends.
    """

    name: str
    value: str
    meaning: str = ""


class Sheet(NamedTuple):
    """What a result shows of itself.

    Attributes:
        head: kind of result, and what it says in one sentence.
        rows: a line each.
        lines: below them.
    """

    head: str
    rows: tuple[Row, ...]
    lines: tuple[str, ...]


def shown(kind: _Class) -> _Class:
    """Make the instances of a class show themselves.

    Args:
        kind: a dataclass, an equinox module or a named tuple, and whatever inherits from it.

    Returns:
        The same class.
    """
    kind.__repr__ = _text  # pyright: ignore[reportAttributeAccessIssue]
    kind._repr_html_ = _html  # pyright: ignore[reportAttributeAccessIssue]
    return kind


def is_shown(value: object) -> bool:
    """Say whether a value shows itself."""
    return type(value).__repr__ is _text


def sheet_of(one: Any) -> Sheet:
    """Give what a result shows of itself.

    Args:
        one: instance of a class that is `shown`.

    Returns:
        Head, rows and lines, of any length.
    """
    rows = _asked(one, "_rows", lambda: _field_names(one))
    shown = (Row(*map(printable, _as_row(one, row))) for row in rows)
    lines = (printable(line, keep="\n") for line in _asked(one, "_lines", tuple))
    return Sheet(printable(headline(one)), tuple(shown), tuple(lines))


def declared_numbers(one: Any) -> str:
    """Give the physical numbers that an object declares.

    Args:
        one: such as an element or a drive.

    Returns:
        Such as "k3 = 2e+11 N/m³"; "" where it declares none.
    """
    own = _declared(type(one)).items()
    return ", ".join(f"{spec.symbol} = {amount(getattr(one, name), spec.unit)}" for name, spec in own)


def headline(one: Any) -> str:
    """Give the kind of a result and what it says in one sentence.

    Args:
        one: instance of a class that is `shown`.

    Returns:
        Such as "Orbit: stable, 2.1 mm at 150 N and 4.3 Hz".
    """
    return f"{type(one).__name__}: {_asked(one, '_headline', lambda: _first_sentence(type(one)))}"


def _asked(one: Any, hook: str, instead: Callable[[], Any]) -> Any:
    """Give what a hook of a class says; where it has none, or there are no numbers, what is said instead."""
    if not hasattr(type(one), hook):
        return instead()
    try:
        return getattr(one, hook)()
    except Exception:
        # While JAX traces, or maps over a tree, fields hold what has no numbers: an error message that shows
        # such an object must not fail in turn. `tests/test_show.py` calls every hook without this net.
        return instead()


def _as_row(one: Any, row: Row | str) -> Row:
    if isinstance(row, Row):
        return row
    value, meaning = getattr(one, row), _meanings(type(one)).get(row, "")
    spec = _declared(type(one)).get(row)
    return Row(row, brief(value) if spec is None else amount(value, spec.unit), meaning)


@functools.cache
def _declared(kind: type) -> dict[str, Any]:
    """Give the declarations of the fields that are physical numbers: their symbol and unit."""
    fields = dataclasses.fields(kind) if dataclasses.is_dataclass(kind) else ()
    return {field.name: field.metadata["parameter"] for field in fields if "parameter" in field.metadata}


def _field_names(one: Any) -> tuple[str, ...]:
    """List the public fields."""
    kept: Iterable[str] = (
        getattr(one, "_fields", ())
        if isinstance(one, tuple)
        else (field.name for field in dataclasses.fields(one))
    )
    return tuple(name for name in kept if not name.startswith("_"))


@functools.cache
def _first_sentence(kind: type) -> str:
    paragraph = (inspect.getdoc(kind) or kind.__name__).partition("\n\n")[0]
    return " ".join(paragraph.split()).rstrip(".")


@functools.cache
def _meanings(kind: type) -> dict[str, str]:
    """Read what fields mean from the section "Attributes" of the docstring, and properties from theirs."""
    found: dict[str, str] = {}
    for ancestor in reversed(kind.__mro__):
        for name, member in vars(ancestor).items():
            if isinstance(member, property):
                found[name] = " ".join((member.__doc__ or "").partition("\n\n")[0].split())
        name, text = "", inspect.cleandoc(vars(ancestor).get("__doc__") or "")
        for line in text.partition("Attributes:\n")[2].splitlines():
            if line and not line.startswith("    "):
                break
            entry = re.match(r" {4}(\w+): (.*)", line)
            name = entry[1] if entry else name
            found[name] = entry[2] if entry else f"{found.get(name, '')} {line.strip()}".rstrip()
    return found


def _text(self: Any) -> str:
    """Give the result as text, at most 30 lines of 100 columns."""
    sheet = sheet_of(self)
    rows = sheet.rows
    names = max((len(row.name) for row in rows), default=0)
    values = min(max((len(row.value) for row in rows), default=0), _VALUE_WIDTH)
    lines = [*_wrapped(sheet.head, "  ")]
    lines += [_line(row, names, values) for row in rows]
    lines += [part for line in sheet.lines for part in _wrapped(line, "  ")]
    if len(lines) > LINES:
        lines = [*lines[: LINES - 1], f"  … and {len(lines) - LINES + 1} lines more"]
    return "\n".join(lines)


def _line(row: Row, names: int, values: int) -> str:
    start = f"  {row.name:<{names}}  {row.value:<{values}}"
    meaning = row.meaning if WIDTH - len(start) >= _LEAST_MEANING else ""
    return _cut(f"{start}  {meaning}".rstrip(), WIDTH)


def _cut(line: str, width: int) -> str:
    return line if len(line) <= width else f"{line[: width - 1].rstrip()}…"


def _wrapped(line: str, indent: str) -> list[str]:
    """Wrap what is too long; what fits keeps its blanks, as a picture in characters must."""
    return [line] if len(line) <= WIDTH else textwrap.wrap(line, WIDTH, subsequent_indent=indent)


def _html(self: Any) -> str:
    """Give the result as a table for notebooks."""
    sheet = sheet_of(self)
    head, *rows = ([as_html(word) for word in row] for row in ((sheet.head,), *sheet.rows[:LINES]))
    cells = ('style="text-align:left"', 'style="text-align:left"', 'style="text-align:left;color:gray"')
    body = "".join(
        f"<tr>{''.join(f'<td {how}>{word}</td>' for how, word in zip(cells, row, strict=True))}</tr>"
        for row in rows
    )
    left_out = max(len(sheet.rows) - LINES, 0)
    more = f"<tr><td>… and {left_out} more</td></tr>" if left_out else ""
    below = as_html("\n".join(sheet.lines[:LINES]))
    under = f'<pre style="white-space:pre-wrap">{below}</pre>' if below else ""
    return f"<div><b>{head[0]}</b><table>{body}{more}</table>{under}</div>"


@functools.singledispatch
def brief(value: Any) -> str:
    """Give a value in a few words and numbers.

    Args:
        value: anything; a class of another package may register its own words.

    Returns:
        One line.
    """
    if is_shown(value):
        return headline(value)
    if value is None:
        return "none"
    if isinstance(value, bool | np.bool_):
        return "yes" if value else "no"
    if isinstance(value, int | float | complex):
        return number(value)
    if isinstance(value, str):
        return _cut(printable(" ".join(value.split())), WIDTH)
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if hasattr(value, "shape") and hasattr(value, "dtype"):
        return _brief_array(value)
    if isinstance(value, Mapping):
        return listed(map(str, value))
    if isinstance(value, tuple | list) and not hasattr(value, "_fields"):
        return _brief_list(value)
    return type(value).__name__


def listed(names: Iterable[str], most: int = 6) -> str:
    """Give names one after the other, a long list with its count.

    Args:
        names: the names.
        most: how many are named.

    Returns:
        Such as "a, b, c"; "none" where there are none.
    """
    names = list(names)
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return f"{', '.join(names[:most])}{more}" or "none"


def _brief_list(values: tuple[Any, ...] | list[Any]) -> str:
    if not values:
        return "none"
    if all(isinstance(one, str) for one in values):
        return listed(values)
    plain = all(isinstance(one, int | float | complex) for one in values)
    if plain and len(values) <= _NAMED:
        return f"[{', '.join(map(brief, values))}]"
    if plain:
        return _brief_array(np.asarray(values))
    if len(values) == 1:
        return brief(values[0])
    return f"{len(values)} × {listed(dict.fromkeys(type(one).__name__ for one in values))}"


def _brief_array(value: Any) -> str:
    known = numbers_of(value)
    if known is None:
        return f"traced, shape {tuple(value.shape)}" if value.shape else "traced"
    if known.ndim == 0:
        return brief(known.item())
    if not known.size:
        return "none"
    if known.ndim == 1 and known.size <= _NAMED:
        return f"[{', '.join(brief(one) for one in known.tolist())}]"
    count = f"{' × '.join(map(str, known.shape))} values"
    if known.dtype.kind not in "biufc":
        return count
    if known.dtype.kind == "b":
        return f"{count}, {int(known.sum())} yes"
    size = np.abs(known) if known.dtype.kind == "c" else known
    finite = size[np.isfinite(size)]
    if not finite.size:
        return f"{count}, all NaN"
    lost = f", {size.size - finite.size} not finite" if finite.size < size.size else ""
    what = ", moduli from" if known.dtype.kind == "c" else " from"
    return f"{count}{what} {number(finite.min())} to {number(finite.max())}{lost}"


def numbers_of(value: Any) -> np.ndarray | None:
    """Give the numbers of an array, or None where it has none: traced, abstract or given away."""
    try:
        known = np.asarray(value)
    except Exception:
        return None
    return None if known.dtype.kind == "O" else known


def number(value: Any) -> str:
    """Give a number with five digits; the complex with an i.

    Args:
        value: the number.

    Returns:
        Such as "4.3", "2e+11", "0.93-0.12i".
    """
    if isinstance(value, complex):
        return f"{value.real:.4g}{value.imag:+.4g}i"
    return str(value) if isinstance(value, int) else f"{value:.5g}"


def amount(value: Any, unit: str, error: float = float("nan")) -> str:
    """Give a quantity with its unit.

    Args:
        value: one number, an array or what is traced.
        unit: SI unit; "1" for none.
        error: standard error, if known.

    Returns:
        Such as "3.983 ± 0.051 N".
    """
    known = numbers_of(value)
    if known is not None and known.ndim == 0 and np.isfinite(error):
        return typeset_with_error(float(known), error, unit)
    return f"{brief(value)} {typeset_unit(unit)}".rstrip()
