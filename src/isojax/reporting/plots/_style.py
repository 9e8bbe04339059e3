"""How pictures look: colours that mean the same everywhere, and axes to draw on."""

from collections.abc import Mapping
from typing import Any

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
