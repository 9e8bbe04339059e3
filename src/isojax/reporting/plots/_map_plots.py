"""Pictures of a stability map: the largest multiplier and the response over the plane of the drive."""

import numpy as np
from jaxtyping import Bool, Float
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, QuadMesh
from matplotlib.colors import Colormap, LinearSegmentedColormap, Normalize, TwoSlopeNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from ...stability import FoldCurve, StabilityMap
from ._bifurcation_curve_plots import draw_lens
from ._stability_style import MILLIMETRES, drive_words
from ._style import axes_for, entitle

_STABLE = ("#08306b", "#2f7fbc", "#9ccbe3", "#e8f3fa")
_UNSTABLE = ("#fdae3d", "#e8552d", "#8e0f1f")
_EMPTY = "#d4d4d4"
_OUTLINE = "#111111"
_COLOURS = 256
_LEAST_SPAN = 1e-3
"""Least range of the colours beyond one."""

_CHANCES = (0.05, 0.95)
"""Chances of a stable cell along which lines are drawn."""

_LEAST = 1e-9
"""Least range of the colours of a response [mm]."""


def plot_stability_map(
    smap: StabilityMap, *, orbit: int | None = None, folds: FoldCurve | None = None, ax: Axes | None = None
) -> Figure:
    """Draw the largest modulus of the multipliers over frequency and drive amplitude.

    Blue is stable, orange to red unstable, and the colours break at one, where the contour lies. Cells with
    several orbits are outlined, unless the folds are given; grey cells hold none. Where the map was given a
    fit, dotted lines pass through the cells that hold no unstable orbit with 5 and with 95 %.

    Args:
        smap: the map.
        orbit: which of coexisting orbits, by rising displacement; the least stable of each cell if omitted.
        folds: curve of folds to draw over it.
        ax: axes to draw on.

    Returns:
        The figure.

    Raises:
        ValueError: if there is no such orbit.
    """
    radius = _layer(smap, np.asarray(smap.spectral_radius), orbit, np.fmax)
    figure, ax = axes_for(ax, 7.2, 4.4)
    colours, norm = _about_one(radius)
    mesh = _draw_cells(smap, radius, colours, norm, ax)
    bar = figure.colorbar(mesh, ax=ax, pad=0.02)
    bar.set_label("largest |µ|  (unstable above 1)", fontsize=9)
    bar.set_ticks(_ticks(norm))
    bar.ax.tick_params(labelsize=8)
    bar.ax.axhline(1.0, color=_OUTLINE, linewidth=1.6)
    handles: list[Line2D | Patch] = []
    if _crosses(radius, 1.0):
        ax.contour(*_centres(smap), radius, levels=[1.0], colors=_OUTLINE, linewidths=0.8)
        handles.append(Line2D([], [], color=_OUTLINE, linewidth=0.8, label="|µ| = 1"))
    handles += _draw_chance(smap, ax)
    title = f"Largest multiplier over one drive period{_which(smap, orbit, 'least stable')}{_caption(smap)}"
    _finish(smap, radius, title, handles, folds, ax)
    return figure


def _draw_chance(smap: StabilityMap, ax: Axes) -> list[Line2D]:
    """Draw between which lines the boundary of the unstable cells lies, given the errors of the fit."""
    if smap.probability_stable is None or min(smap.probability_stable.shape) < 2:
        return []
    chance = np.asarray(smap.probability_stable)
    levels = [level for level in _CHANCES if _crosses(chance, level)]
    if not levels:
        return []
    style = {"linestyles": "dotted", "linewidths": 1.0}
    ax.contour(*_centres(smap), chance, levels=levels, colors=_OUTLINE, **style)
    words = " and ".join(f"{level:.0%}" for level in levels)
    return [Line2D([], [], color=_OUTLINE, linewidth=1.0, linestyle=":", label=f"stable with {words}")]


