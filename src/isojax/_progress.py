"""Lines of progress: what opens a stage of a long task, what the stage gave, and the steps in between.

Every `progress=` is a callable that takes one line of text. A plain `str` is a step of the current stage, so
`progress=print` shows everything alike.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar


class Stage(str):
    """A line that opens a stage, such as "fit of the declared model".

    Attributes:
        share: its usual share of the time of the whole task [any unit]; 0 where nobody knows.
        to_come: the same of each stage that is expected after it.
    """

    share: float
    to_come: tuple[float, ...]

    def __new__(cls, words: str, share: float = 0.0, to_come: tuple[float, ...] = ()) -> "Stage":
        """Give the line."""
        stage = super().__new__(cls, words)
        stage.share, stage.to_come = share, to_come
        return stage


class KeyFigure(str):
    """A line that gives the result of the stage before it is over, such as "chi2/dof 1.02"."""


class Counted(str):
    """A step that knows how much of its stage is done, such as "2048 of 40000 orbits".

    Attributes:
        done: share of the stage, 0 to 1.
    """

    done: float

    def __new__(cls, words: str, done: float) -> "Counted":
        """Give the line."""
        counted = super().__new__(cls, words)
        counted.done = done
        return counted


LOOP_SHARES = (5.0, 8.0, 60.0, 12.0, 3.0, 6.0, 8.0)
"""Usual shares of the time of a loop that finds one effect, as `Stage.to_come` has them: classical guess,
fit, first diagnosis, each further one, separating experiments, other laws, free runs. Most of the time is
compiling, once a law."""

REPLACE_SHARE = 12.0
"""Usual share of the test whether a finding replaces another, which not every loop needs."""


class Notice(str):
    """A line that stays to be read, such as "what was kept belongs to another campaign"."""


class Resumed(Notice):
    """A line that says that what came before was not computed but kept: its time says nothing of the rest."""


def before(progress: Callable[[str], None], *shares: float) -> Callable[[str], None]:
    """Give a progress whose stages know that others come after theirs.

    Args:
        progress: receives the lines.
        shares: of the later stages, as in `Stage.to_come`.

    Returns:
        A callable that takes a line.
    """

    def say(line: str) -> None:
        if isinstance(line, Stage):
            line = Stage(line, line.share, (*line.to_come, *shares))
        progress(line)

    return say


_WATCHING: ContextVar[Callable[[str], None] | None] = ContextVar("watching", default=None)


@contextmanager
def watched(progress: Callable[[str], None]) -> Iterator[None]:
    """Give `step` someone to say its lines to: no picture of a report needs a `progress` of its own.

    Args:
        progress: receives them.
    """
    token = _WATCHING.set(progress)
    try:
        yield
    finally:
        _WATCHING.reset(token)


def step(line: str) -> None:
    """Say a step of the current stage to whoever watches.

    Args:
        line: the step.
    """
    progress = _WATCHING.get()
    if progress is not None:
        progress(line)


def silent(line: str) -> None:
    """Take a line of progress and say nothing.

    Args:
        line: the line.
    """
