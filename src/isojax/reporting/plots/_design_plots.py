"""What to measure next, and what a design changes: bars, the best first."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..._languages import as_mathtext
from ...identification import NextTest
from ...inference import Design
from ..words import typeset_number
from ._style import AFTER, MEASURED, NEUTRAL, axes_for, entitle


def plot_next_test(test: NextTest, *, most: int = 12, ax: Axes | None = None) -> Figure:
    """Draw by which factor each proposed record shrinks the errors; with rivals, how far it separates them.

    Args:
        test: the proposals.
        most: how many are drawn.
        ax: axes to draw on.

    Returns:
        The figure.

    Raises:
        ValueError: if no record could be simulated.
    """
    some = [one for one in test.proposals if not one.reason][:most]
    if not some:
        raise ValueError("Argument `test` must hold a record that could be simulated, but holds none.")
    figure, ax = axes_for(ax, 7.6, 1.2 + 0.27 * len(some))
    rows = np.arange(len(some))
    sizes = [one.chi2 if test.rivals else one.shrinkage for one in some]
    ax.barh(rows, sizes, height=0.62, color=[AFTER, *(NEUTRAL,) * (len(some) - 1)])
    ax.set_yticks(rows, [one.experiment.words for one in some])
    ax.invert_yaxis()
    ax.grid(False, axis="y")
    if test.rivals:
        ax.set_xlabel("expected χ² between the two effects")
        entitle(ax, f"What separates {' from '.join(test.rivals).replace('_', ' ')}")
    else:
        ax.axvline(1.0, color=MEASURED, linewidth=0.8)
        ax.set_xlabel("standard error with the record over that without")
        entitle(ax, f"The next record, {typeset_number(test.seconds, 3)} s")
    return figure


def plot_design(design: Design, *, ax: Axes | None = None) -> Figure:
    """Draw by how much a design changes each coefficient, between its bounds.

    Args:
        design: the design.
        ax: axes to draw on.

    Returns:
        The figure.
    """
    figure, ax = axes_for(ax, 7.0, 1.2 + 0.35 * len(design.names))
    rows = np.arange(len(design.names))
    before = design.before
    size = np.where(before == 0.0, 1.0, np.abs(before))
    low, high = 100.0 * (design.lower - before) / size, 100.0 * (design.upper - before) / size
    ax.barh(rows, high - low, left=low, height=0.62, color="#e6e9ed", label="between the bounds")
    ax.barh(rows, 100.0 * design.changes, height=0.4, color=AFTER, label="design")
    ax.axvline(0.0, color=MEASURED, linewidth=0.8)
    words = [name.removesuffix(".coefficient").replace("_", " ").replace(".", ", ") for name in design.names]
    ax.set_yticks(rows, words)
    ax.invert_yaxis()
    ax.grid(False, axis="y")
    ax.set_xlabel("change [%]")
    kept = "; ".join(one.constraint.words for one in design.outcomes if one.kept)
    missed = "; ".join(design.missed)
    entitle(ax, as_mathtext(f"not reached: {missed}" if missed else kept or "no constraint"))
    return figure