def plot_response_map(
    smap: StabilityMap, *, orbit: int | None = None, folds: FoldCurve | None = None, ax: Axes | None = None
) -> Figure:
    """Draw the response, half the peak-to-peak displacement, over frequency and drive amplitude.

    Args:
        smap: the map.
        orbit: which of coexisting orbits, by rising displacement; the largest of each cell if omitted.
        folds: curve of folds to draw over it.
        ax: axes to draw on.

    Returns:
        The figure.

    Raises:
        ValueError: if there is no such orbit.
    """
    response = MILLIMETRES * _layer(smap, np.asarray(smap.response), orbit, np.fmax)
    figure, ax = axes_for(ax, 7.2, 4.4)
    norm = Normalize(0.0, max(float(np.fmax.reduce(response, axis=None, initial=0.0)), _LEAST))
    mesh = _draw_cells(smap, response, _colormap(("#fbfbe8", "#7cc5a6", "#26798e", "#16243f")), norm, ax)
    bar = figure.colorbar(mesh, ax=ax, pad=0.02)
    bar.set_label("response, half peak to peak [mm]", fontsize=9)
    bar.ax.tick_params(labelsize=8)
    title = f"Displacement of the periodic response{_which(smap, orbit, 'largest')}{_caption(smap)}"
    _finish(smap, response, title, [], folds, ax)
    return figure


def _layer(
    smap: StabilityMap,
    values: Float[np.ndarray, "*orbit amplitude frequency"],
    orbit: int | None,
    pick: np.ufunc,
) -> Float[np.ndarray, "amplitude frequency"]:
    if values.ndim == 2:
        if orbit not in (None, 0):
            raise ValueError(f"Argument `orbit` must be 0 for a map of one orbit a cell, but is {orbit}.")
        return values
    if orbit is None:
        return pick.reduce(values, axis=0)
    if not 0 <= orbit < values.shape[0]:
        raise ValueError(f"Argument `orbit` must be from 0 to {values.shape[0] - 1}, but is {orbit}.")
    return values[orbit]


def _which(smap: StabilityMap, orbit: int | None, default: str) -> str:
    if smap.spectral_radius.ndim == 2:
        return ", orbit of smallest motion"
    return f", {default} orbit" if orbit is None else f", orbit {orbit} by displacement"


def _caption(smap: StabilityMap) -> str:
    count = np.asarray(smap.count)
    rows, columns = count.shape
    parts = [f"{rows} × {columns} cells"]
    if smap.spectral_radius.ndim == 3:
        parts.append(f"{np.sum(count > 1)} with several orbits")
    if np.any(count == 0):
        parts.append(f"{np.sum(count == 0)} without an orbit")
    unstable = np.asarray(smap.spectral_radius) >= 1.0
    over = np.any(unstable, axis=0) if unstable.ndim == 3 else unstable
    if over.any():
        parts.append(f"{np.sum(over)} with an unstable one")
    elif np.any(count > 0):
        parts.append("all that were sought are stable")
    return "\n" + ", ".join(parts)


def _colormap(colours: tuple[str, ...]) -> Colormap:
    return LinearSegmentedColormap.from_list("isojax", colours, _COLOURS)


def _about_one(radius: Float[np.ndarray, "amplitude frequency"]) -> tuple[Colormap, Normalize]:
    """Give colours that break at one, and the range that they span."""
    seen = radius[np.isfinite(radius)]
    low = min(float(seen.min(initial=1.0)), 1.0 - _LEAST_SPAN)
    high = float(seen.max(initial=0.0))
    if high < 1.0:
        return _colormap(_STABLE), Normalize(low, 1.0)
    below = LinearSegmentedColormap.from_list("below", _STABLE, _COLOURS)(np.linspace(0.0, 1.0, _COLOURS))
    above = LinearSegmentedColormap.from_list("above", _UNSTABLE, _COLOURS)(np.linspace(0.0, 1.0, _COLOURS))
    both = LinearSegmentedColormap.from_list("isojax", np.concatenate([below, above]), 2 * _COLOURS)
    return both, TwoSlopeNorm(1.0, low, max(high, 1.0 + _LEAST_SPAN))


