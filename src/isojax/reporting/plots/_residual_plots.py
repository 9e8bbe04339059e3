"""Pictures of what a model leaves: residual, its autocorrelation, where on the records it is large."""

from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..._languages import as_mathtext
from ...identification import OUTPUT_UNITS, Fit, Residual, Run
from ..words import typeset_unit
from ._over_time import draw_signal, finish_time_axes, is_dense, shown_samples
from ._style import BAND, ROLES, axes_for, entitle, fits_meant, pair
from ._time_history_plots import worst_window

_SMOOTHED_POINTS = 60
"""A window is smoothed over this share of its length, where it is short enough for a curve."""

_PHASE_BINS = 36
"""Pieces of a cycle over which a residual is averaged."""


@fits_meant
def plot_residual(
    before: Fit,
    after: Fit | None = None,
    *,
    record: int | None = None,
    window: tuple[float, float] | None = None,
    ax: Axes | None = None,
) -> Figure:
    """Draw measured less model, every segment restarted, before and after on one scale.

    Args:
        before: the declared model, fitted.
        after: the extended model, fitted; omitted where there is none.
        record: place of the record in the campaign; the one where `before` is worst, if omitted.
        window: start and end [s]; the whole record if omitted.
        ax: axes to draw on.

    Returns:
        The figure.
    """
    place = worst_window(before)[0] if record is None else record
    chosen = before.restarts.runs[place].record
    low, high, shown = shown_samples(chosen, window)
    figure, ax = axes_for(ax)
    time = chosen.time[shown]
    for label, fit, colour in pair(before, after):
        values = fit.restarts.runs[place].residual[shown]
        if not is_dense(values):
            ax.plot(time, values, color=colour, linewidth=0.6, alpha=0.3)
            length = max(1, values.size // _SMOOTHED_POINTS)
            values = np.convolve(values, np.ones(length) / length, mode="same")
            label = f"{label}, smoothed"
        draw_signal(ax, time, values, colour=colour, label=label, width=1.6)
    sigma = before.noise.levels[place]
    ax.axhspan(-2 * sigma, 2 * sigma, color=BAND, zorder=0, label="noise, ±2σ")
    finish_time_axes(ax, low, high, "residual", OUTPUT_UNITS[before.campaign.output.quantity])
    entitle(ax, f"residual of {as_mathtext(chosen.name)} ({ROLES[chosen.role]}), segments restarted")
    return figure


def plot_correlation(
    before: Residual,
    after: Residual | None = None,
    *,
    what: Literal["residual", "drive"] = "residual",
    ax: Axes | None = None,
) -> Figure:
    """Draw the correlation of the residual with itself or with the drive, with the 99 % band of white noise.

    Args:
        before: residual of the declared model.
        after: residual of the extended model; omitted where there is none.
        what: what the residual is correlated with.
        ax: axes to draw on.

    Returns:
        The figure.
    """
    figure, ax = axes_for(ax)
    for label, residual, colour in pair(before, after):
        rows = residual.autocorrelation if what == "residual" else residual.cross_correlation
        shown = residual.lags > 0 if what == "residual" else np.full(residual.lags.size, True)
        inside = float(np.mean(np.abs(rows[:, shown]) <= residual.band[:, None]))
        for place, row in enumerate(rows):
            name = f"{label}: {100 * inside:.0f} % of lags inside" if place == 0 else None
            ax.plot(residual.lags[shown], row[shown], color=colour, linewidth=0.9, alpha=0.8, label=name)
    band = float(np.max(before.band))
    ax.axhspan(-band, band, color=BAND, zorder=0, label="white noise, 99 %")
    ax.set_xlabel("lag [samples]")
    ax.set_ylabel(("autocorrelation" if what == "residual" else "cross-correlation") + " [1]")
    entitle(ax, f"residual against {'itself' if what == 'residual' else 'the drive'}, by record")
    return figure


@fits_meant
def plot_where(before: Fit, after: Fit | None = None, *, ax: Axes | None = None) -> Figure:
    """Draw the residual of each segment over the noise: against drive frequency, or time without dwells.

    Args:
        before: the declared model, fitted.
        after: the extended model, fitted; omitted where there is none.
        ax: axes to draw on.

    Returns:
        The figure.
    """
    figure, ax = axes_for(ax)
    dwelling = all(run.record.dwells for run in before.restarts.runs)
    for label, fit, colour in pair(before, after):
        for role, marker in (("fit", "o"), ("holdout", "D")):
            own = zip(fit.restarts.runs, before.noise.levels, strict=True)
            runs = [(run, noise) for run, noise in own if run.record.role == role]
            points = [point for run, noise in runs for point in _sizes(run, dwelling, noise)]
            if points:
                x, size = np.array(points).T
                name = f"{label}, {ROLES[role]}"
                ax.plot(
                    x, size, marker, color=colour, markersize=3.5, markeredgewidth=0, alpha=0.65, label=name
                )
    ax.axhline(1.0, color="black", linewidth=0.8)
    ax.set_xlabel("drive frequency [Hz]" if dwelling else "time in the record [s]")
    ax.set_ylabel("rms residual / noise [1]")
    entitle(ax, "residual over the noise: one point a " + ("dwell" if dwelling else "window"))
    return figure


@fits_meant
def plot_cycle_residual(before: Fit, after: Fit | None = None, *, ax: Axes | None = None) -> Figure:
    """Draw the residual of the worst dwell, averaged over its cycles.

    Args:
        before: the declared model, fitted.
        after: the extended model, fitted; omitted where there is none.
        ax: axes to draw on.

    Returns:
        The figure.

    Raises:
        ValueError: if no record has dwells.
    """
    dwells = [
        (float(np.sum(run.residual[dwell.start : dwell.stop] ** 2)), place, dwell)
        for place, run in enumerate(before.restarts.runs)
        for dwell in run.record.dwells
    ]
    if not dwells:
        raise ValueError(
            f"Argument `before` must be a fit of records with dwells, but those of "
            f"{before.campaign.title!r} have none: there is no cycle to average over."
        )
    figure, ax = axes_for(ax)
    _, place, dwell = max(dwells, key=lambda entry: entry[0])
    record = before.restarts.runs[place].record
    phase = np.arange(dwell.stop - dwell.start) * dwell.frequency / record.rate % 1.0
    part = np.minimum((phase * _PHASE_BINS).astype(int), _PHASE_BINS - 1)
    count = np.maximum(np.bincount(part, minlength=_PHASE_BINS), 1)
    degrees = (np.arange(_PHASE_BINS) + 0.5) * 360.0 / _PHASE_BINS
    for label, fit, colour in pair(before, after):
        values = fit.restarts.runs[place].residual[dwell.start : dwell.stop]
        mean = np.bincount(part, values, minlength=_PHASE_BINS) / count
        ax.plot(degrees, mean, "o-", color=colour, markersize=3, linewidth=1.0, label=label)
    band = 2.0 * before.noise.levels[place] / np.sqrt(count)
    ax.fill_between(degrees, -band, band, color=BAND, zorder=0, label="noise of the mean, ±2σ")
    quantity = before.campaign.output.quantity
    ax.set_xlabel("phase in the cycle of the drive [°]")
    ax.set_ylabel(f"mean residual [{typeset_unit(OUTPUT_UNITS[quantity])}]")
    ax.set_xlim(0.0, 360.0)
    ax.set_xticks(np.arange(0, 361, 60))
    entitle(ax, f"cycle-averaged residual: {as_mathtext(record.name)} at {dwell.frequency:.3g} Hz")
    return figure


def _sizes(run: Run, dwelling: bool, noise: float) -> list[tuple[float, float]]:
    """Give frequency (or time in the middle) and rms residual over the noise of each dwell (or of forty
    windows).
    """
    if dwelling:
        pieces = [(dwell.start, dwell.stop, dwell.frequency) for dwell in run.record.dwells]
    else:
        edges = np.linspace(0, run.record.output.size, 41).astype(int)
        middle = run.record.time[(edges[:-1] + edges[1:]) // 2]
        pieces = list(zip(edges[:-1], edges[1:], middle, strict=True))
    residual = run.residual
    return [
        (float(place), float(np.sqrt(np.mean(residual[start:stop][kept] ** 2)) / noise))
        for start, stop, place in pieces
        if np.any(kept := run.counted[start:stop] > 0.0)
    ]
