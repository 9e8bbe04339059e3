import base64
import dataclasses
import re
import shutil
from html.parser import HTMLParser

import pytest

from isojax import ClosedLoop
from isojax.reporting import render_page, result_dict, write_report
from isojax.reporting.plots import telling_slice


class Reader(HTMLParser):
    """Collects tags, addresses, names of places and text; refuses tags that close out of order."""

    def __init__(self):
        super().__init__()
        self.open, self.tags, self.addresses, self.text = [], [], [], []
        self.places, self.shown, self.pictures = [], [], []

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        if tag not in ("meta", "img", "br", "link"):
            self.open.append(tag)
        self.places += [value for name, value in attrs if name == "id"]
        self.pictures += [value for name, value in attrs if tag == "img" and name == "alt"]
        self.addresses += [value for name, value in attrs if name in ("src", "href", "srcset", "data")]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)
        # A summary is seen though what it folds is not.
        if "head" not in self.open and ("details" not in self.open or "summary" in self.open):
            self.shown.append(data)


def read(page):
    reader = Reader()
    reader.feed(page)
    assert reader.open == []
    return reader


@pytest.fixture(scope="module")
def page(written):
    return (written / "report.html").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def plain_folder(plain, written, tmp_path_factory):
    """The folder of another loop, into which it was written over the first, without Markdown."""
    folder = tmp_path_factory.mktemp("plain") / "out"
    shutil.copytree(written, folder)
    (folder / "mine.png").write_bytes(b"mine")
    write_report(plain, folder)
    return folder


@pytest.fixture(scope="module")
def plain_page(plain_folder):
    return (plain_folder / "report.html").read_text(encoding="utf-8")


def test_report_needs_nothing_from_outside(page, plain_page):
    for content in (page, plain_page):
        reader = read(content)
        assert not {"script", "link", "iframe", "object"} & set(reader.tags)
        assert all(address.startswith(("data:image/png;base64,", "#")) for address in reader.addresses)
        assert not re.search(r"https?://|url\(|@import", content)


def test_pictures_are_png_of_some_size(page):
    pictures = [entry.partition(",")[2] for entry in read(page).addresses if not entry.startswith("#")]
    assert len(pictures) >= 16
    for picture in pictures:
        data = base64.b64decode(picture)
        assert data.startswith(b"\x89PNG")
        assert len(data) > 5000


def test_every_picture_is_drawn(page, plain_page):
    for content in (page, plain_page):
        assert "could not be drawn" not in content


def test_at_most_nine_hundred_words_stand_before_the_folds(page, plain_page):
    for content in (page, plain_page):
        assert 150 < len(" ".join(read(content).shown).split()) <= 900


def test_the_contents_lead_to_places_of_the_page(page, plain_page):
    for content in (page, plain_page):
        reader = read(content)
        assert len(set(reader.places)) == len(reader.places)
        linked = [address[1:] for address in reader.addresses if address.startswith("#")]
        assert sorted(linked) == sorted(reader.places)
        assert {"error", "evidence", "words"} <= set(linked)


def test_what_convinces_stands_first(page, plain_page):
    lead = ["residual over the cycle", "force against velocity", "cross-correlation"]
    assert read(page).pictures[:3] == lead
    assert read(plain_page).pictures[:3] == ["largest residual", *lead[1:]]
    for content in (page, plain_page):
        pictures = read(content).pictures
        assert len(set(pictures)) == len(pictures)
        places = [content.index(part) for part in ('class="headline"', "<img", "<nav", "<table", "<details")]
        assert places == sorted(places)


def test_the_force_is_drawn_over_the_motion_along_which_the_models_differ(found):
    assert telling_slice(found.before) == "damping"
    assert telling_slice(found.before, found.after) == "damping"
    stiff = found.before.model.replace(linear_stiffness__coefficient=3e6)
    assert telling_slice(found.before, found.before._replace(model=stiff)) == "stiffness"