def _ticks(norm: Normalize) -> list[float]:
    low, high = float(norm.vmin or 0.0), float(norm.vmax or 1.0)
    below = [tick for tick in MaxNLocator(5).tick_values(low, 1.0) if low <= tick < 1.0]
    above = [tick for tick in MaxNLocator(4).tick_values(1.0, high) if 1.0 < tick <= high]
    return [*below, 1.0, *above]


def _crosses(values: Float[np.ndarray, "amplitude frequency"], level: float) -> bool:
    seen = values[np.isfinite(values)]
    return min(values.shape) > 1 and bool(np.any(seen < level) and np.any(seen >= level))


def _centres(smap: StabilityMap) -> tuple[np.ndarray, np.ndarray]:
    return np.asarray(smap.frequencies), np.asarray(smap.amplitudes)


def _edges(centres: Float[np.ndarray, " axis"]) -> Float[np.ndarray, " edge"]:
    """Give the edges of cells around their centres."""
    if centres.size == 1:
        return centres * np.array([0.95, 1.05])
    middle = 0.5 * (centres[1:] + centres[:-1])
    return np.concatenate(
        [[1.5 * centres[0] - 0.5 * centres[1]], middle, [1.5 * centres[-1] - 0.5 * centres[-2]]]
    )


def _draw_cells(
    smap: StabilityMap,
    values: Float[np.ndarray, "amplitude frequency"],
    colours: Colormap,
    norm: Normalize,
    ax: Axes,
) -> QuadMesh:
    ax.grid(False)
    if not np.isfinite(values).all():
        ax.patch.set(facecolor=_EMPTY, hatch="xxx", edgecolor="#bcbcbc")
    edges = (_edges(axis) for axis in _centres(smap))
    shown = np.ma.masked_invalid(values)
    return ax.pcolormesh(*edges, shown, cmap=colours, norm=norm, shading="flat", rasterized=True)


def _outline(
    smap: StabilityMap, inside: Bool[np.ndarray, "amplitude frequency"]
) -> list[list[tuple[float, float]]]:
    """Give the edges between cells inside and outside."""
    x, y = (_edges(axis).tolist() for axis in _centres(smap))
    padded = np.pad(inside, 1)
    across = np.argwhere(padded[1:-1, 1:] != padded[1:-1, :-1])
    along = np.argwhere(padded[1:, 1:-1] != padded[:-1, 1:-1])
    upright = [[(x[j], y[i]), (x[j], y[i + 1])] for i, j in across]
    level = [[(x[j], y[i]), (x[j + 1], y[i])] for i, j in along]
    return upright + level


def _finish(
    smap: StabilityMap,
    values: Float[np.ndarray, "amplitude frequency"],
    title: str,
    handles: list[Line2D | Patch],
    folds: FoldCurve | None,
    ax: Axes,
) -> None:
    """Draw what every map shows: several orbits, folds, empty cells; axes and legend."""
    several = np.asarray(smap.count) > 1
    if several.any() and folds is None:
        ax.add_collection(LineCollection(_outline(smap, several), colors=_OUTLINE, linewidths=0.5))
        handles.append(Patch(facecolor="none", edgecolor=_OUTLINE, linewidth=0.5, label="several orbits"))
    if folds is not None:
        # The curve says exactly what the edges of the cells say roughly.
        handles += draw_lens(ax, folds, filled=False)
    missing = int(np.sum(~np.isfinite(values)))
    if missing:
        label = f"no orbit ({missing} cell{'s' * (missing > 1)})"
        handles.append(Patch(facecolor=_EMPTY, edgecolor="#bcbcbc", hatch="xxx", label=label))
    x, y = (_edges(axis) for axis in _centres(smap))
    ax.set_xlim(x[0], x[-1])
    ax.set_ylim(max(y[0], 0.0), y[-1])
    ax.set_xlabel("frequency [Hz]")
    ax.set_ylabel(drive_words(smap.model.excitation))
    entitle(ax, title, handles)
