"""Response and transmissibility of an identified isolator over frequency, with their bands and folds."""

from collections.abc import Sequence
from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FormatStrFormatter, LogLocator, NullFormatter

from ...identification import MeasuredResponse
from ...models import Isolator
from ...stability import ResponseBands
from ._draw_band import draw_band
from ._stability_style import (
    MILLIMETRES,
    draw_curve,
    draw_special_points,
    drive_unit,
    level_colours,
    quantity,
    stability_handles,
)
from ._style import MEASURED, axes_for, entitle

_WIDE = 3.0
"""Ratio of the frequencies from which their axis is logarithmic."""

_GREY = "#555555"


def plot_response_bands(
    bands: ResponseBands,
    *,
    what: Literal["displacement", "transmissibility"] = "displacement",
    measured: Sequence[MeasuredResponse] = (),
    ax: Axes | None = None,
) -> Figure:
    """Draw the response at each drive amplitude, solid where stable, with its band and its folds.

    Args:
        bands: the curves.
        what: the displacement, or what passes through the isolator.
        measured: dwells of records, drawn as points in the colour of the nearest drive amplitude; of the
            displacement only.
        ax: axes to draw on.

    Returns:
        The figure.

    Raises:
        ValueError: if `what` is neither.
    """
    if what not in ("displacement", "transmissibility"):
        raise ValueError(f'Argument `what` must be "displacement" or "transmissibility", but is {what!r}.')
    figure, ax = axes_for(ax, 6.4, 3.8)
    scale = MILLIMETRES if what == "displacement" else 1.0
    colours = dict(zip(bands.amplitudes, level_colours(len(bands.amplitudes)), strict=True))
    unit, named, unstable, folds = drive_unit(bands.model.excitation), set(), False, []
    for curve in bands.curves:
        colour, height = colours[curve.amplitude], scale * getattr(curve, what)
        label = "" if curve.amplitude in named else quantity(curve.amplitude, unit)
        named.add(curve.amplitude)
        draw_curve(ax, curve.frequency, height, curve.stable, colour, label)
        band = getattr(curve, f"{what}_band")
        lower, upper = (
            (np.asarray(end["frequency"]), scale * np.asarray(end[what])) for end in (band.lower, band.upper)
        )
        draw_band(ax, lower, upper, colour)
        unstable |= not curve.stable.all()
        for fold in curve.folds:
            place = scale * getattr(fold, what)
            ax.plot(
                fold.interval, (place, place), color=_GREY, marker="|", markersize=5, linewidth=1.0, zorder=4
            )
            folds.append(("fold", fold.frequency, place))
    dwells = what == "displacement" and len(measured) > 0
    extra = [_points(ax, bands, measured, colours)] if dwells else []
    kinds = draw_special_points(ax, folds)
    _axes(ax, bands, what)
    entitle(ax, "", stability_handles(ax, kinds, unstable=unstable, extra=extra))
    return figure


def median_drive(measured: MeasuredResponse, model: Isolator) -> float:
    """Give the drive amplitude that the dwells of a record hold, in the middle of them.

    Args:
        measured: the dwells.
        model: of the campaign.

    Returns:
        [N, or m/s^2 for base excitation].
    """
    force = float(np.median(np.abs(measured.force[:, 0])))
    return force if model.excitation == "force" else force / float(model.mass)


def _points(
    ax: Axes, bands: ResponseBands, measured: Sequence[MeasuredResponse], colours: dict[float, str]
) -> Line2D:
    """Draw the dwells; give their entry of the legend."""
    style = {"marker": "o", "linestyle": "none", "markersize": 3, "markerfacecolor": "none"}
    for one in measured:
        drive = median_drive(one, bands.model)
        nearest = min(colours, key=lambda amplitude, own=drive: abs(np.log(amplitude / own)))
        size = MILLIMETRES * np.abs(one.displacement[:, 0])
        ax.plot(one.frequency, size, markeredgecolor=colours[nearest], markeredgewidth=0.8, **style)
    return Line2D([], [], label="measured dwell", markeredgecolor=_GREY, **style)


def _axes(ax: Axes, bands: ResponseBands, what: str) -> None:
    """Label the axes, and make them logarithmic where their values span much."""
    ax.set_xlabel("frequency [Hz]")
    low, high = bands.frequencies
    ax.set_xlim(low, high)
    if high > _WIDE * low:
        ax.set_xscale("log")
        _plain_numbers(ax.xaxis)
    if what == "displacement":
        ax.set_ylim(bottom=0.0)
        ax.set_ylabel("displacement amplitude [mm]")
        return
    ax.axhline(1.0, color=MEASURED, linewidth=0.8, linestyle=":")
    ax.set_yscale("log")
    _plain_numbers(ax.yaxis)
    passes = "force to the ground" if bands.model.excitation == "force" else "absolute motion"
    ax.set_ylabel(f"transmissibility, {passes} [1]")


def _plain_numbers(axis: object) -> None:
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))  # pyright: ignore[reportAttributeAccessIssue]
    axis.set_major_formatter(FormatStrFormatter("%g"))  # pyright: ignore[reportAttributeAccessIssue]
    axis.set_minor_formatter(NullFormatter())  # pyright: ignore[reportAttributeAccessIssue]
