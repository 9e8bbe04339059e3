"""A user's text in each language that it enters: nothing in it is taken for more than letters."""

import dataclasses
import re
import tomllib
from html.parser import HTMLParser

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from markdown_it import MarkdownIt
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text
from rich.console import Console
from users_names import NAMES, WORST, drawn, seen

from isojax import plot
from isojax._languages import as_code, as_html, as_markdown, as_mathtext, as_rich, as_toml, printable
from isojax.records import draft_campaign, inspect_file
from isojax.reporting import inspection_summary, render_text


def joined(words):
    return " ".join(words.split())


@drawn(100)
@example(name=WORST[0])
@given(name=NAMES)
def test_a_name_is_itself_in_html_markdown_toml_and_on_the_terminal(name):
    read = HTMLParser(convert_charrefs=True)
    text: list[str] = []
    read.handle_data = text.append
    read.handle_starttag = lambda *_: pytest.fail("a tag")
    read.feed(f"{as_html(name)} ")
    read.close()
    assert joined("".join(text)) == seen(name.replace("\n", " "))
    for before, after in (("# ", ""), ("| a |\n|---|\n| ", " |"), ("- ", ""), ("", "")):
        parsed = MarkdownIt("commonmark").enable("table").parse(before + as_markdown(name) + after)
        inline = [token for token in parsed if token.children][-1]
        assert {one.type for one in inline.children} == {"text"}
        assert joined(inline.children[0].content) == seen(name)
    assert tomllib.loads(f"name = {as_toml(name)}  # {printable(name)}")["name"] == name
    console = Console(width=300, force_terminal=True, color_system="truecolor", highlight=False)
    with console.capture() as captured:
        console.print(as_rich(name), soft_wrap=True)
    assert joined(captured.get()) == seen(name)


@drawn(20)
@example(lines=["```", "````", "x"])
@given(lines=st.lists(NAMES, min_size=1, max_size=4))
def test_a_block_of_code_cannot_be_left(lines):
    (block,) = MarkdownIt("commonmark").parse(as_code("\n".join(lines)))
    assert block.type == "fence"
    assert block.content == printable("\n".join(lines), keep="\n") + "\n"


@drawn(40)
@example(name=WORST[0])
@example(name="$\\frac$")
@given(name=NAMES)
def test_matplotlib_draws_a_name_letter_by_letter(name):
    figure = Figure()
    label = figure.add_subplot().plot([0.0, 1.0], label=as_mathtext(name))[0].get_label()
    assert not label.startswith("_")
    text = Text(0, 0, label)
    shown, mathematics = text._preprocess_math(label)
    assert not mathematics
    assert joined(shown) == seen(name)


@drawn(12)
@example(names=list(WORST[:2]))
@given(names=st.lists(NAMES, min_size=2, max_size=2, unique_by=seen))
def test_inspection_shows_draws_and_drafts_channels_of_any_name(names, tmp_path_factory):
    force = np.random.default_rng(4).normal(size=400)
    data = {names[0]: force, names[1]: 0.5 * force + 0.01}
    found = inspect_file("run", rate=100.0, data=data)
    found = dataclasses.replace(found, file=tmp_path_factory.mktemp("data") / "$x$ [red].csv")
    text = render_text(inspection_summary([found]), width=300)
    assert "$x$ [red].csv" in text
    for name in names:
        assert seen(name) in joined(text)
    assert not re.search("[\x1b\u202a-\u202e]", text)
    drafted = tomllib.loads(draft_campaign([found], found.file.parent))
    assert {drafted["input"]["column"], drafted["output"]["column"]} == set(names)
    assert drafted["record"][0]["file"] == "$x$ [red].csv"
    figure = plot.inspection([found])
    renderer = FigureCanvasAgg(figure).get_renderer()
    for text in figure.findobj(Text):
        text.get_window_extent(renderer)
    assert len(figure.axes[2].get_legend().get_texts()) == 2