def test_words_of_other_schools_are_explained(page):
    text = " ".join(read(page).text)
    for word in (
        "describing function",
        "harmonic balance",
        "fit percent",
        "characteristic multiplier",
        "limit point",
    ):
        assert word in text


def test_the_words_are_those_of_the_field(page, plain_page):
    odd = r"(?i)\btold\b|pretend|what is left|leaves for noise|holds nothing of|comes? to lie|less inertia"
    for content in (page, plain_page):
        assert re.findall(odd, " ".join(read(content).text)) == []


def test_markdown_stands_beside_its_pictures(page, found, written):
    text = (written / "report.md").read_text(encoding="utf-8")
    pictures = re.findall(r"!\[[^]]+\]\(([^)]+)\)", text)
    assert len(pictures) == len(set(pictures)) == len(read(page).pictures)
    assert sorted(pictures) == sorted(path.name for path in written.glob("*.png"))
    assert all((written / name).read_bytes().startswith(b"\x89PNG") for name in pictures)
    assert text.index("Dry (Coulomb) friction, Fc = ") < text.index("![residual over the cycle]")
    assert str(found.after) in text
    tables = re.findall(r"(?:^\|.*\n)+", text, flags=re.MULTILINE)
    assert len(tables) >= 5
    for table in tables:
        rows = table.splitlines()
        assert len({len(re.findall(r"(?<!\\)\|", row)) for row in rows}) == 1, table
        assert re.fullmatch(r"\|[-:|]+\|", rows[1])


def test_markdown_of_an_earlier_run_goes_where_none_is_asked_for(plain_folder):
    left = sorted(path.name for path in plain_folder.glob("[!.]*"))
    assert left == ["fit.json", "mine.png", "model.json", "notes.txt", "report.html", "result.json"]


def test_headline_names_effect_strength_and_held_out_error(page, found):
    text = " ".join(read(page).text)
    before, after = (fit.errors["holdout"].chi2_per_dof for fit in (found.before, found.after))
    assert re.search(r"Dry \(Coulomb\) friction, Fc = \d+\.\d+ ± 0\.\d+ N", text)
    assert f"held-out χ²/dof {before:.2f} → {after:.2f}" in text
    assert "presliding (Dahl) friction, which these data cannot distinguish from it" in text
    assert "A test that separates them: a test at 5 N" in text


def test_report_without_dwells_or_holdout_says_so(plain_page):
    text = " ".join(read(plain_page).text)
    assert "Nothing is missing" in text
    assert "No record was held out" in text


def test_titles_are_escaped(plain_page):
    assert "<b>no dwells" not in plain_page
    assert "&lt;b&gt;no dwells &amp; no holdout" in plain_page


def test_fit_report_of_both_models_is_on_the_page(page, found):
    text = "".join(read(page).text)
    assert str(found.before) in text
    assert str(found.after) in text


def test_what_contradicts_the_declaration_stands_above_the_verdict(found):
    flipped = tuple(
        dataclasses.replace(record, input=-record.input, raw_input=-record.raw_input)
        for record in found.campaign.records
    )
    loop = dataclasses.replace(found, campaign=dataclasses.replace(found.campaign, records=flipped))
    assert loop.check_first
    text = "".join(read(render_page(loop)).text)
    assert text.index("wrong sign") < text.index("Verdict")
    assert "wrong sign" in str(result_dict(loop)["check_first"])


def test_closed_loop_shows_its_parts_and_prints_them(found):
    loop = ClosedLoop(found)
    assert loop.before is found.before
    assert loop.after is found.after
    assert loop.verdict == "found"
    assert [finding.effect for finding in loop.findings] == ["coulomb_friction"]
    assert loop.bounds == found.bounds
    assert loop.guess is found.guess
    assert loop.seconds == 12.5
    text = str(loop)
    assert "coulomb_friction.force_level" in text
    assert "held out" in text
