"""The site has a complete page for each effect of the catalogue, made from what the effect declares."""

import importlib.util
import inspect
import re
from pathlib import Path

import pytest

from isojax._parameters import own_parameters
from isojax.elements import CATALOGUE

DOCS = Path(__file__).parents[1] / "docs"
FOLDER = DOCS / "effects"
SPEC = importlib.util.spec_from_file_location("build_catalogue", DOCS / "build_catalogue.py")
assert SPEC is not None
build_catalogue = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(build_catalogue)

PAGES = build_catalogue.pages()
PICTURE = r"!\[[^\]]+\]\(([^)]+)\)"


def test_the_list_of_pages_links_each_effect_once_and_nothing_else():
    links = re.findall(r"\[(\w+)\]\((\w+)\.md\)", PAGES["README.md"])
    assert all(words == target for words, target in links)
    assert sorted(target for _, target in links) == sorted(CATALOGUE)
    assert set(PAGES) == {"README.md", *(f"{name}.md" for name in CATALOGUE)}


def test_there_are_no_notes_without_an_effect():
    assert {path.stem for path in FOLDER.glob("*.md")} <= set(CATALOGUE)


@pytest.mark.parametrize("name", CATALOGUE)
@pytest.mark.parametrize("notes", [False, True], ids=["alone", "with notes"])
def test_a_page_gives_name_law_parameters_units_look_alikes_and_source(name, notes):
    kind = CATALOGUE[name]
    page = PAGES[f"{name}.md"] if notes else build_catalogue.page(name)
    assert page.splitlines()[0].lower() == f"# {kind.words.lower()}: `{name}`"
    assert inspect.getdoc(kind).split("\n\n")[1] in page
    rows = [line.split("|") for line in page.splitlines() if line.startswith("|")]
    for field, spec in own_parameters(kind):
        own = [row for row in rows if f"`{field}`" in row[1]]
        assert [cell.strip() for cell in own[0][2:4]] == [spec.symbol, spec.unit]
        assert len(own[0][6].strip()) > 0
    assert page.count(f"`{kind.strength}` (strength)") == 1
    assert re.search(r"^Source: .{8}", page, re.MULTILINE)


@pytest.mark.parametrize("name", CATALOGUE)
def test_both_pages_of_a_pair_of_look_alikes_give_the_test_that_separates_them(name):
    for alike in CATALOGUE[name].look_alikes:
        for other in alike.others:
            for one, two in ((name, other), (other, name)):
                rows = [row for row in build_catalogue.page(one).splitlines() if f"]({two}.md)" in row]
                assert len(rows) == 1
                assert alike.test in rows[0]
                assert ("exactly" in rows[0]) == alike.exact
                assert all(f"`{needed}`" in rows[0] for needed in alike.beside)


def test_notes_become_part_of_the_page_of_their_effect():
    assert "## Signature\n\n- Stands here." in build_catalogue.page(
        "clipping", "## Signature\n\n- Stands here.\n"
    )


def test_look_alikes_of_notes_and_of_the_classes_make_one_table():
    notes = "## Look-alikes\n\n| it could be | what separates the two |\n|---|---|\n"
    notes += (
        "| `dahl_friction`, `linear_damping` | the level |\n| `bouc_wen` far away | the place |\n\nMeasure.\n"
    )
    page = build_catalogue.page("coulomb_friction", notes)
    assert page.count("## Look-alikes") == 1
    assert page.index("the place") < page.index("Measure.") < page.index("Source:")
    rows = [line for line in page.splitlines() if line.startswith("|") and "friction" in line]
    assert ["| the level |" in row for row in rows if "](dahl_friction.md)" in row] == [True]
    assert "| `linear_damping` | not declared | the level | |" in page
    assert "| `bouc_wen` far away | not declared | the place | |" in page


def test_no_row_by_hand_is_lost_from_a_page():
    for name in CATALOGUE:
        notes = FOLDER / f"{name}.md"
        for row in re.findall(r"^\| .*\|$", notes.read_text("utf-8") if notes.exists() else "", re.MULTILINE):
            names, said = (cell.strip() for cell in re.split(r"(?<!\\)\|", row)[1:3])
            assert said in PAGES[f"{name}.md"] or names == "it could be"
            assert all(word in PAGES[f"{name}.md"] for word in re.findall(r"`\w+`", names))


def test_every_picture_is_on_a_page_and_of_a_size_that_loads():
    shown = {picture for page in PAGES.values() for picture in re.findall(PICTURE, page)}
    assert shown == {path.name for path in FOLDER.glob("*.png")}
    assert all((FOLDER / picture).stat().st_size <= 85_000 for picture in shown)


@pytest.mark.parametrize("page", PAGES)
def test_names_in_tables_of_look_alikes_are_in_the_catalogue(page):
    for line in PAGES[page].splitlines():
        cell = line.split("|")[1] if line.startswith("| ") else ""
        names = re.findall(r"`([a-z]+(?:_[a-z]+)+)`", cell)
        fields = {field for kind in CATALOGUE.values() for field, _ in own_parameters(kind)}
        assert set(names) <= set(CATALOGUE) | fields
