"""Picture of data files that nobody has described yet."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..._languages import as_mathtext
from ...records import ChannelInspection, FileInspection, power_spectrum
from ._over_time import extremes
from ._style import AFTER, BAND, MEASURED, axes_for, entitle

_MOST_FILES = 12
"""Files beyond which a picture is too long to read."""

_PIECES = 400
"""Pieces of a long signal; with more the band between its extremes shows the beat of sine and pieces."""


def plot_inspection(files: Sequence[FileInspection]) -> Figure:
    """Draw drive and response of each file over time, and their spectra; every second dwell is shaded.

    Args:
        files: the inspected files; the first twelve are drawn.

    Returns:
        The figure, one row a file.

    Raises:
        ValueError: if there is no file.
    """
    files = list(files)[:_MOST_FILES]
    if not files:
        raise ValueError("Argument `files` must hold at least one inspected file, but is empty.")
    figure = Figure(figsize=(13.0, 2.6 * len(files) + 0.4), layout="constrained")
    grid = figure.subplots(len(files), 3, squeeze=False, width_ratios=(1.2, 1.2, 1.0))
    for file, axes in zip(files, grid, strict=True):
        drive = file.channel(file.drive) or file.channels[0]
        response = file.channel(file.response)
        _draw_channel(axes[0], file, drive, MEASURED)
        entitle(
            axes[0],
            f"{as_mathtext(file.file.name)}: {(file.kind or 'excitation not seen').replace('_', ' ')}",
        )
        for dwell in file.dwells[1::2]:
            rate = file.rate or 1.0
            axes[0].axvspan(dwell.start / rate, dwell.stop / rate, color=BAND, zorder=0)
        if response is None:
            axes[1].set_axis_off()
        else:
            _draw_channel(axes[1], file, response, AFTER)
        _draw_spectra(axes[2], file, [(drive, MEASURED), *([(response, AFTER)] if response else [])])
    return figure


def _draw_channel(ax: Axes, file: FileInspection, channel: ChannelInspection, colour: str) -> None:
    axes_for(ax)
    time = np.arange(channel.samples.size) / (file.rate or 1.0)
    if channel.samples.size > 2 * _PIECES:
        ax.fill_between(*extremes(time, channel.samples, _PIECES), color=colour, linewidth=0.3)
    else:
        ax.plot(time, channel.samples, color=colour, linewidth=0.8)
    ax.margins(y=0.15)
    if channel.clipped > 0.0:
        for end in (channel.low, channel.high):
            ax.axhline(end, color="#d1495b", linewidth=0.8, linestyle="--")
    ax.set_xlim(0.0, float(time[-1]))
    ax.set_xlabel("time [s]" if file.rate is not None else "sample")
    ax.set_ylabel(_label(channel))


def _draw_spectra(ax: Axes, file: FileInspection, channels: Sequence[tuple[ChannelInspection, str]]) -> None:
    """Draw each spectrum over its own largest value, since the units differ."""
    axes_for(ax)
    for channel, colour in channels:
        finite = np.where(np.isfinite(channel.samples), channel.samples, channel.mean)
        if channel.rms > 0.0 and finite.size >= 64:
            frequency, density = power_spectrum(finite, file.rate or 1.0)
            level = 10.0 * np.log10(np.maximum(density / np.max(density), 1e-16))
            ax.plot(frequency[1:], level[1:], color=colour, linewidth=0.9, label=as_mathtext(channel.name))
    ax.set_xscale("log")
    ax.set_xlabel("frequency [Hz]" if file.rate is not None else "cycles per sample")
    ax.set_ylabel("power density [dB]")
    entitle(ax, "spectra")


def _label(channel: ChannelInspection) -> str:
    unit = channel.unit
    written = unit is None or f"[{unit}]" in channel.name or f"({unit})" in channel.name
    return as_mathtext(channel.name if written else f"{channel.name} [{unit}]")
