"""Pictures of time histories: measured, model before, model after."""

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..identification import Fit
from ..records import Record
from ._quantities import OUTPUT_UNITS, typeset_unit
from ._style import MEASURED, ROLES, axes_for, entitle, pair

_CYCLES = 6.0
"""Cycles of the drive in a zoomed window."""

_DENSE = 6000
"""Samples above which a curve is drawn by its extremes."""


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


def extremes(
    time: Float[np.ndarray, " time"], signal: Float[np.ndarray, " time"], pieces: int = 1500
) -> tuple[Float[np.ndarray, " piece"], Float[np.ndarray, " piece"], Float[np.ndarray, " piece"]]:
    """Give a long signal by its smallest and largest value in each piece.

    Args:
        time: [s].
        signal: the signal.
        pieces: how many.

    Returns:
        Start of each piece [s], smallest and largest values.
    """
    edges = np.linspace(0, signal.size, min(pieces, signal.size) + 1).astype(int)[:-1]
    return time[edges], np.minimum.reduceat(signal, edges), np.maximum.reduceat(signal, edges)


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
    figure, ax = axes_for(ax)
    place = worst_window(before)[0] if record is None else record
    chosen = before.free_runs[place].record
    low, high = (chosen.time[0], chosen.time[-1]) if window is None else window
    shown = (chosen.time >= low) & (chosen.time <= high)
    curves = [("measured", chosen.output, MEASURED)]
    curves += [(label, fit.free_runs[place].simulated, colour) for label, fit, colour in pair(before, after)]
    for label, signal, colour in curves:
        time, values = chosen.time[shown], signal[shown]
        if values.size > _DENSE:
            start, lowest, highest = extremes(time, values)
            ax.fill_between(start, lowest, highest, color=colour, alpha=0.55, linewidth=0.3, label=label)
        elif label == "measured":
            ax.plot(time, values, ".", color=colour, markersize=3.0, label=label)
        else:
            ax.plot(
                time, values, "--" if label == "before" else "-", color=colour, linewidth=1.1, label=label
            )
    quantity = before.campaign.output.quantity
    ax.set_xlabel("time [s]")
    ax.set_ylabel(f"{quantity} [{typeset_unit(OUTPUT_UNITS[quantity])}]")
    ax.set_xlim(low, high)
    ax.margins(y=0.18)
    ax.legend(fontsize=8, loc="upper right", ncols=3)
    entitle(ax, f"{chosen.name} ({ROLES[chosen.role]})")
    return figure
