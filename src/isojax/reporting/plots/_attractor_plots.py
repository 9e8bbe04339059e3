"""Where motions go: bifurcation diagram, phase portrait, basins of attraction, the return to an orbit."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from ...stability import BasinsOfAttraction, BifurcationDiagram, PhasePortrait, PoincareSection, ReturnToOrbit
from ._stability_style import MILLIMETRES, drive_unit, drive_words, quantity
from ._style import AFTER, BEFORE, LEVELS, NEUTRAL, axes_for, entitle

_RUNS = {"up": AFTER, "down": BEFORE, "anew": "#222222"}
_BASINS = ("#a9cbe8", "#f4c79b", "#b7dcc4", "#d9bfe0", "#eed98a", "#c9c9c9")
_AWAY = "#ffffff"


def plot_bifurcation_diagram(diagram: BifurcationDiagram, *, ax: Axes | None = None) -> Figure:
    """Draw the displacement once a drive period along the drive's amplitude or frequency.

    Args:
        diagram: of one run or several.
        ax: axes to draw on.

    Returns:
        The figure.
    """
    figure, ax = axes_for(ax, 7.0, 4.0)
    along = diagram.amplitudes if diagram.parameter == "amplitude" else diagram.frequencies
    samples = np.asarray(diagram.displacement)
    samples = samples.reshape(-1, *samples.shape[-2:]) * MILLIMETRES
    shown: dict[str, Line2D] = {}
    for run, points in zip(diagram.runs, samples, strict=True):
        x = np.broadcast_to(np.asarray(along)[:, None], points.shape)
        dots = {"linestyle": "none", "marker": "o", "markersize": _size(run, diagram), "markeredgewidth": 0.0}
        ax.plot(x.ravel(), points.ravel(), color=_RUNS[run], rasterized=True, **dots)
        words = "set anew at each point" if run == "anew" else f"turned {run}"
        shown[run] = Line2D([], [], linestyle="none", marker="o", markersize=4, color=_RUNS[run], label=words)
    ax.set_xlabel(
        drive_words(diagram.model.excitation) if diagram.parameter == "amplitude" else "frequency [Hz]"
    )
    ax.set_ylabel("displacement once a drive period [mm]")
    fixed = (
        quantity(float(diagram.frequencies[0]), "Hz")
        if diagram.parameter == "amplitude"
        else quantity(float(diagram.amplitudes[0]), drive_unit(diagram.model.excitation))
    )
    entitle(ax, f"Settled motion at {fixed}{_periods(diagram)}", list(shown.values()))
    return figure


def _size(run: str, diagram: BifurcationDiagram) -> float:
    """Give the size of a dot; larger for the run below, so that it shows where another coincides with it."""
    size = float(np.clip(200.0 / diagram.amplitudes.size, 1.0, 3.0))
    return 2.0 * size if run == "up" and "down" in diagram.runs else size


def _periods(diagram: BifurcationDiagram) -> str:
    """Give the periods that were met, and where nothing repeats or stays."""
    period, chaotic = np.asarray(diagram.period), np.asarray(diagram.chaotic)
    finite = np.isfinite(np.asarray(diagram.displacement)).all(axis=-1)
    met = sorted({int(value) for value in period[finite & (period > 0)]})
    parts = [f"period {', '.join(str(value) for value in met)}"] if met else []
    for mask, words in (
        (finite & chaotic, "chaotic"),
        (finite & (period == 0) & ~chaotic, "repeating nowhere"),
        (~finite, "run away"),
    ):
        if mask.any():
            parts.append(f"{np.sum(mask)} of {mask.size} {words}")
    return "\n" + "; ".join(parts) if parts else ""


def plot_phase_portrait(
    portrait: PhasePortrait, *, section: PoincareSection | None = None, ax: Axes | None = None
) -> Figure:
    """Draw a motion in the plane of displacement and velocity.

    Args:
        portrait: the motion.
        section: its points at fixed phases of the drive, drawn over it.
        ax: axes to draw on.

    Returns:
        The figure.
    """
    figure, ax = axes_for(ax, 4.6, 4.2)
    x, v = (MILLIMETRES * np.asarray(values) for values in (portrait.displacement, portrait.velocity))
    ax.plot(x, v, color=AFTER, linewidth=1.1)
    if section is not None:
        for place, phase in enumerate(np.asarray(section.phases)):
            ax.plot(
                MILLIMETRES * np.asarray(section.displacement)[place],
                MILLIMETRES * np.asarray(section.velocity)[place],
                linestyle="none",
                marker="o",
                markersize=4,
                color=LEVELS[(place + 2) % len(LEVELS)],
                label=f"at {np.degrees(phase):.0f}° of the drive",
                zorder=3,
            )
    ax.set_xlabel("displacement [mm]")
    ax.set_ylabel("velocity [mm/s]")
    bounded = np.isfinite(x).all()
    entitle(ax, "Settled motion" if bounded else "The motion left every bound")
    return figure


def plot_basins(basins: BasinsOfAttraction, *, ax: Axes | None = None) -> Figure:
    """Draw which attractor each initial state leads to.

    Args:
        basins: the basins.
        ax: axes to draw on.

    Returns:
        The figure.
    """
    figure, ax = axes_for(ax, 6.4, 4.4)
    index, periods = np.asarray(basins.index), np.asarray(basins.periods)
    colours = [_BASINS[place % len(_BASINS)] for place in range(periods.size)]
    shown = ListedColormap([_AWAY, *colours])
    norm = BoundaryNorm(np.arange(-1.5, periods.size + 0.5), shown.N)
    x, v = (MILLIMETRES * np.asarray(axis) for axis in (basins.displacements, basins.velocities))
    ax.grid(False)
    ax.imshow(
        index.T,
        origin="lower",
        aspect="auto",
        interpolation="nearest",
        cmap=shown,
        norm=norm,
        extent=(*_ends(x), *_ends(v)),
    )
    handles: list[Any] = []
    shares = np.asarray(basins.shares)
    for place, (period, share, colour) in enumerate(zip(periods, shares, colours, strict=True)):
        words = f"period {period}" if period else "repeats nowhere"
        points = MILLIMETRES * np.asarray(basins.attractors)[place, :, :2]
        ax.plot(
            *points.T, linestyle="none", marker="o", markersize=5, color=colour, markeredgecolor="#111111"
        )
        size = np.nanmax(np.abs(points[:, 0])) if np.isfinite(points[:, 0]).any() else np.nan
        label = f"{words}, {100 * share:.1f} % (|x| to {quantity(size, 'mm')} at phase 0)"
        handles.append(Patch(facecolor=colour, edgecolor="#888888", label=label))
    away = float(np.mean(index < 0))
    if away:
        handles.append(Patch(facecolor=_AWAY, edgecolor="#888888", label=f"runs away, {100 * away:.1f} %"))
    if periods.size:
        dot = {"linestyle": "none", "marker": "o", "markersize": 5, "markeredgecolor": "#111111"}
        handles.append(Line2D([], [], color=_AWAY, label="the attractors, once a period", **dot))
    ax.set_xlim(*_ends(x))
    ax.set_ylim(*_ends(v))
    ax.set_xlabel("displacement at t = 0 [mm]")
    ax.set_ylabel("velocity at t = 0 [mm/s]")
    entitle(ax, "Basins of attraction", handles)
    return figure


def _ends(axis: np.ndarray) -> tuple[float, float]:
    """Give the outer edges of equal cells around their centres."""
    half = 0.5 * float(axis[-1] - axis[0]) / max(axis.size - 1, 1) or 0.5
    return float(axis[0]) - half, float(axis[-1]) + half


def plot_return(back: ReturnToOrbit, *, ax: Axes | None = None) -> Figure:
    """Draw the distance of a disturbed motion to its orbit, and what the multipliers promise.

    Args:
        back: the way back.
        ax: axes to draw on.

    Returns:
        The figure.
    """
    figure, ax = axes_for(ax, 6.0, 3.6)
    distance = np.asarray(back.distance)
    periods = np.arange(distance.size)
    ax.plot(
        periods,
        distance,
        color=AFTER,
        linewidth=1.0,
        marker="o",
        markersize=3.5,
        label="distance to the orbit",
    )
    radius = float(back.spectral_radius)
    if np.isfinite(radius) and np.isfinite(distance[0]) and distance[0] > 0.0:
        slope = distance[0] * radius**periods
        seen = slope >= np.nanmin(distance[distance > 0.0])
        label = f"|µ| = {radius:.3f} a period"
        ax.plot(periods[seen], slope[seen], color=NEUTRAL, linestyle="--", linewidth=1.4, label=label)
    ax.set_yscale("log")
    ax.set_xlabel("periods of the orbit")
    ax.set_ylabel("distance, over the orbit's size [1]")
    ending = "returned" if bool(back.returned) else "did not return"
    rate = float(back.rate)
    measured = f"; measured rate {rate:.3f} a period" if np.isfinite(rate) else ""
    entitle(ax, f"Disturbed motion: {ending}{measured}")
    return figure
