"""How pictures look: colours that mean the same everywhere, and axes to draw on."""

import functools
import textwrap
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar, cast

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..._languages import as_mathtext
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

_LEGEND_SIZE, _LEGEND_ROW, _LEGEND_HANDLE, _LEGEND_LETTER = 7.5, 11.0, 28.0, 3.9
_TITLE_LETTER = 4.9
"""Sizes of the text over axes [points]: a line of the legend, what stands before its words, a letter."""

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
    ax.grid(True, color="#e6e9ed", linewidth=0.6)
    ax.set_axisbelow(True)
    ax.spines[["top", "right"]].set_visible(False)
    ax.tick_params(labelsize=8)
    ax.xaxis.label.set_fontsize(9)
    ax.yaxis.label.set_fontsize(9)
    return _figure(ax), ax


def _figure(ax: Axes) -> Figure:
    """Give the figure that holds axes, also where they stand in a part of it."""
    figure = ax.figure
    while not isinstance(figure, Figure):
        figure = figure.figure
    return figure


def entitle(ax: Axes, title: str, handles: Sequence[Artist] | None = None) -> None:
    """Write the title over axes, to the left, and between both the legend, where it hides no data.

    Args:
        ax: axes on which everything is drawn.
        title: its words; wrapped where the axes are too narrow for them.
        handles: entries of the legend; what is labelled, if omitted.
    """
    entries = ax.get_legend_handles_labels()[0] if handles is None else list(handles)
    width = 72.0 * _figure(ax).get_figwidth() * ax.get_position().width
    lines = [textwrap.fill(line, max(20, int(width / _TITLE_LETTER))) for line in title.split("\n")]
    rows = 0
    if entries:
        lengths = [len(str(entry.get_label())) * _LEGEND_LETTER + _LEGEND_HANDLE for entry in entries]
        columns = max(1, min(len(entries), int(width / max(lengths))))
        rows = -(-len(entries) // columns)
        ax.legend(
            handles=entries,
            loc="lower left",
            bbox_to_anchor=(0.0, 1.0),
            borderaxespad=0.2,
            borderpad=0.0,
            labelspacing=0.25,
            columnspacing=1.2,
            handlelength=1.6,
            fontsize=_LEGEND_SIZE,
            ncols=columns,
            frameon=False,
        )
    ax.set_title("\n".join(lines), fontsize=9.5, loc="left", pad=6.0 + rows * _LEGEND_ROW)


def parameter_label(name: str) -> str:
    """Give the name of a parameter as an axis shows it.

    Args:
        name: such as "linear_stiffness.coefficient".

    Returns:
        Such as "linear stiffness".
    """
    return as_mathtext(name.removesuffix(".coefficient").replace("_", " ").replace(".", ", "))
