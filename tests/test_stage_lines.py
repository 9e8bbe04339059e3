"""Progress on the terminal: one line a stage, its steps only where asked for."""

import io
import re

import pytest
from rich.console import Console

from isojax._progress import KeyFigure, Stage
from isojax._stage_lines import stage_lines, step_lines

LINES = (
    Stage("classical guess"),
    Stage("fit"),
    "step 1: chi2/dof 118",
    "step 2: chi2/dof [1.02]",
    KeyFigure("chi2/dof 1.02"),
    Stage("report"),
)


def shown(display, terminal=False, lines=LINES):
    """What a display writes, with every number of seconds as 0.0."""
    file = io.StringIO()
    with display(Console(file=file, width=100, force_terminal=terminal, highlight=False)) as progress:
        for line in lines:
            progress(line)
    return re.sub(r" +\d+\.\d s", "0.0 s", file.getvalue())


def test_each_stage_leaves_one_line_with_its_key_figure():
    expected = ["0.0 s  classical guess", "0.0 s  fit: chi2/dof 1.02", "0.0 s  report"]
    assert shown(stage_lines).splitlines() == expected


def test_verbose_shows_every_line():
    assert [line.split("s  ")[1] for line in shown(step_lines).splitlines()] == list(map(str, LINES))


def test_a_terminal_shows_the_current_step_and_keeps_only_the_stages():
    written = shown(stage_lines, terminal=True)
    assert "step 2: chi2/dof [1.02]" in written
    kept = [line for line in written.replace("\r", "\n").splitlines() if "chi2/dof 1.02" in line]
    assert len(kept) == 1
    assert "step" not in kept[0]


def test_a_stage_that_raises_leaves_no_line_and_hides_no_error():
    def fail(progress):
        progress(Stage("reading"))
        raise ValueError("bad file")

    file = io.StringIO()
    with pytest.raises(ValueError, match="bad file"), stage_lines(Console(file=file)) as progress:
        fail(progress)
    assert file.getvalue() == ""
