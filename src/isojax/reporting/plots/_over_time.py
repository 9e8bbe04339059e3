"""Signals over time: the interval that is shown, and curves that stay readable where they are long."""

import numpy as np
from jaxtyping import Bool, Float
from matplotlib.axes import Axes

from ...records import Record
from ..words import typeset_unit

_DENSE = 4000
"""Samples above which a curve is drawn by its extremes."""


def shown_samples(
    record: Record, window: tuple[float, float] | None
) -> tuple[float, float, Bool[np.ndarray, " time"]]:
    """Give the interval of a record that is drawn.

    Args:
        record: the record.
        window: start and end [s]; the whole record if None.

    Returns:
        Start and end [s], and which samples lie between.

    Raises:
        ValueError: if no sample lies in the window.
    """
    low, high = (float(record.time[0]), float(record.time[-1])) if window is None else window
    shown = (record.time >= low) & (record.time <= high)
    if not np.any(shown):
        raise ValueError(
            f"Argument `window` must hold samples of {record.name}, {record.time[0]:g} to "
            f"{record.time[-1]:g} s, but is {low:g} to {high:g} s."
        )
    return low, high, shown


def is_dense(signal: Float[np.ndarray, " time"]) -> bool:
    """Say whether a signal is too long for a curve."""
    return signal.size > _DENSE


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


def draw_signal(
    ax: Axes,
    time: Float[np.ndarray, " time"],
    signal: Float[np.ndarray, " time"],
    *,
    colour: str,
    label: str | None,
    style: str = "-",
    width: float = 1.1,
) -> None:
    """Draw a signal: a curve, or the band between its extremes where it is long.

    Args:
        ax: axes to draw on.
        time: [s].
        signal: the signal.
        colour: of the curve.
        label: for the legend, if any.
        style: of the curve, or of its points.
        width: of the curve.
    """
    if is_dense(signal):
        ax.fill_between(*extremes(time, signal), color=colour, alpha=0.6, linewidth=0.3, label=label)
    else:
        ax.plot(time, signal, style, color=colour, markersize=3.0, linewidth=width, label=label)


def finish_time_axes(ax: Axes, low: float, high: float, words: str, unit: str) -> None:
    """Write what the axes are.

    Args:
        ax: the axes.
        low: start [s].
        high: end [s].
        words: what is drawn.
        unit: its unit, such as "m/s^2".
    """
    ax.set_xlabel("time [s]")
    ax.set_ylabel(f"{words} [{typeset_unit(unit)}]")
    ax.set_xlim(low, high)
