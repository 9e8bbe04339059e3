"""Curves of a stability map: the response over frequency at some of its drive amplitudes."""

import numpy as np
from jaxtyping import Int
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..._given_numbers import given_count
from ...models import HALF_WIDTH, EndsEstimated, Estimated
from ...stability import StabilityMap, frequency_response
from ._branch_plots import draw_branch_band, threads
from ._draw_band import draw_band
from ._stability_style import MILLIMETRES, draw_curve, drive_unit, level_colours, quantity, stability_handles
from ._style import axes_for, entitle

_CURVES = 5


def plot_response_curves(
    smap: StabilityMap,
    *,
    curves: int = _CURVES,
    fit: Estimated | EndsEstimated | None = None,
    ax: Axes | None = None,
) -> Figure:
    """Draw the response over frequency, solid where stable and dashed where unstable.

    The drive amplitudes are rows of the map at equal steps, the largest among them; where orbits coexist,
    the nearest one gives way to the row with the most cells of several orbits.

    Args:
        smap: the map.
        curves: how many rows, if the map has as many.
        fit: with whose errors each curve is given its band, which takes some seconds: the response is
            followed for it from the lowest frequency on. The model of the map is its model. If omitted, a map
            that was made with a fit has a band where all that the errors allow have the same orbits.
        ax: axes to draw on.

    Returns:
        The figure.

    Raises:
        ValueError: if `curves` is no positive count, or `fit` failed, leaves a coefficient undetermined or is
            of another model.
    """
    curves = given_count("curves", curves)
    figure, ax = axes_for(ax, 7.2, 4.2)
    frequency, amplitudes = np.asarray(smap.frequencies), np.asarray(smap.amplitudes)
    shape = (-1, amplitudes.size, frequency.size)
    response = MILLIMETRES * np.asarray(smap.response).reshape(shape)
    stable = np.asarray(smap.stable).reshape(shape)
    half = np.full_like(response, np.nan)
    if fit is None and smap.standard_errors is not None:
        half = HALF_WIDTH * MILLIMETRES * np.asarray(smap.standard_errors["response"]).reshape(shape)
    unit, unstable = drive_unit(smap.model.excitation), False
    rows = _rows(np.asarray(smap.count), curves)
    colours = level_colours(len(rows))
    for row, colour in zip(rows, colours, strict=True):
        label = quantity(amplitudes[row], unit)
        for thread in threads(response[:, row], stable[:, row]):
            x, y, off = frequency[thread[1]], response[:, row][thread], half[:, row][thread]
            held = stable[:, row][thread]
            draw_curve(ax, x, y, held, colour, label)
            draw_band(ax, (x, y - off), (x, y + off), colour)
            unstable |= bool(np.any(np.isfinite(y) & ~held))
            label = ""
    if fit is not None:
        ends = frequency[0], frequency[-1]
        followed = frequency_response(smap.model, amplitudes[rows], ends, periods=(), fit=fit)
        for place, colour in enumerate(colours):
            draw_branch_band(ax, followed.branch, place, colour)
    ax.set_ylim(bottom=0.0)
    ax.set_xlabel("frequency [Hz]")
    ax.set_ylabel("response, half peak to peak [mm]")
    handles = stability_handles(ax, unstable=unstable)
    entitle(ax, "Response over frequency, by drive amplitude", handles)
    return figure


def _rows(count: Int[np.ndarray, "amplitude frequency"], curves: int) -> list[int]:
    """Give the rows that are drawn, lowest first."""
    steps = min(curves, count.shape[0])
    rows = np.unique(np.linspace(0, count.shape[0] - 1, steps + 1).round().astype(int)[1:])
    several = np.sum(count > 1, axis=1)
    if several.any():
        rows[np.argmin(np.abs(rows - np.argmax(several)))] = np.argmax(several)
    return rows.tolist()
