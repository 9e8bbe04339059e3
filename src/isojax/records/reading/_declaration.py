"""campaign.toml as declared: each section and field with its type, checked before a data file is opened."""

import os
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_args

import numpy as np

from ..._quantities import CONDITIONS
from ..._show import shown
from .._campaign import Hold, InputQuantity, OutputQuantity
from .._physical_limits import COUNT, GAIN, MASS, ORDER, RATE, SHARE, SIZE, Limits
from .._record import Direction, ExcitationKind, Role
from .._wording import listing, nearest, written
from ..formats import LONGEST_NAME, door, file_size

# Why no validation library: this declaration was also written for pydantic 2 and tried with msgspec. pydantic
# reports field and value, but not in words what a missing or wrong field must be, and orders its errors
# differently. With such words beside every type and the errors sorted, its code is as long as this table.
# msgspec reports one text without the value that it refused, so a message that quotes it needs a parser.


@dataclass(frozen=True)
class Field:
    """One field: what it must be, in words and as a check, and its default."""

    words: str
    accepts: Callable[[Any], bool]
    required: bool = False
    default: Any = None
    choices: tuple[str, ...] = ()
    convert: Callable[[Any], Any] = lambda value: value


def _is_number(value: Any, limits: Limits) -> bool:
    known = isinstance(value, int | float) and not isinstance(value, bool)
    return known and limits.hold(abs(value))


def _is_text(value: Any) -> bool:
    return isinstance(value, str) and bool(value.strip()) and len(value) <= LONGEST_NAME


def _is_names(value: Any) -> bool:
    held = isinstance(value, list) and len(value) <= LONGEST_NAME and all(_is_text(one) for one in value)
    return held and len(set(value)) == len(value)


def _text(required: bool = False) -> Field:
    return Field(f"a text that is not empty, of at most {LONGEST_NAME} letters", _is_text, required)


def _is_file(value: Any) -> bool:
    return _is_text(value) and Path(value).name not in ("", "..")


def _file(required: bool = False) -> Field:
    words = f'the name of a file, such as "run1.csv", of at most {LONGEST_NAME} letters'
    return Field(words, _is_file, required)


def _choice(*choices: str, required: bool = False, default: str | None = None) -> Field:
    words = "one of " + ", ".join(f'"{choice}"' for choice in choices)
    accepts = lambda value: isinstance(value, str) and value in choices  # noqa: E731
    return Field(words, accepts, required, default, choices)


def _number() -> Field:
    accepts = lambda value: _is_number(value, Limits(0.0, SIZE.most))  # noqa: E731
    return Field(f"a finite number, at most {SIZE.most:g}", accepts, convert=float)


def _factor() -> Field:
    accepts = lambda value: _is_number(value, GAIN)  # noqa: E731
    return Field(f"a finite number other than 0, {GAIN.words}", accepts, default=1.0, convert=float)


def _positive(limits: Limits = SIZE, required: bool = False, default: float | None = None) -> Field:
    accepts = lambda value: _is_number(value, limits) and value > 0  # noqa: E731
    return Field(f"a finite number above 0, {limits.words}", accepts, required, default, convert=float)


def _count(
    default: int | None = None, least: int = 0, most: float = COUNT.most, required: bool = False
) -> Field:
    accepts = lambda value: isinstance(value, int) and _is_number(value, COUNT) and least <= value <= most  # noqa: E731
    ceiling = "" if most == COUNT.most else f" and at most {most:g}"
    return Field(f"a whole number, at least {least}{ceiling}", accepts, required, default)


def _flag(default: bool = False) -> Field:
    return Field("true or false", lambda value: isinstance(value, bool), default=default)


def _names(default: tuple[str, ...]) -> Field:
    return Field('a list of different names such as ["linear", "cubic"]', _is_names, default=default)


