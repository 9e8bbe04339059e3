"""docs/campaign.md says of every field what the reader of campaign.toml accepts; its examples are read."""

import re
import tomllib
from pathlib import Path

import pytest

from isojax.elements import CATALOGUE
from isojax.records._physical_limits import GAIN, MASS, ORDER, RATE, SHARE, SIZE, TIME
from isojax.records.reading._declaration import RECORD, SECTIONS, read_declaration

PAGE = (Path(__file__).parents[1] / "docs" / "campaign.md").read_text(encoding="utf-8")
EXAMPLES = re.findall(r"^### ([^\n]+)\n.*?^```toml\n(.*?)^```", PAGE, flags=re.MULTILINE | re.DOTALL)
KNOWN = {(section, name): field for section, fields in SECTIONS.items() for name, field in fields.items()}
KNOWN |= {("record", name): field for name, field in RECORD.items()}


def described() -> dict[tuple[str, str], list[str]]:
    """Cells of the row of each field, by section and field."""
    rows: dict[tuple[str, str], list[str]] = {}
    for block in re.split(r"^## ", PAGE, flags=re.MULTILINE):
        heading = re.match(r"\[+(\w+)\]+\n", block)
        for line in block.splitlines() if heading else ():
            cells = [cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]]
            if len(cells) == 5 and re.fullmatch(r"`\w+`", cells[0]):
                rows[heading[1], cells[0].strip("`")] = cells
    return rows


def test_every_field_is_described_and_every_described_field_is_known():
    assert set(described()) == set(KNOWN)


@pytest.mark.parametrize("key", KNOWN, ids=".".join)
def test_default_and_choices_of_a_field_are_those_of_the_reader(key):
    field, (_, kind, _, default, meaning) = KNOWN[key], described()[key]
    assert meaning.endswith(".")
    assert set(field.choices) == (set(re.findall(r"`(\w+)`", kind)) if field.choices else set())
    if field.required:
        assert default == "required"
    elif field.default is None:
        assert default == "none"
    else:
        stated = tomllib.loads(f"it = {default}")["it"]
        assert (tuple(stated) if isinstance(stated, list) else stated) == field.default
        assert field.accepts(stated)


def test_limits_of_numbers_are_those_of_the_reader():
    for limits in (GAIN, MASS, ORDER, RATE, SHARE, SIZE, TIME):
        assert f"| {limits.words} |" in PAGE


@pytest.mark.parametrize("side", ["stiffness", "damping"])
def test_names_of_springs_and_dampers_are_those_of_the_catalogue(side):
    ending, *listed = re.findall(r"`(\w+)`", described()["model", side][4])
    assert ending == f"_{side}"
    assert len(listed) >= 3
    assert {f"{name}_{side}" for name in listed} <= set(CATALOGUE)


@pytest.mark.parametrize(("title", "text"), EXAMPLES, ids=[title for title, _ in EXAMPLES])
def test_an_example_is_read_without_complaint(title, text, tmp_path):
    (tmp_path / "campaign.toml").write_text(text, encoding="utf-8")
    declared = read_declaration(tmp_path)
    assert {record["role"] for record in declared.records} == {"fit", "holdout"}


def test_there_is_an_example_for_each_kind_of_input():
    drives = {tomllib.loads(text)["input"]["quantity"] for _, text in EXAMPLES}
    assert drives == set(KNOWN["input", "quantity"].choices)


def test_every_field_stands_in_an_example_but_for_three():
    written = {
        (section, name)
        for _, text in EXAMPLES
        for section, table in tomllib.loads(text).items()
        for entry in (table if isinstance(table, list) else [table])
        for name in entry
    }
    assert set(KNOWN) - written == {("input", "gain_free"), ("filter", "kind"), ("record", "kind")}
