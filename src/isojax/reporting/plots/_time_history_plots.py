"""Pictures of time histories: measured, model before, model after."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..._languages import as_mathtext
from ...identification import OUTPUT_UNITS, Fit
from ...records import Record
from ._over_time import draw_signal, finish_time_axes, shown_samples
from ._style import MEASURED, ROLES, axes_for, entitle, fits_meant, pair

_CYCLES = 6.0
"""Cycles of the drive in a zoomed window."""


def worst_window(fit: Fit) -> tuple[int, float, float]:
    """Find where a model's free run is worst: held-out records first, where there are any.

    Args:
        fit: the fit.

    Returns:
        Place of the record in the campaign, start and end of a window of some cycles [s].
    """
    roles = {run.record.role for run in fit.free_runs}
    role = "holdout" if "holdout" in roles else "fit"
    best = (-1.0, 0, 0, 1)
    for place, run in enumerate(fit.free_runs):
        if run.record.role != role:
            continue
        length = _window_length(run.record)
        total = np.concatenate([[0.0], np.cumsum(np.nan_to_num(run.residual) ** 2)])
        power = total[length:] - total[:-length]
        start = int(np.argmax(power))
        best = max(best, (float(power[start]), place, start, length))
    _, place, start, length = best
    record = fit.free_runs[place].record
    return place, float(record.time[start]), float(record.time[min(start + length, record.time.size - 1)])


def _window_length(record: Record) -> int:
    """Give the samples of some cycles of the drive (of the output, where nothing drives)."""
    if record.dwells:
        frequency = float(np.mean([dwell.frequency for dwell in record.dwells]))
    else:
        signal = record.input if np.std(record.input) > 0.0 else record.output
        power = np.abs(np.fft.rfft(signal - np.mean(signal))) ** 2
        lines = np.fft.rfftfreq(signal.size, 1.0 / record.rate)
        frequency = max(float(np.sum(lines * power) / np.sum(power)), float(lines[1]))
    return int(np.clip(_CYCLES * record.rate / frequency, 8, record.time.size - 1))


@fits_meant
def plot_time_history(
    before: Fit,
    after: Fit | None = None,
    *,
    record: int | None = None,
    window: tuple[float, float] | None = None,
    ax: Axes | None = None,
) -> Figure:
    """Draw a record against free runs of the models, nothing fed back.

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
    chosen = before.free_runs[place].record
    low, high, shown = shown_samples(chosen, window)
    figure, ax = axes_for(ax)
    draw_signal(ax, chosen.time[shown], chosen.output[shown], colour=MEASURED, label="measured", style=".")
    for label, fit, colour in pair(before, after):
        simulated = fit.free_runs[place].simulated[shown]
        style = "--" if label == "before" else "-"
        draw_signal(ax, chosen.time[shown], simulated, colour=colour, label=label, style=style)
    quantity = before.campaign.output.quantity
    finish_time_axes(ax, low, high, quantity, OUTPUT_UNITS[quantity])
    entitle(ax, f"{as_mathtext(chosen.name)} ({ROLES[chosen.role]}), free run")
    return figure
