"""Dwells of a stepped sine, detected in its input without a schedule.

The rising zero crossings of a sine lie on a straight line over their number, with a slope of one period. A
stepped sine is a chain of such lines. Dynamic programming over the crossings finds the chain with the
smallest sum of squared error and a penalty per line. The samples then refine the frequency of each dwell.
"""

from pathlib import Path

import numpy as np
from jaxtyping import Float

from .._record import Dwell
from ..spectrum import harmonic_basis

_FEWEST_DWELL_CYCLES = 4
"""Cycles of one frequency without which a segment is no dwell."""

_MOST_CROSSINGS = 6000
"""Crossings, since the search grows with their square, beyond which a signal counts as no stepped sine."""

_PENALTY = 40.0
"""Squared error, over that of the crossing noise, that one more line must save."""

_SURE = 0.1
"""A crossing counts between samples below and above this share of the signal's rms."""

_SHARED = 0.5
"""Share of the step in period within which the crossing between two dwells lies on both lines."""

_ADJACENT = 2.5
"""Periods by which two dwells that follow each other are apart at most."""

_SAME_PERIOD, _SAME_PHASE = 2e-3, 0.1
"""Relative difference in period, and distance in periods, of two lines that are one dwell."""

_NEAR_END = 1.5
"""Periods within which a dwell reaches to the start or the end of the signal."""

_RESOLUTION = 0.5
"""Cycles over the window by which a refined frequency may move: beyond, the segment is no single sine."""

_EXPLAINED = 0.5
"""Share of the input that the sines of its own schedule explain in most dwells."""


def rising_crossings(signal: Float[np.ndarray, " time"], rate: float) -> Float[np.ndarray, " crossing"]:
    """Gives the times [s] at which a signal rises through its mean, from below to above a tenth of its rms.

    Args:
        signal: Samples, (time,).
        rate: Samples per second [Hz].

    Returns:
        Times, (crossing,), by linear interpolation.
    """
    centred = signal - np.mean(signal)
    threshold = _SURE * float(np.sqrt(np.mean(centred**2)))
    side = np.where(centred > threshold, 1, np.where(centred < -threshold, -1, 0))
    sure = np.flatnonzero(side)
    turns = np.flatnonzero((side[sure[:-1]] < 0) & (side[sure[1:]] > 0))
    times = []
    for low, high in zip(sure[turns], sure[turns + 1], strict=True):
        # Noise affects a line through all samples between the two thresholds less than one through two
        # samples.
        inside = np.arange(low, high + 1)
        slope, offset = np.polyfit(inside - low, centred[inside], 1)
        times.append(low - offset / slope if slope > 0 else 0.5 * (low + high))
    return np.asarray(times, dtype=np.float64) / rate


def crossing_lines(crossings: Float[np.ndarray, " crossing"]) -> list[tuple[int, int]]:
    """Gives the runs [first, last) of crossings that lie on one line each."""
    count = crossings.size
    number = np.arange(count, dtype=np.float64)
    # Without the common slope the sums of squares below keep their digits.
    centred = crossings - crossings[0] - (crossings[-1] - crossings[0]) / max(count - 1, 1) * number
    bend = np.diff(crossings, 2)
    noise = 1.4826 * float(np.median(np.abs(bend - np.median(bend)))) / np.sqrt(6.0)
    period = float(np.median(np.diff(crossings)))
    penalty = _PENALTY * max(noise, 1e-4 * period) ** 2
    sums = [
        np.concatenate([[0.0], np.cumsum(one)])
        for one in (number, centred, number**2, number * centred, centred**2)
    ]
    best = np.full(count + 1, np.inf)
    best[0], came = -penalty, np.zeros(count + 1, dtype=int)
    for last in range(1, count + 1):
        first = np.arange(0, last)
        size = last - first
        k, t, kk, kt, tt = (one[last] - one[first] for one in sums)
        spread = np.maximum(kk - k * k / size, 1e-300)
        error = np.maximum(
            tt - t * t / size - np.where(size > 1, (kt - k * t / size) ** 2 / spread, 0.0), 0.0
        )
        # Two crossings always lie on a line: the penalty of short lines keeps noise from being fitted by
        # pairs.
        cost = (
            best[first] + error + penalty + np.where(size < _FEWEST_DWELL_CYCLES, 2.0 * penalty * size, 0.0)
        )
        came[last] = int(np.argmin(cost))
        best[last] = cost[came[last]]
    runs, last = [], count
    while last > 0:
        runs.append((int(came[last]), last))
        last = int(came[last])
    return runs[::-1]


