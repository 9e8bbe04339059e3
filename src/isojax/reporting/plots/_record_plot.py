"""Picture of one record as it was read."""

from typing import Literal

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..._languages import as_mathtext
from ...identification import OUTPUT_UNITS
from ...records import Campaign, Record
from ..words import INPUT_WORDS
from ._over_time import draw_signal, finish_time_axes, shown_samples
from ._style import BAND, MEASURED, NEUTRAL, ROLES, axes_for, entitle


def plot_record(
    record: Record,
    campaign: Campaign,
    *,
    what: Literal["input", "output"] = "output",
    window: tuple[float, float] | None = None,
    ax: Axes | None = None,
) -> Figure:
    """Draw a channel of a record, in SI, as the fit sees it; every second dwell is shaded.

    Args:
        record: the record.
        campaign: the campaign it belongs to, which knows what its channels are.
        what: "input", what drove the isolator, or "output", what was measured on it.
        window: start and end [s]; the whole record if omitted.
        ax: axes to draw on.

    Returns:
        The figure.

    Raises:
        ValueError: if no sample lies in the window.
    """
    low, high, shown = shown_samples(record, window)
    figure, ax = axes_for(ax)
    signal = record.input if what == "input" else record.output
    draw_signal(ax, record.time[shown], signal[shown], colour=MEASURED, label=None, width=0.8)
    for place, dwell in enumerate(record.dwells[1::2]):
        label = "every second dwell" if place == 0 else None
        ax.axvspan(dwell.start / record.rate, dwell.stop / record.rate, color=BAND, zorder=0, label=label)
    if record.settle:
        ax.axvspan(0.0, record.settle / record.rate, color=NEUTRAL, alpha=0.4, zorder=0, label="settle")
    quantity = campaign.output.quantity
    words, unit = (
        INPUT_WORDS[campaign.input.quantity] if what == "input" else (quantity, OUTPUT_UNITS[quantity])
    )
    finish_time_axes(ax, low, high, words, unit)
    entitle(ax, f"{as_mathtext(record.name)} ({ROLES[record.role]}, {record.kind.replace('_', ' ')})")
    return figure
