"""Pictures of the measured dwells on the model's branches: multipliers, and how far the next fold is."""

from collections.abc import Sequence
from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...health import REACH, DwellStability
from ..words import typeset_number
from ._style import LEVELS, NEUTRAL, axes_for, entitle


def plot_dwell_stability(
    dwells: Sequence[DwellStability],
    *,
    what: Literal["multiplier", "fold"] = "multiplier",
    ax: Axes | None = None,
) -> Figure:
    """Draw each measured dwell over frequency, by level: the largest multiplier, or the distance to a fold.

    Args:
        dwells: of all records; those without numbers are left out.
        what: "multiplier" for |mu|, "fold" for the change of the drive to the nearest fold [%], on a strip of
            its own where there is none within reach.
        ax: axes to draw on.

    Returns:
        The figure.
    """
    figure, ax = axes_for(ax)
    known = [one for one in dwells if not one.reason]
    levels = sorted({one.level for one in known if one.level is not None})
    reach = 100.0 * REACH[0]
    groups: list[tuple[float | None, str]] = [(one, f"level {typeset_number(one, 3)}") for one in levels]
    if any(one.level is None for one in known):
        groups.append((None, "no level"))
    for place, (level, label) in enumerate(groups):
        own = [one for one in known if one.level == level]
        frequency = np.array([one.dwell.frequency for one in own])
        if what == "multiplier":
            value = np.array([one.spectral_radius for one in own])
        else:
            value = np.array([100.0 * min(one.nearness, 2.0 * REACH[0]) for one in own])
            value = np.where(value > reach, 1.12 * reach, value)
        colour = LEVELS[place % len(LEVELS)]
        ax.plot(frequency, value, "o", color=colour, markersize=4, alpha=0.75, markeredgewidth=0, label=label)
    ax.set_xlabel("frequency [Hz]")
    if what == "multiplier":
        ax.axhline(1.0, color="black", linewidth=0.9, linestyle="--")
        ax.set_ylim(0.0, max(1.08, *(1.05 * one.spectral_radius for one in known)) if known else 1.08)
        ax.set_ylabel("|μ| [1]")
        entitle(ax, "share of a disturbance that remains after a cycle")
    else:
        ax.axhspan(1.04 * reach, 1.2 * reach, color=NEUTRAL, alpha=0.2, linewidth=0)
        marks = np.arange(0.0, reach + 1.0, 10.0)
        ax.set_yticks([*marks, 1.12 * reach], [*(f"{mark:.0f}" for mark in marks), "none"])
        ax.set_ylim(0.0, 1.2 * reach)
        ax.set_ylabel("change of drive to the fold [%]")
        entitle(ax, "how far the nearest fold of its branch is")
    return figure