def segment_dwells(signal: Float[np.ndarray, " time"], rate: float) -> tuple[Dwell, ...]:
    """Gives the dwells of a stepped sine from its input alone.

    Args:
        signal: The input, (time,).
        rate: Samples per second [Hz].

    Returns:
        Dwells in order of time; empty where the signal is no stepped sine (no segment of four equal cycles).
    """
    crossings = rising_crossings(signal, rate)
    if not _FEWEST_DWELL_CYCLES <= crossings.size <= _MOST_CROSSINGS:
        return ()
    runs = [
        (first, last) for first, last in crossing_lines(crossings) if last - first >= _FEWEST_DWELL_CYCLES
    ]
    lines = [
        (first, last, *np.polyfit(np.arange(first, last), crossings[first:last], 1)) for first, last in runs
    ]
    spans: list[tuple[float, float, float]] = []
    for first, last, period, origin in lines:
        start, end = crossings[first], crossings[last - 1] + period
        # The crossing between two dwells lies on both lines; the dwell starts there.
        if spans and abs(origin + (first - 1) * period - crossings[first - 1]) < _SHARED * abs(
            period - spans[-1][2]
        ):
            start = crossings[first - 1]
        if spans and start - spans[-1][1] < _ADJACENT * period:
            earlier = spans[-1]
            same = abs(earlier[2] / period - 1.0) < _SAME_PERIOD
            if same and abs(start - earlier[1]) < _SAME_PHASE * period:
                spans[-1] = (earlier[0], end, (end - earlier[0]) / round((end - earlier[0]) / period))
                continue
            spans[-1] = (earlier[0], start, earlier[2])
        spans.append((start, end, period))
    if not spans:
        return ()
    length = signal.size / rate
    if spans[0][0] < _NEAR_END * spans[0][2]:
        spans[0] = (0.0, *spans[0][1:])
    if length - spans[-1][1] < _NEAR_END * spans[-1][2]:
        spans[-1] = (spans[-1][0], length, spans[-1][2])
    dwells = []
    for opening, end, period in spans:
        start, stop = round(opening * rate), min(round(end * rate), signal.size)
        frequency = refine_frequency(signal[start:stop], rate, 1.0 / period)
        dwells.append(Dwell(start, stop, frequency, (stop - start) * frequency / rate))
    return tuple(dwells)


def refine_frequency(signal: Float[np.ndarray, " time"], rate: float, frequency: float) -> float:
    """Gives the frequency [Hz] of a dwell: the least residual of three harmonics in its inner part, by
    Gauss-Newton.
    """
    edge = signal.size // 5
    inner = signal[edge : signal.size - edge]
    time = (np.arange(inner.size) - 0.5 * (inner.size - 1)) / rate
    start = frequency
    for _ in range(4):
        basis = harmonic_basis(time, frequency, 3)
        if inner.size <= basis.shape[1] + 1:
            return start
        c, s = _least_squares(basis, inner)[1:3]
        phase = 2.0 * np.pi * frequency * time
        slope = -2.0 * np.pi * time * (c * np.sin(phase) + s * np.cos(phase))
        size = max(float(np.sqrt(np.mean(slope**2))), 1e-300)
        frequency += float(_least_squares(np.column_stack([basis, slope / size]), inner)[-1]) / size
    return frequency if abs(frequency - start) * inner.size / rate < _RESOLUTION else start


def _least_squares(
    basis: Float[np.ndarray, "time column"], signal: Float[np.ndarray, " time"]
) -> Float[np.ndarray, " column"]:
    """Gives least-squares coefficients by the normal equations: over whole cycles the basis is nearly
    orthogonal.
    """
    gram = basis.T @ basis
    return np.linalg.solve(gram + 1e-14 * np.trace(gram) * np.eye(len(gram)), basis.T @ signal)


def check_dwells(
    file: Path, signal: Float[np.ndarray, " time"], rate: float, dwells: tuple[Dwell, ...]
) -> None:
    """Refuses a schedule that is not the one of this input.

    Raises:
        ValueError: If a sine at the scheduled frequency explains less than half of the input in most dwells.
    """
    explained = []
    for dwell in dwells:
        part = signal[dwell.start : dwell.stop]
        part = part - np.mean(part)
        basis = harmonic_basis(np.arange(part.size) / rate, dwell.frequency, 1)
        rest = part - basis @ _least_squares(basis, part)
        explained.append(1.0 - float(rest @ rest) / max(float(part @ part), 1e-300))
    if np.median(explained) < _EXPLAINED:
        worst = int(np.argmin(explained))
        raise ValueError(
            f"{file} does not fit its record: a sine of {dwells[worst].frequency:.6g} Hz explains only "
            f"{100 * explained[worst]:.0f} % of the input in dwell {worst + 1}; is it the schedule of "
            "another record?"
        )
