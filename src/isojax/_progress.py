"""Lines of progress: what opens a stage of a long task, what the stage gave, and the steps in between.

Every `progress=` is a callable that takes one line of text. A plain `str` is a step of the current stage, so
`progress=print` shows everything alike.
"""


class Stage(str):
    """A line that opens a stage, such as "fit of the declared model"."""


class KeyFigure(str):
    """A line that gives the result of the stage before it is over, such as "chi2/dof 1.02"."""


def silent(line: str) -> None:
    """Take a line of progress and say nothing.

    Args:
        line: the line.
    """
