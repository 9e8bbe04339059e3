"""Progress on the terminal: one line a stage, its steps only where asked for."""

import io
import re
import time

import pytest
from rich.console import Console

from isojax._progress import KeyFigure, Resumed, Stage, before
from isojax._stage_lines import Pace, stage_lines

LINES = (
    Stage("classical guess", 1.0, (3.0, 1.0)),
    Stage("fit", 3.0, (1.0,)),
    "step 1: chi2/dof 118",
    "step 2: chi2/dof [1.02]",
    KeyFigure("chi2/dof 1.02"),
    Stage("report", 1.0),
)


def shown(terminal=False, steps=False, lines=LINES):
    """What a display writes, with every number of seconds as 0.0."""
    file = io.StringIO()
    console = Console(file=file, width=100, force_terminal=terminal, highlight=False)
    with stage_lines(console, steps=steps) as progress:
        for line in lines:
            progress(line)
    return re.sub(r" *\d+\.\d s", "0.0 s", file.getvalue())


def test_each_stage_leaves_one_line_with_its_key_figure():
    expected = ["[1/3] classical guess (0.0 s)", "[2/3] fit: chi2/dof 1.02 (0.0 s)", "[3/3] report (0.0 s)"]
    assert shown().splitlines() == expected


class Watched(io.StringIO):
    """A file that notes when something is written to it."""

    def __init__(self):
        super().__init__()
        self.times = [time.perf_counter()]

    def write(self, text):
        self.times.append(time.perf_counter())
        return super().write(text)


@pytest.mark.parametrize("steps", [False, True])
def test_elsewhere_a_long_stage_shows_a_sign_of_life_and_still_leaves_one_line(steps):
    file = Watched()
    with stage_lines(Console(file=file, width=40), steps=steps, silence=0.1) as progress:
        for line in (Stage("guess"), KeyFigure("done"), Stage("fit"), KeyFigure("chi2/dof 1.02")):
            progress(line)
            if line == "fit":
                time.sleep(0.75)
                assert "fit" in file.getvalue()
    silences = [later - earlier for earlier, later in zip(file.times, file.times[1:], strict=False)]
    assert max(silences) < 0.7
    said = re.sub(r" *\d+\.\d s", "0.0 s", file.getvalue()).splitlines()
    if steps:
        assert [line for line in said if set(line) != {"."}] == [
            f"0.0 s  {line}" for line in ("[1/1] guess", "done", "[2/2] fit", "chi2/dof 1.02")
        ]
    else:
        assert re.sub(r"\.{3,}", "...", said[1]) == "[2/2] fit ...: chi2/dof 1.02 (0.0 s)"
        assert said == ["[1/1] guess: done (0.0 s)", said[1]]


def test_a_long_stage_that_raises_ends_its_line():
    def fail(progress):
        progress(Stage("fit"))
        while not file.getvalue():
            time.sleep(0.01)
        raise ValueError("bad")

    file = io.StringIO()
    with pytest.raises(ValueError, match="bad"), stage_lines(Console(file=file), silence=0.02) as progress:
        fail(progress)
    assert re.fullmatch(r"\[1/1\] fit \.+\n", file.getvalue())


def test_verbose_shows_every_line():
    left = [re.sub(r"^\[./3\] ", "", line.split("s  ")[1]) for line in shown(steps=True).splitlines()]
    assert left == list(map(str, LINES))


def test_a_terminal_shows_the_current_step_and_keeps_only_the_stages():
    written = shown(terminal=True)
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


class Clock:
    """Seconds that pass when a test lets them."""

    def __init__(self):
        self.now = 0.0

    def __call__(self):
        return self.now


def test_time_left_is_the_pace_so_far_times_the_share_to_come():
    clock = Clock()
    pace = Pace(clock)
    pace.open(Stage("guess", 2.0, (6.0, 4.0)))
    clock.now = 10.0
    assert (pace.place, pace.left, pace.words) == ("[1/3]", None, "")
    pace.open(Stage("fit", 6.0, (4.0,)))
    clock.now = 20.0  # 5 s a share: 30 s for this stage, of which 10 are over, and 20 for the next
    assert (pace.place, pace.left, pace.words) == ("[2/3]", 40.0, "about 40 s left")
    clock.now = 100.0  # later than was expected, the rest is not less than the stages to come
    assert pace.left == 20.0


def test_a_stage_that_counts_tells_its_own_time_left():
    clock = Clock()
    pace = Pace(clock)
    pace.open(Stage("map", to_come=(0.0,)))
    clock.now = 30.0
    assert pace.left is None
    pace.count(0.25)  # a quarter took 30 s
    assert (pace.left, pace.words) == (90.0, "about 2 min left")
    pace.open(Stage("pictures"))
    assert pace.left is None


def test_what_was_kept_says_nothing_of_the_time_left():
    clock = Clock()
    pace = Pace(clock)
    pace.open(Stage("fit", 6.0, (60.0,)))
    clock.now = 0.1
    pace.open(Stage("diagnosis", 60.0))
    clock.now = 0.2
    pace.forget()
    assert pace.left is None
    clock.now = 60.2
    pace.open(Stage("report", 30.0))
    assert pace.left == pytest.approx(30.0)


def test_a_resumed_run_says_so_once():
    lines = (Stage("fit", 1.0), "step 1", Resumed("3 finished computations were kept"), "step 2")
    assert shown(lines=lines).splitlines() == [
        "0.0 s  3 finished computations were kept",
        "[1/1] fit (0.0 s)",
    ]


def test_later_stages_of_others_are_counted():
    heard = []
    before(heard.append, 30.0)(Stage("free runs", 8.0, (2.0,)))
    assert (heard[0].share, heard[0].to_come) == (8.0, (2.0, 30.0))