SECTIONS: Mapping[str, Mapping[str, Field]] = {
    "campaign": {"title": _text(), "mass": _positive(MASS, required=True), "mass_free": _flag()},
    "input": {
        "quantity": _choice(*get_args(InputQuantity), required=True),
        "column": _text(required=True),
        "unit": _text(),
        "gain": _factor(),
        "gain_free": _flag(),
        "offset_free": _flag(),
        "hold": _choice(*get_args(Hold), default="band_limited"),
        "moving_mass": _positive(MASS),
        "noise": _positive(),
        "accuracy": _positive(SHARE),
        "remove_spikes": _flag(),
    },
    "output": {
        "quantity": _choice(*get_args(OutputQuantity), required=True),
        "column": _text(required=True),
        "unit": _text(),
        "offset_free": _flag(),
        "noise": _positive(),
        "accuracy": _positive(SHARE),
        "remove_spikes": _flag(),
    },
    "floor": {
        "quantity": _choice(*get_args(OutputQuantity), required=True),
        "column": _text(required=True),
        "unit": _text(),
        "gain": _factor(),
    },
    "sampling": {"rate": _positive(RATE), "time": _text(), "unit": _text(), "resample": _flag()},
    "filter": {
        "kind": _choice("butterworth", default="butterworth"),
        "order": _count(least=int(ORDER.least), most=ORDER.most, required=True),
        "cutoff_hz": _positive(RATE, required=True),
        "applied": _flag(default=True),
        "compensate": _flag(),
    },
    "model": {
        "stiffness": _names(("linear",)),
        "damping": _names(("linear",)),
        "elements": _names(()),
        "random_force": _positive(),
    },
}
RECORD: Mapping[str, Field] = {
    "file": _file(required=True),
    "role": _choice(*get_args(Role), required=True),
    "level": _number(),
    "direction": _choice(*get_args(Direction), default="none"),
    "repeat": _count(),
    "start": _count(default=0),
    "stop": _count(least=1),
    "period": _count(least=2),
    "settle": _count(default=0),
    "schedule": _file(),
    "kind": _choice(*get_args(ExcitationKind)),
    **{name: _positive() for name in CONDITIONS},
}
_REQUIRED_SECTIONS = ("campaign", "input", "output")
_ABSENT_SECTIONS = ("floor", "filter")
"""Sections that are None where the file has none; of the others every field is then at its default."""


_MOST_RECORDS = 1000
"""Of a campaign: each is compared with each, whether they share samples."""

_MOST_BYTES = 2**20
"""Of a campaign.toml: a kilobyte a record."""

_MOST_DOTS = 100
"""In a line of it: each part of a dotted key is looked up with all before it."""

_IN_MEMORY = "declaration"
"""Called so in errors where it is no file."""


@shown
@dataclass(frozen=True)
class Declaration:
    """The checked contents of campaign.toml; every field present, absent ones at their default.

    Attributes:
        file: The campaign.toml.
        sections: Section name to field name to value; "filter" and "floor" are None where the
            file has none.
        records: One mapping per [[record]], in order.
        data: What is in memory in place of data files, by the `file` of a record; None: they are files.
    """

    file: Path
    sections: Mapping[str, Any]
    records: tuple[Mapping[str, Any], ...]
    data: Mapping[str, Any] | None = None

    def given(self, record: Mapping[str, Any]) -> Any:
        """Gives the data of a record that are in memory, or None."""
        return None if self.data is None else self.data[record["file"]]


