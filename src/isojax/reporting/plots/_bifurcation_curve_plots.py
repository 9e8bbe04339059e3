"""Curves of bifurcations in the plane of the drive: the lens of folds between two cusps, and the others."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from ...stability import FoldCurve, NeimarkSackerCurve, PeriodDoublingCurve
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
    _draw_curve_band(ax, curve, colour)
    ax.plot(frequency, amplitude, color=colour, linewidth=width)
    handles.insert(0, Line2D([], [], color=colour, linewidth=width, label=MARKS["fold"].words))
    return handles + ax.get_legend_handles_labels()[0] + _special_handles(ax, curve)


def _draw_curve_band(
    ax: Axes, curve: FoldCurve | PeriodDoublingCurve | NeimarkSackerCurve, colour: str
) -> None:
    """Draw how far a curve may be off, where a fit was given."""
    if curve.band is not None:
        ends = (curve.band.lower, curve.band.upper)
        lower, upper = ((np.asarray(end["frequency"]), np.asarray(end["amplitude"])) for end in ends)
        draw_band(ax, lower, upper, colour)


def _special_handles(ax: Axes, curve: FoldCurve | PeriodDoublingCurve | NeimarkSackerCurve) -> list[Any]:
    """Mark the special points of a curve, and give their entries in the legend."""
    points = [(point, float(point.frequency), float(point.amplitude)) for point in curve.special_points]
    return [mark_handle(kind) for kind in draw_special_points(ax, points, ("frequency", "amplitude"))]


def plot_bifurcation_curve(
    curve: PeriodDoublingCurve | NeimarkSackerCurve, *, excitation: str = "force", ax: Axes | None = None
) -> Figure:
    """Draw where orbits double their period, or where quasi-periodic motion begins, over the drive.

    Args:
        curve: the bifurcations.
        excitation: "force" or "base_acceleration", as of the isolator: the unit of the drive.
        ax: axes to draw on.

    Returns:
        The figure.
    """
    figure, ax = axes_for(ax, 6.4, 4.2)
    torus = isinstance(curve, NeimarkSackerCurve)
    mark = MARKS["neimark_sacker" if torus else "period_doubling"]
    frequency, amplitude = np.asarray(curve.frequency), np.asarray(curve.amplitude)
    _draw_curve_band(ax, curve, mark.colour)
    ax.plot(frequency, amplitude, color=mark.colour, linewidth=1.4)
    handles: list[Any] = [Line2D([], [], color=mark.colour, linewidth=1.4, label=mark.words)]
    handles += ax.get_legend_handles_labels()[0] + _special_handles(ax, curve)
    ax.margins(0.08)
    ax.set_xlabel("frequency [Hz]")
    ax.set_ylabel(drive_words(excitation))
    state = "closed" if bool(curve.closed) else "open"
    if torus:
        turns = np.asarray(curve.rotation_number)
        words = f"Neimark-Sacker: quasi-periodic motion begins ({state})\nrotation number"
        words += f" {np.nanmin(turns):.3f} to {np.nanmax(turns):.3f}"
    else:
        words = f"Period doublings ({state})"
    entitle(ax, words, handles)
    return figure
