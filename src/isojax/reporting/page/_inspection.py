"""What is in data files, for the terminal."""

from collections.abc import Sequence

import numpy as np
from rich.console import RenderableType

from ..._languages import as_rich, printable
from ...records import ChannelInspection, FileInspection
from ._summary import PlainGroup, add_row, new_table

_CLIPPED_SHARE = 1e-4
"""Share of clipped samples from which it is worth a word."""


def inspection_summary(files: Sequence[FileInspection]) -> RenderableType:
    """Give what is in data files: a line on the rate and the excitation of each, and a table of its channels.

    Args:
        files: the inspected files.

    Returns:
        For the terminal; `render_text` makes it plain text.
    """
    return PlainGroup(*(part for file in files for part in _of_file(file)))


def _of_file(file: FileInspection) -> tuple[RenderableType, ...]:
    table = new_table(
        str(file.file),
        "channel",
        "measures",
        "unit",
        "lowest",
        "highest",
        "mean",
        "rms",
        "noise",
        "drift",
        "flaws",
    )
    for one in file.channels:
        add_row(
            table,
            one.name,
            one.quantity or "?",
            one.unit or "?",
            *(f"{value:.4g}" for value in (one.low, one.high, one.mean, one.rms)),
            f"{one.noise:.2g}",
            f"{100.0 * one.drift:+.1f} %",
            _flaws(one) or "none",
        )
    lines = [f"  {_rate(file)}", f"  {_excitation(file)}"]
    if file.time_fault:
        lines.append(f"  {file.time_fault}")
    if file.left_out:
        lines.append(f"  shorter than the channels, so left out: {', '.join(file.left_out[:8])}")
    return table, as_rich("\n".join(map(printable, lines)) + "\n", keep="\n")


def _flaws(one: ChannelInspection) -> str:
    found = []
    if one.missing:
        found.append(f"{one.missing} missing")
    if one.rms == 0.0:
        found.append("constant")
    if one.clipped > _CLIPPED_SHARE:
        found.append(f"{100.0 * one.clipped:.2g} % clipped")
    if one.spikes:
        found.append(f"{one.spikes} spikes")
    return ", ".join(found)


def _rate(file: FileInspection) -> str:
    if file.rate is None:
        return f"{file.size} samples; the rate is not known: no time column, and none is stated (--rate HZ)"
    scatter = ""
    if file.time_jitter:
        share = 100.0 * file.time_jitter * file.rate
        scatter = f"; the times scatter by {1e3 * file.time_jitter:.2g} ms rms, {share:.2g} % of a step"
    rate = f"{file.size} samples at {file.rate:.7g} Hz ({file.rate_from}), {file.size / file.rate:.4g} s"
    return f"{rate}{scatter}"


def _excitation(file: FileInspection) -> str:
    if file.drive is None or file.response is None:
        return "one channel only: no drive, no response"
    between = f"`{file.drive}` drives, `{file.response}` responds"
    if file.kind is None:
        return f"{between}; samples are missing or too few to see how"
    words = file.kind.replace("_", " ")
    unit = "Hz" if file.rate is not None else "cycles per sample"
    if file.dwells:
        frequency = np.array([one.frequency for one in file.dwells])
        words += (
            f", {len(file.dwells)} dwells from {np.min(frequency):.4g} to {np.max(frequency):.4g} {unit}, "
            f"{min(one.cycles for one in file.dwells):.0f} cycles and more"
        )
    if file.period is not None:
        words += f", a period of {file.period} samples, {file.size / file.period:.3g} of them"
    if file.direction != "none":
        words += f", {file.direction}"
    return f"{between}: {words}"