def read_declaration(
    source: str | Path | Mapping[str, Any], data: Mapping[str, Any] | None = None
) -> Declaration:
    """Gives the checked contents of a campaign.toml, or of a mapping of the same form.

    Args:
        source: The .toml, the folder that holds a campaign.toml, or a mapping with its sections: "campaign",
            "input", ..., and "record", a list. A field that is None counts as left out.
        data: What is in memory in place of data files: of each record, by its `file`.

    Returns:
        The declaration.

    Raises:
        ValueError: If the file is missing, is not TOML, or holds a section, field or value that does not
            belong; if `data` lacks a record.
    """
    if isinstance(source, Mapping):
        file = Path(_IN_MEMORY)
        with door(file, "a declaration of a campaign"):
            table = _plain(source)
    elif not isinstance(source, str | os.PathLike):
        raise ValueError(f"Argument `source` must be a path or a mapping, but is {type(source).__name__}.")
    else:
        file = Path(source)
        file = file / "campaign.toml" if os.path.isdir(file) else file
        table = _parse(file)
    _check_names(file, "the file", table, (*SECTIONS, "record"), "section")
    sections: dict[str, Any] = {}
    for name, fields in SECTIONS.items():
        if name not in table and name in _REQUIRED_SECTIONS:
            needed = [name for name, field in fields.items() if field.required]
            raise ValueError(f"{file}: section [{name}] is missing; it must hold {listing(needed)}")
        absent = name not in table
        sections[name] = (
            None
            if absent and name in _ABSENT_SECTIONS
            else _checked(file, f"[{name}]", table.get(name, {}), fields)
        )
    entries = table.get("record", [])
    if not isinstance(entries, list):
        raise ValueError(f"{file}: [record] must be a list of tables; write [[record]] above each record")
    if len(entries) > _MOST_RECORDS:
        raise ValueError(f"{file}: {len(entries)} [[record]] are listed; expected at most {_MOST_RECORDS}")
    if not entries:
        raise ValueError(f'{file}: no [[record]] is listed; at least one with role = "fit" is needed')
    records = tuple(
        _checked(file, f"[[record]] number {i + 1}", one, RECORD) for i, one in enumerate(entries)
    )
    _check_together(file, sections, records)
    if not (data is None or isinstance(data, Mapping)):
        raise ValueError(
            f"Argument `data` must give data by the `file` of a record, but is {type(data).__name__}."
        )
    for number, record in enumerate(records if data is not None else (), start=1):
        if record["file"] not in (data or {}):
            raise ValueError(
                f'{file}: [[record]] number {number} has file = "{record["file"]}", but argument `data` has '
                f"{listing(map(str, data or {}))} only{nearest(record['file'], map(str, data or {}))}"
            )
    return Declaration(file, sections, records, data)


def _plain(value: Any) -> Any:
    """Gives mappings, sequences and NumPy numbers as a TOML file would hold them, without fields of None."""
    if isinstance(value, Mapping):
        return {str(name): _plain(one) for name, one in value.items() if one is not None}
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    return value.item() if isinstance(value, np.generic) else value


def _parse(file: Path) -> dict[str, Any]:
    size = file_size(file)
    if size is None:
        raise ValueError(
            f"{file} does not exist; expected a campaign .toml, or a folder with a campaign.toml"
        )
    if size > _MOST_BYTES:
        raise ValueError(f"{file} has {size} bytes; expected a campaign .toml of at most {_MOST_BYTES}")
    with door(file, "a campaign .toml"):
        try:
            text = file.read_bytes().decode("utf-8-sig")
        except UnicodeDecodeError as error:
            raise ValueError(f"{file} is not UTF-8 text (byte {error.start}); a TOML file must be") from error
        if not text.strip():
            raise ValueError(
                f"{file} is empty; expected sections [campaign], [input], [output] and [[record]]"
            )
        for number, line in enumerate(text.splitlines(), start=1):
            if line.count(".") > _MOST_DOTS:
                raise ValueError(f"{file}: line {number} has more than {_MOST_DOTS} points; expected a field")
        try:
            return tomllib.loads(text)
        except (ValueError, RecursionError) as error:
            said = "brackets within brackets, too deep" if isinstance(error, RecursionError) else error
            raise ValueError(f"{file} is not valid TOML: {said}") from error


def _check_names(file: Path, where: str, table: Mapping[str, Any], known: tuple[str, ...], what: str) -> None:
    for name in table:
        if name not in known:
            raise ValueError(
                f"{file}: {where} has an unknown {what} `{name:.80}`{nearest(name, known)} Known: "
                f"{listing(known)}"
            )


