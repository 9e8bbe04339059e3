"""How pictures look: colours that mean the same everywhere, and axes to draw on."""

from collections.abc import Mapping

from matplotlib.axes import Axes
from matplotlib.figure import Figure

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
    """Write the title over axes, to the left.

    Args:
        ax: the axes.
        title: what is to be seen.
    """
    ax.set_title(title, fontsize=9.5, loc="left")
