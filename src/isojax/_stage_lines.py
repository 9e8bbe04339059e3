"""Stages of a long task on the terminal: one line each, live while the stage runs."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import Progress, ProgressColumn, SpinnerColumn, Task, TextColumn
from rich.table import Column
from rich.text import Text

from ._languages import as_rich, printable
from ._progress import Counted, KeyFigure, Notice, Resumed, Stage

_SILENCE = 4.0
"""Seconds without a word after which there is a sign of life: less than the five that a user waits."""


def _seconds(elapsed: float) -> str:
    return f"{elapsed:7.1f} s"


class _Elapsed(ProgressColumn):
    """Seconds since the stage was opened."""

    def render(self, task: Task) -> Text:
        return Text(_seconds(task.elapsed or 0.0))


class Pace:
    """Where a task stands: which stage of how many, and how long the rest will take.

    The time left is that of the stages that are over, times the usual share of what is to come over theirs;
    of a stage that counts what it does, the time of what is done, times what is not over what is.
    """

    def __init__(self, clock: Callable[[], float] = time.perf_counter):
        """Begin before the first stage.

        Args:
            clock: gives seconds.
        """
        self._clock = clock
        self._stage = Stage("")
        self._opened = clock()
        self._begun = 0
        self._over = self._spent = self._done = 0.0

    def open(self, stage: Stage) -> None:
        """Close the stage that is open, and open another.

        Args:
            stage: the other.
        """
        if self._stage.share > 0.0:
            self._over += self._stage.share
            self._spent += self._clock() - self._opened
        self._stage, self._opened, self._begun = stage, self._clock(), self._begun + 1
        self._done = 0.0

    def count(self, done: float) -> None:
        """Note how much of the stage that is open is done.

        Args:
            done: its share, 0 to 1.
        """
        self._done = done

    def forget(self) -> None:
        """Begin to measure here: what came before took no time."""
        self._over, self._spent, self._opened = 0.0, 0.0, self._clock()

    @property
    def place(self) -> str:
        """The stage that is open and how many there are, as far as is known, such as "[3/8]"."""
        return f"[{self._begun}/{self._begun + len(self._stage.to_come)}]"

    @property
    def left(self) -> float | None:
        """Seconds that are left [s]; None before a stage is over whose share is known, or a part counted."""
        counted, later = self._done > 0.0, sum(self._stage.to_come)
        if not counted and (self._over == 0.0 or self._stage.share + later == 0.0):
            return None
        elapsed = self._clock() - self._opened
        pace = self._spent / self._over if self._over else 0.0
        here = elapsed * (1.0 / self._done - 1.0) if counted else max(0.0, pace * self._stage.share - elapsed)
        return here + pace * later

    @property
    def words(self) -> str:
        """The time left in words, such as "about 2 min left"; "" where nobody knows."""
        left = self.left
        if left is None:
            return ""
        rounded = f"{left / 60.0:.0f} min" if left >= 90.0 else f"{max(5.0, 5.0 * round(left / 5.0)):.0f} s"
        return f"about {rounded} left"


class _Left(ProgressColumn):
    """Time left of the whole task."""

    def __init__(self, pace: Pace):
        """Take what knows it."""
        self._pace = pace
        super().__init__(Column(no_wrap=True))

    def render(self, task: Task) -> Text:
        return Text(self._pace.words, style="dim")


class Beat:
    """Lines where nothing can be redrawn: after a silence one begins, and grows by a dot while it lasts."""

    def __init__(self, console: Console, silence: float):
        """Begin to wait.

        Args:
            console: where to show them.
            silence: seconds after which there is a sign of life.
        """
        self._console, self._silence = console, silence
        self._lock, self._heard = threading.Lock(), threading.Event()
        self._over = self._begun = False
        self._words = ""
        self._thread = threading.Thread(target=self._wait, daemon=True)
        self._thread.start()

    def begin_with(self, words: str) -> None:
        """Give the words with which a line begins after a silence."""
        with self._lock:
            self._words = words
        self._heard.set()

    def say(self, line: str) -> None:
        """Write a line of its own."""
        with self._lock:
            self._end()
            self._write(line, "\n")
        self._heard.set()

    def finish(self, words: str, rest: str) -> None:
        """Write the words and the rest, only the rest where the line of these words is begun."""
        with self._lock:
            self._write(rest if self._begun else words + rest, "\n")
            self._begun = False
        self._heard.set()

    def close(self) -> None:
        """Stop, and end the line that is begun."""
        self._over = True
        self._heard.set()
        self._thread.join()
        self._end()

    def _wait(self) -> None:
        while not self._over:
            if self._heard.wait(self._silence):
                self._heard.clear()
                continue
            with self._lock:
                self._write("." if self._begun else f"{self._words} .".lstrip(), "")
                self._begun = True

    def _end(self) -> None:
        if self._begun:
            self._write("", "\n")
        self._begun = False

    def _write(self, words: str, end: str) -> None:
        self._console.print(as_rich(words, "dim"), soft_wrap=True, end=end)


@contextmanager
def stage_lines(
    console: Console, steps: bool = False, silence: float = _SILENCE
) -> Iterator[Callable[[str], None]]:
    """Give what shows one line for each stage, with its seconds and its key figure once it is over.

    On a terminal the current stage has a live line, with the time that is left and its latest step. Elsewhere
    its line begins after a silence, and grows by a dot after each further one. A stage that raises before
    leaves no line.

    Args:
        console: where to show them.
        steps: whether every line of progress is left as it comes, with the seconds since the start, and not
            only one for each stage.
        silence: seconds without a line after which there is a sign of life.

    Yields:
        A callable that takes a line of progress.
    """
    pace = Pace()
    shortened = Column(no_wrap=True, overflow="ellipsis")
    columns = (
        _Elapsed(Column(no_wrap=True)),
        SpinnerColumn(),
        TextColumn("{task.description}", markup=False, table_column=Column(no_wrap=True)),
        _Left(pace),
        TextColumn("{task.fields[step]}", style="dim", markup=False, table_column=shortened),
    )
    begin = opened = time.perf_counter()
    stage, figure = "", ""
    beat = None if console.is_terminal else Beat(console, silence)

    def leave(line: str) -> None:
        if beat is None:
            console.print(as_rich(line, "dim"), soft_wrap=True)
        else:
            beat.say(line)

    def close() -> None:
        elapsed, rest = time.perf_counter() - opened, f": {figure}" if figure else ""
        if not stage or steps:
            return
        if beat is None:
            leave(f"{_seconds(elapsed)}  {stage}{rest}")
        else:
            beat.finish(stage, f"{rest} ({elapsed:.1f} s)")

    try:
        with Progress(*columns, console=console, transient=True, disable=beat is not None) as live:
            task = live.add_task("", step="")

            def show(line: str) -> None:
                nonlocal stage, figure, opened
                if isinstance(line, Stage):
                    close()
                    pace.open(line)
                    line = stage = f"{pace.place} {line}"
                    figure, opened = "", time.perf_counter()
                    live.reset(task, description=stage, step="")
                    if beat is not None and not steps:
                        beat.begin_with(stage)
                elif isinstance(line, KeyFigure):
                    figure = line
                else:
                    if isinstance(line, Resumed):
                        pace.forget()
                    if isinstance(line, Counted):
                        pace.count(line.done)
                    live.update(task, step=printable(line), refresh=True)
                if steps or isinstance(line, Notice):
                    leave(f"{_seconds(time.perf_counter() - begin)}  {line}")

            yield show
            close()
    finally:
        if beat is not None:
            beat.close()
