"""The drive of a planned test."""

import numpy as np
from jaxtyping import Float

from ..diagnosis import DWELLS, Waveform
from ._test_outline import TestOutline


def drive_of(
    outline: TestOutline,
    levels: tuple[float, ...],
    lowest: float,
    highest: float,
    waveform: Waveform,
    backward: bool = False,
    dwells: int = DWELLS,
) -> Float[np.ndarray, "record time"]:
    """Give the drive of a test: one record a level, as long as `DWELLS` segments.

    Args:
        outline: sampling rate and length of a segment.
        levels: rms of each record [SI unit of the drive].
        lowest: lowest frequency [Hz].
        highest: highest frequency [Hz].
        waveform: sines in steps, a whole number of cycles in each, or swept evenly, up in one record
            and down in the next; or random-phase multisines whose period is the record.
        backward: whether the first record goes down.
        dwells: steps of a stepped sine.

    Returns:
        The drive.
    """
    rows = []
    for row, level in enumerate(levels):
        down = (row % 2 == 1) != backward
        if waveform == "multisine":
            rows.append(level * _multisine(outline, lowest, highest, row))
            continue
        first, last = (highest, lowest) if down else (lowest, highest)
        stepped = waveform == "stepped sine"
        sine = _steps(outline, first, last, dwells) if stepped else _sweep(outline, first, last)
        rows.append(np.sqrt(2.0) * level * sine)
    return np.stack(rows)


def _steps(outline: TestOutline, first: float, last: float, dwells: int) -> Float[np.ndarray, " time"]:
    samples = DWELLS * outline.samples // dwells
    cycles = np.maximum(1, np.round(np.linspace(first, last, dwells) * samples / outline.rate))
    return np.sin(2.0 * np.pi * cycles[:, None] * np.arange(samples) / samples).ravel()


def _sweep(outline: TestOutline, first: float, last: float) -> Float[np.ndarray, " time"]:
    total = DWELLS * outline.samples
    time = np.arange(total) / outline.rate
    return np.sin(2.0 * np.pi * (first * time + 0.5 * (last - first) * outline.rate / total * time**2))


def _multisine(outline: TestOutline, lowest: float, highest: float, seed: int) -> Float[np.ndarray, " time"]:
    """Give a multisine of unit rms; NaN where none of its lines lies in the band."""
    total = DWELLS * outline.samples
    orders = np.arange(total // 2)
    inside = (
        (orders >= lowest * total / outline.rate) & (orders <= highest * total / outline.rate) & (orders > 0)
    )
    if not inside.any():
        return np.full(total, np.nan)
    spectrum = np.zeros(total // 2 + 1, dtype=complex)
    phases = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, orders.size)
    spectrum[orders[inside]] = np.exp(1j * phases[inside])
    signal = np.fft.irfft(spectrum, total)
    return signal / np.std(signal)
