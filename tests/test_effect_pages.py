"""docs/effects has a page for each effect of the catalogue, listed there, with parameters as declared."""

import re
from pathlib import Path

import pytest

from isojax._parameters import own_parameters
from isojax.elements import CATALOGUE

FOLDER = Path(__file__).parents[1] / "docs" / "effects"


def test_the_list_of_pages_links_each_effect_once_and_nothing_else():
    links = re.findall(r"\[(\w+)\]\((\w+)\.md\)", (FOLDER / "README.md").read_text(encoding="utf-8"))
    assert all(words == target for words, target in links)
    assert sorted(target for _, target in links) == sorted(CATALOGUE)


def test_there_is_no_page_without_an_effect():
    assert {path.stem for path in FOLDER.glob("*.md")} - {"README"} == set(CATALOGUE)


@pytest.mark.parametrize("name", CATALOGUE)
def test_a_page_gives_name_parameters_units_picture_look_alikes_and_source(name):
    page = (FOLDER / f"{name}.md").read_text(encoding="utf-8")
    assert f"`{name}`" in page.splitlines()[0]
    rows = [line.split("|") for line in page.splitlines() if line.startswith("|")]
    for field, spec in own_parameters(CATALOGUE[name]):
        own = [row for row in rows if field in re.findall(r"\w+", row[1])]
        assert own, f"{field} has no row"
        assert spec.unit in own[0][3]
    pictures = re.findall(r"!\[[^\]]+\]\(([^)]+)\)", page)
    assert pictures
    for picture in pictures:
        assert (FOLDER / picture).stat().st_size <= 85_000
    assert re.search(r"look|Look", page)
    assert re.search(r"Source", page)


def test_every_picture_is_on_a_page():
    shown = {
        picture
        for path in FOLDER.glob("*.md")
        for picture in re.findall(r"!\[[^\]]+\]\(([^)]+)\)", path.read_text(encoding="utf-8"))
    }
    assert shown == {path.name for path in FOLDER.glob("*.png")}


@pytest.mark.parametrize("page", sorted(FOLDER.glob("*.md")), ids=lambda path: path.stem)
def test_names_in_tables_of_look_alikes_are_in_the_catalogue(page):
    for line in page.read_text(encoding="utf-8").splitlines():
        cell = line.split("|")[1] if line.startswith("| ") else ""
        names = re.findall(r"`([a-z]+(?:_[a-z]+)+)`", cell)
        fields = {field for kind in CATALOGUE.values() for field, _ in own_parameters(kind)}
        assert set(names) <= set(CATALOGUE) | fields
