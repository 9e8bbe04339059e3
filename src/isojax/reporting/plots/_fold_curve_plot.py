"""The curve of folds in the plane of the drive: a lens between two cusps."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from ...stability import FoldCurve
from ._draw_band import draw_band
from ._stability_style import MARKS, draw_special_points, drive_unit, drive_words, mark_handle, quantity
from ._style import BEFORE, axes_for, entitle

_INSIDE = "#f7dadd"

_OVER_MAP = "#c800c8"
"""Over the blues and reds of a map: neither."""


def plot_fold_curve(curve: FoldCurve, *, excitation: str = "force", ax: Axes | None = None) -> Figure:
    """Draw where orbits are born and vanish in pairs, over frequency and drive amplitude.

    Args:
        curve: the folds.
        excitation: "force" or "base_acceleration", as of the isolator: the unit of the drive.
        ax: axes to draw on.

    Returns:
        The figure.
    """
    figure, ax = axes_for(ax, 6.4, 4.2)
    handles = draw_lens(ax, curve, filled=True)
    frequency, amplitude = np.asarray(curve.frequency), np.asarray(curve.amplitude)
    for cusp in curve.cusps:
        x, y = float(cusp.frequency), float(cusp.amplitude)
        right = x > np.nanmean(frequency)
        ax.annotate(
            f"{quantity(x, 'Hz')}, {quantity(y, drive_unit(excitation))}",
            (x, y),
            xytext=(-9 if right else 9, -9 if right else 3),
            textcoords="offset points",
            ha="right" if right else "left",
            fontsize=8,
        )
    ax.margins(0.08)
    ax.set_xlabel("frequency [Hz]")
    ax.set_ylabel(drive_words(excitation))
    state = "closed" if bool(curve.closed) else "leaves the window"
    ends = [
        f"{np.nanmin(values):.4g} to {np.nanmax(values):.4g} {unit}"
        for values, unit in ((frequency, "Hz"), (amplitude, drive_unit(excitation)))
    ]
    entitle(ax, f"Folds: inside, orbits coexist and one is unstable ({state})\n{ends[0]}, {ends[1]}", handles)
    return figure


def draw_lens(ax: Axes, curve: FoldCurve, *, filled: bool) -> list[Any]:
    """Draw folds and their cusps.

    Args:
        ax: the axes, frequency across and drive amplitude up.
        curve: the folds.
        filled: whether to fill what a closed curve holds; if not, it lies over a map.

    Returns:
        Handles for a legend.
    """
    frequency, amplitude = np.asarray(curve.frequency), np.asarray(curve.amplitude)
    handles: list[Any] = []
    if filled and bool(curve.closed):
        ax.fill(frequency, amplitude, facecolor=_INSIDE, edgecolor="none", zorder=0)
        handles.append(Patch(facecolor=_INSIDE, label="several orbits"))
    colour, width = (BEFORE, 1.4) if filled else (_OVER_MAP, 1.0)
    if curve.band is not None:
        ends = (curve.band.lower, curve.band.upper)
        lower, upper = ((np.asarray(end["frequency"]), np.asarray(end["amplitude"])) for end in ends)
        draw_band(ax, lower, upper, colour)
    ax.plot(frequency, amplitude, color=colour, linewidth=width)
    handles.insert(0, Line2D([], [], color=colour, linewidth=width, label=MARKS["fold"].words))
    places = [("cusp", float(cusp.frequency), float(cusp.amplitude)) for cusp in curve.cusps]
    if draw_special_points(ax, places):
        handles.append(mark_handle("cusp"))
    return handles
