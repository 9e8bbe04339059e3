"""Axes side by side and their labels, for the scripts of this folder."""

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from isojax.reporting.plots._style import axes_for, entitle


def panels(left: str, right: str) -> tuple[Figure, Axes, Axes]:
    """Two axes side by side with their titles."""
    figure = Figure(figsize=(7.0, 2.9), layout="constrained")
    first, second = figure.subplots(1, 2)
    for ax, title in ((first, left), (second, right)):
        axes_for(ax)
        entitle(ax, title)
    return figure, first, second


def label(ax: Axes, x: str, y: str) -> None:
    """Axis labels, and a legend where something has a name."""
    ax.set_xlabel(x)
    ax.set_ylabel(y)
    if ax.get_legend_handles_labels()[1]:
        ax.legend(fontsize=7, frameon=False)
