"""A record as lines of its windows: drive, motion and the forces of general laws, which must balance."""

from dataclasses import dataclass, replace
from typing import no_type_check

import numpy as np
from jaxtyping import Complex, Float

from .._campaign import OutputQuantity
from .._record import Record
from ..spectrum import excited_band, measured_state, settled_window

_WINDOWS = 24
"""Windows, half overlapping, into which a record without dwells is cut."""

_PERIODS = 6.0
"""Periods of the slowest motion that a window holds at least."""

_MOST_LINES = 48
"""Lines of a window that count at most: those that are driven hardest."""

_DRIVEN_SHARE = 0.03
"""Amplitude of the drive, over its largest in the window, below which a line is not driven."""

_MARGIN_PERIODS = 3.0
"""Periods of the slowest motion at each end of a record whose integrals depend on what lies beyond it."""

_LARGEST_MARGIN = 0.2
"""Largest share of the record that each margin takes."""


@dataclass(frozen=True, eq=False)
class Lines:
    """What must balance in one record: Fourier lines of smooth windows.

    A window multiplies every term of the balance alike, so that it holds on the lines of the window without
    leakage, in a sweep and in a transient too.

    Attributes:
        target: what the laws must add up to: the force [N], per mass under base excitation [m/s^2].
        push: the force that feeds power in, in the same unit; the target, but with an absolute acceleration.
        laws: inertia (none with an absolute acceleration), then v, x, |x|x, x^3, |v|v, v^3, sign v.
        velocity: v [m/s].
        displacement: x [m].
        omega: angular frequency [rad/s].
        middle: middle of the window, seconds since the start of the file.
    """

    target: Complex[np.ndarray, " line"]
    push: Complex[np.ndarray, " line"]
    laws: Complex[np.ndarray, "line law"]
    velocity: Complex[np.ndarray, " line"]
    displacement: Complex[np.ndarray, " line"]
    omega: Float[np.ndarray, " line"]
    middle: Float[np.ndarray, " line"]


def lines_of(record: Record, quantity: OutputQuantity, based: bool) -> Lines:
    """Gives the lines of a record.

    Args:
        record: The record.
        quantity: What its output is.
        based: Whether its input is the acceleration of the base; an acceleration output is then absolute.

    Returns:
        The lines; no line where nothing is driven.
    """
    absolute = based and quantity == "acceleration"
    push = -record.input if based else record.input
    own = replace(record, input=push, output=record.output + push) if absolute else record
    band = excited_band(own)
    lowest = min(max(1.5 * band.lowest, 2.0 * record.rate / record.time.size), 0.5 * band.highest)
    x, v, a = measured_state(own, quantity, lowest, band.highest)
    slow = 1e-2 * float(np.std(v)) + 1e-300
    general = [v, x, np.abs(x) * x, x**3, np.abs(v) * v, v**3, v / np.hypot(v, slow)]
    # The restoring force of a mass on a moving base is all of its absolute acceleration.
    terms = [-record.output, push, *general] if absolute else [push, push, a, *general]
    signals = np.stack(terms, axis=1)
    found = [
        _window_lines(
            signals[start:stop], record.rate, (lowest, band.highest), frequency, record.start + start
        )
        for start, stop, frequency in _windows(own, lowest)
    ]
    spectrum, omega, middle = (np.concatenate(parts) for parts in zip(*found, strict=True))
    laws = spectrum[:, 2:]
    first = laws.shape[1] - len(general)
    return Lines(spectrum[:, 0], spectrum[:, 1], laws, laws[:, first], laws[:, first + 1], omega, middle)


@no_type_check  # once a window; its caller is checked
def _window_lines(
    part: Float[np.ndarray, "time term"],
    rate: float,
    band: tuple[float, float],
    frequency: float | None,
    start: int,
) -> tuple[Complex[np.ndarray, "line term"], Float[np.ndarray, " line"], Float[np.ndarray, " line"]]:
    """Gives the lines of one window, their angular frequencies and the middle of the window [s]."""
    size = part.shape[0]
    part = (part - np.mean(part, axis=0)) * (np.hanning(size) / size)[:, None]
    if frequency is not None:
        lines = np.array([frequency])
        spectrum = np.exp(-2j * np.pi * frequency * np.arange(size) / rate)[None, :] @ part
    else:
        spectrum, lines = np.fft.rfft(part, axis=0), np.fft.rfftfreq(size, 1.0 / rate)
        driven = np.abs(spectrum[:, 1]) * ((lines >= band[0]) & (lines <= band[1]))
        hardest = np.argsort(-driven)[:_MOST_LINES]
        kept = np.sort(hardest[driven[hardest] > _DRIVEN_SHARE * np.max(driven)])
        spectrum, lines = spectrum[kept], lines[kept]
    return spectrum, 2 * np.pi * lines, np.full(lines.size, (start + 0.5 * size) / rate)


def _windows(record: Record, lowest: float) -> list[tuple[int, int, float | None]]:
    """Gives first sample, one past the last and, of a dwell, the frequency [Hz] of each window."""
    if record.dwells:
        return [(*settled_window(dwell, record.rate), dwell.frequency) for dwell in record.dwells]
    size = record.time.size
    if record.kind == "impulse":
        return [(0, size, None)]
    margin = round(min(_MARGIN_PERIODS * record.rate / lowest, _LARGEST_MARGIN * size))
    inner = size - 2 * margin
    length = round(min(inner, max(2.0 * inner / (_WINDOWS + 1), _PERIODS * record.rate / lowest)))
    starts = range(margin, size - margin - length + 1, max(1, length // 2))
    return [(start, start + length, None) for start in starts]
