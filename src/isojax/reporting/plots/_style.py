"""How pictures look: colours that mean the same everywhere, and axes to draw on."""

import functools
from collections.abc import Callable, Mapping
from typing import Any, TypeVar, cast

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...identification import Fit, as_fit

_Draw = TypeVar("_Draw", bound=Callable[..., Any])

MEASURED = "#222222"
BEFORE = "#d1495b"
AFTER = "#1f6fb2"
NEUTRAL = "#9aa3ad"
BAND = "#dfe6ec"
CURVES = (3.0, 1.4)
"""Widths of curves before and after, so that the one shows where it coincides with the other."""

LEVELS = ("#0b3c6f", "#2a9d8f", "#e08e0b", "#a23b72", "#5f0f40", "#6b705c")
"""Colours of excitation levels, lowest first."""

ROLES: Mapping[str, str] = {"fit": "fitted", "holdout": "held out"}
"""What the roles of records are called."""


def fits_meant(draw: _Draw) -> _Draw:
    """Let what takes the fits before and after take what holds them as well.

    An extension or a closed loop by itself is both of its fits; after another fit it is its last one.

    Args:
        draw: a function of `before`, `after` and options.

    Returns:
        The same function of what is meant.
    """

    @functools.wraps(draw)
    def meant(before: Any, after: Any = None, **options: Any) -> Any:
        if after is None and isinstance(getattr(before, "before", None), Fit):
            before, after = before.before, before.after
        before = as_fit(before, "before")
        after = None if after is None else as_fit(after, "after")
        return draw(before, None if after is before else after, **options)

    return cast(_Draw, meant)


def pair(before: Any, after: Any) -> tuple[tuple[str, Any, str], ...]:
    """Give what is drawn for the models before and after, or for the only model.

    Args:
        before: of the declared model.
        after: of the extended model, or None.

    Returns:
        Label, what was given, colour.
    """
    if after is None:
        return (("model", before, AFTER),)
    return (("before", before, BEFORE), ("after", after, AFTER))


def axes_for(ax: Axes | None, width: float = 7.0, height: float = 3.2) -> tuple[Figure, Axes]:
    """Give axes to draw on, styled, and the figure that they belong to.

    Args:
        ax: axes of the caller, or None for a figure of their own.
        width: of that figure [inch].
        height: of that figure [inch].

    Returns:
        The figure and the axes.
    """
    if ax is None:
        ax = Figure(figsize=(width, height), layout="constrained").add_subplot()
    figure = ax.figure
    while not isinstance(figure, Figure):
        figure = figure.figure
    ax.grid(True, color="#e6e9ed", linewidth=0.6)
    ax.set_axisbelow(True)
    ax.spines[["top", "right"]].set_visible(False)
    ax.tick_params(labelsize=8)
    ax.xaxis.label.set_fontsize(9)
    ax.yaxis.label.set_fontsize(9)
    return figure, ax


def entitle(ax: Axes, title: str) -> None:
    """Write the title over axes, to the left."""
    ax.set_title(title, fontsize=9.5, loc="left")
