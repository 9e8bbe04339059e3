"""Stages of a long task on the terminal: one line each, live while the stage runs."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import Progress, ProgressColumn, SpinnerColumn, Task, TextColumn
from rich.table import Column
from rich.text import Text

from ._progress import KeyFigure, Stage


def _seconds(elapsed: float) -> str:
    return f"{elapsed:7.1f} s"


class _Elapsed(ProgressColumn):
    """Seconds since the stage was opened."""

    def render(self, task: Task) -> Text:
        return Text(_seconds(task.elapsed or 0.0))


@contextmanager
def stage_lines(console: Console) -> Iterator[Callable[[str], None]]:
    """Give what shows one line for each stage, with its seconds and its key figure once it is over.

    On a terminal the current stage has a live line, which ends with its latest step. Elsewhere a stage shows
    nothing before it is over. A stage that raises leaves no line.

    Args:
        console: where to show them.

    Yields:
        A callable that takes a line of progress.
    """
    shortened = Column(no_wrap=True, overflow="ellipsis")
    columns = (
        _Elapsed(Column(no_wrap=True)),
        SpinnerColumn(),
        TextColumn("{task.description}", markup=False, table_column=Column(no_wrap=True)),
        TextColumn("{task.fields[step]}", style="dim", markup=False, table_column=shortened),
    )
    stage, figure, opened = "", "", time.perf_counter()

    def close() -> None:
        if stage:
            line = f"{_seconds(time.perf_counter() - opened)}  {stage}"
            console.print(Text(f"{line}: {figure}" if figure else line, style="dim"), soft_wrap=True)

    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as live:
        task = live.add_task("", step="")

        def show(line: str) -> None:
            nonlocal stage, figure, opened
            if isinstance(line, Stage):
                close()
                stage, figure, opened = line, "", time.perf_counter()
                live.reset(task, description=line, step="")
            elif isinstance(line, KeyFigure):
                figure = line
            else:
                live.update(task, step=line, refresh=True)

        yield show
        close()


@contextmanager
def step_lines(console: Console) -> Iterator[Callable[[str], None]]:
    """Give what shows every line of progress, steps as well, with the seconds since the start.

    Args:
        console: where to show them.

    Yields:
        A callable that takes a line of progress.
    """
    begin = time.perf_counter()

    def show(line: str) -> None:
        console.print(Text(f"{_seconds(time.perf_counter() - begin)}  {line}", style="dim"), soft_wrap=True)

    yield show
