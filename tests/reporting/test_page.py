import base64
import contextlib
import dataclasses
import json
import re
import shutil
from html.parser import HTMLParser

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from markdown_it import MarkdownIt
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text
from users_names import NAMES, WORST, drawn, seen

import isojax
from isojax import ClosedLoop
from isojax.reporting import loop_summary, png_bytes, render_page, render_text, result_dict, write_report
from isojax.reporting.page import _page
from isojax.reporting.page._identified_response import IdentifiedResponse
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


@contextlib.contextmanager
def named(loop, names):
    """The kept loop under other names, which its frozen objects hold; its answers stay."""
    held = [(loop.campaign, "title"), *((record, "name") for record in loop.campaign.records)]
    kept = [getattr(one, field) for one, field in held]
    try:
        for (one, field), name in zip(held, names, strict=True):
            object.__setattr__(one, field, name)
        yield loop
    finally:
        for (one, field), name in zip(held, kept, strict=True):
            object.__setattr__(one, field, name)


@pytest.fixture(scope="module")
def pages(found, page):
    """Gives the pages of the kept loop under other names, with blank pictures of the names that it has."""
    health, response = ClosedLoop(found).health, IdentifiedResponse(("Not asked here.",))
    blank = png_bytes(Figure(figsize=(0.5, 0.5)))
    pictures = tuple(_page.Picture(name, "as drawn", blank) for name in read(page).pictures)
    sections = ("lead", "response", "error", "evidence", "remainder", "record", "force", "health")
    drawn_once = {f"{section}_pictures": () for section in sections} | {"lead_pictures": pictures}

    def under(names):
        dwells = tuple(one._replace(record=names[1]) for one in health.dwells)
        with named(found, names):
            return _page.render_pages(
                _page.page_content(found, health._replace(dwells=dwells)), markdown=True
            )

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(_page, "draw_pictures", lambda *_: drawn_once)
        patch.setattr(_page, "identified_response", lambda _: response)
        yield under


@pytest.fixture(scope="module")
def plain_parts(pages):
    """Tags of the page and parts of its Markdown under names without a meaning."""
    plain = pages(["plain", "a", "b", "c"])
    return read(plain["report.html"]).tags, markdown_parts(plain["report.md"])[0]


def markdown_parts(text):
    """Kinds of the blocks of a Markdown text, and of what stands in each; its first heading."""
    blocks = MarkdownIt("commonmark").enable("table").parse(text)
    kinds = [(one.type, {part.type for part in one.children or ()} - {"text"}) for one in blocks]
    return kinds, " ".join("".join(part.content for part in blocks[1].children).split())


@drawn(15)
@example(names=list(WORST))
@given(names=st.lists(NAMES, min_size=4, max_size=4))
def test_any_names_are_shown_letter_by_letter_in_the_browser_and_in_markdown(
    names, pages, plain_parts, browser, tmp_path
):
    one = pages(names)
    assert read(one["report.html"]).tags == plain_parts[0]
    kinds, heading = markdown_parts(one["report.md"])
    assert kinds == plain_parts[1]
    assert heading == seen(names[0])
    path = tmp_path / "report.html"
    path.write_text(one["report.html"], encoding="utf-8")
    browser.open(path, 1280)
    heading, tab, body, pictures, scripts = browser.value(
        """(() => { document.querySelectorAll("details").forEach((one) => { one.open = true; });
        const drawn = [...document.images].filter((one) => one.naturalWidth).length;
        return [document.querySelector("h1").innerText, document.title, document.body.innerText,
                drawn, document.scripts.length]; })()"""
    )
    title = " ".join(names[0].split("\n"))
    assert " ".join(heading.split()) == seen(title)
    assert " ".join(tab.split()) == f"{seen(title)}: found"
    assert seen(" ".join(names[1].split("\n"))) in " ".join(body.split())
    assert pictures >= 16
    assert scripts == 0
    assert not re.search("[\x1b\u200e\u200f\u202a-\u202e\u2066-\u2069]", body)
    assert [address for address in browser.requests if not address.startswith(("data:", "file:"))] == []


@drawn(4)
@example(names=list(WORST))
@given(names=st.lists(NAMES, min_size=4, max_size=4))
def test_any_names_stand_in_pictures_tables_and_json(names, found):
    with named(found, names):
        records = [names[1] in record.name for record in found.campaign.records]
        assert records[0]
        figures = [
            isojax.plot.record(found.campaign.records[0], found.campaign),
            isojax.plot.time_history(found.before, found.after, record=0),
            isojax.plot.residual(found.before, found.after, record=1),
            isojax.plot.cycle_residual(found.before, found.after),
            isojax.plot.stiffness_scatter(found.before, found.after),
        ]
        assert json.loads(json.dumps(result_dict(found)))["campaign"] == names[0]
        for text in (render_text(loop_summary(found)), str(found.after), str(found.campaign)):
            assert not re.search("[\x1b\u202a-\u202e\u2066-\u2069]", text)
        assert seen(names[0]) in " ".join(str(found.campaign).split())
    for figure in figures:
        renderer = FigureCanvasAgg(figure).get_renderer()
        for text in figure.findobj(Text):
            text.get_window_extent(renderer)
    for figure, name in zip(figures[:3], (names[1], names[1], names[2]), strict=True):
        shown = figure.axes[0].get_title(loc="left")
        assert seen(name) in " ".join(shown.replace("\\$", "$").split())
