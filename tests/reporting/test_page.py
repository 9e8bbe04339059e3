import base64
import re
from html.parser import HTMLParser

import pytest

from isojax import ClosedLoop
from isojax.reporting import render_page


class Reader(HTMLParser):
    """Collects tags, addresses and text; refuses tags that close out of order."""

    def __init__(self):
        super().__init__()
        self.open, self.tags, self.addresses, self.text = [], [], [], []

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        if tag not in ("meta", "img", "br", "link"):
            self.open.append(tag)
        self.addresses += [value for name, value in attrs if name in ("src", "href", "srcset", "data")]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)


def read(page):
    reader = Reader()
    reader.feed(page)
    assert reader.open == []
    return reader


@pytest.fixture(scope="module")
def page(written):
    return (written / "report.html").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def plain_page(plain):
    return render_page(plain)


def test_report_needs_nothing_from_outside(page, plain_page):
    for content in (page, plain_page):
        reader = read(content)
        assert not {"script", "link", "iframe", "object"} & set(reader.tags)
        assert all(address.startswith("data:image/png;base64,") for address in reader.addresses)
        assert not re.search(r"https?://|url\(|@import", content)


def test_pictures_are_png_of_some_size(page):
    pictures = [entry.partition(",")[2] for entry in read(page).addresses]
    assert len(pictures) >= 16
    for picture in pictures:
        data = base64.b64decode(picture)
        assert data.startswith(b"\x89PNG")
        assert len(data) > 5000


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