def _checked(file: Path, where: str, table: Any, fields: Mapping[str, Field]) -> dict[str, Any]:
    if not isinstance(table, dict):
        found = "a list of tables" if isinstance(table, list) else written(table)
        raise ValueError(f"{file}: {where} must be one table of fields, but is {found}")
    _check_names(file, where, table, tuple(fields), "field")
    values: dict[str, Any] = {}
    for name, field in fields.items():
        if name not in table:
            if field.required:
                raise ValueError(f"{file}: {where} lacks the field `{name}`; it must be {field.words}")
            values[name] = field.default
            continue
        value = table[name]
        if not field.accepts(value):
            hint = nearest(value, field.choices) if isinstance(value, str) else ""
            raise ValueError(f"{file}: {where} {name} = {written(value)} must be {field.words}{hint}")
        values[name] = field.convert(value)
    return values


def _check_together(file: Path, sections: Mapping[str, Any], records: tuple[Mapping[str, Any], ...]) -> None:
    drive, mass = sections["input"]["quantity"], sections["input"]["moving_mass"]
    if drive == "reaction_mass_acceleration" and mass is None:
        raise ValueError(
            f"{file}: [input] lacks the field `moving_mass`; a reaction mass of so many kg turns its "
            "acceleration into the force -moving_mass * acceleration"
        )
    if drive != "reaction_mass_acceleration" and mass is not None:
        raise ValueError(
            f'{file}: [input] moving_mass = {mass} belongs to quantity = "reaction_mass_acceleration" only, '
            f'but quantity = "{drive}"'
        )
    if drive == "base_acceleration" and sections["floor"] is not None:
        raise ValueError(
            f'{file}: [floor] belongs to an isolator on a floor, but [input] quantity = "base_acceleration" '
            "says that the base itself is driven; its motion is the input"
        )
    _check_columns(file, sections)
    if sections["sampling"]["unit"] is not None and sections["sampling"]["time"] is None:
        raise ValueError(
            f"{file}: [sampling] unit = {sections['sampling']['unit']!r} is that of the time column, but the "
            "field `time`, its name, is missing; a rate is always in Hz"
        )
    if sections["sampling"]["resample"] and sections["sampling"]["time"] is None:
        raise ValueError(
            f"{file}: [sampling] resample = true needs the field `time`, the column with the times of samples"
        )
    for number, record in enumerate(records, start=1):
        _check_kind(f"{file}: [[record]] number {number}", record)
    for name in CONDITIONS:
        _check_stated(file, name, records)
    if not any(record["role"] == "fit" for record in records):
        raise ValueError(f'{file}: no [[record]] has role = "fit"; at least one record is needed to fit')


def _check_columns(file: Path, sections: Mapping[str, Any]) -> None:
    named: dict[str, str] = {}
    for name in ("input", "output", "floor"):
        column = None if sections[name] is None else sections[name]["column"]
        if column in named:
            raise ValueError(
                f'{file}: [{named[column]}] and [{name}] both name column = "{column}"; '
                "they must be two different channels"
            )
        if column is not None:
            named[column] = name


def _check_stated(file: Path, name: str, records: tuple[Mapping[str, Any], ...]) -> None:
    """Refuses an operating condition that only some of the records state."""
    stated = [record[name] is not None for record in records]
    if any(stated) and not all(stated):
        lacking, having = stated.index(False), stated.index(True)
        raise ValueError(
            f'{file}: [[record]] number {lacking + 1}, file = "{records[lacking]["file"]}", lacks `{name}`, '
            f"but number {having + 1} has {name} = {records[having][name]:g}; state it of every record or "
            "of none"
        )


def _check_kind(where: str, record: Mapping[str, Any]) -> None:
    kind = record["kind"]
    for field, implied in (("period", "periodic"), ("schedule", "stepped_sine")):
        if record[field] is not None and kind not in (None, implied):
            raise ValueError(
                f'{where} has kind = "{kind}" and a {field}; a record with a {field} is of kind "{implied}"'
            )
    if kind == "periodic" and record["period"] is None:
        raise ValueError(f'{where} has kind = "periodic", but lacks the field `period` (samples)')
