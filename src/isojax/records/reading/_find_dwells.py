"""Dwells of a stepped sine found in its input, without a schedule.

The rising zero crossings of a sine lie on a straight line over their number, of slope one period. A stepped
sine is a chain of such lines; dynamic programming over the crossings finds the chain of least squared error
plus a price per line, and each dwell's frequency is then refined on the samples.
"""

from pathlib import Path

import numpy as np
from jaxtyping import Float

from .._record import Dwell
from ..spectrum import harmonic_basis

_FEWEST_CYCLES = 4
_MOST_CROSSINGS = 6000
_PRICE = 40.0  # squared error in units of the crossing noise that one more line must save


def rising_crossings(signal: Float[np.ndarray, " time"], rate: float) -> Float[np.ndarray, " crossing"]:
    """Gives the times at which a signal rises through its mean [s], one per swing below and above a tenth of
    its rms.

    Args:
        signal: Samples, (time,).
        rate: Samples per second [Hz].

    Returns:
        Times, (crossing,), by linear interpolation.
    """
    centred = signal - np.mean(signal)
    threshold = 0.1 * float(np.sqrt(np.mean(centred**2)))
    side = np.where(centred > threshold, 1, np.where(centred < -threshold, -1, 0))
    sure = np.flatnonzero(side)
    turns = np.flatnonzero((side[sure[:-1]] < 0) & (side[sure[1:]] > 0))
    times = []
    for low, high in zip(sure[turns], sure[turns + 1], strict=True):
        # a line through all samples between the two thresholds is less shaken by noise than two samples are
        inside = np.arange(low, high + 1)
        slope, offset = np.polyfit(inside - low, centred[inside], 1)
        times.append(low - offset / slope if slope > 0 else 0.5 * (low + high))
    return np.asarray(times, dtype=np.float64) / rate


def crossing_lines(crossings: Float[np.ndarray, " crossing"]) -> list[tuple[int, int]]:
    """Gives the runs [first, last) of crossings that lie on one line each."""
    count = crossings.size
    number = np.arange(count, dtype=np.float64)
    # without the common slope the sums of squares below keep their digits
    centred = crossings - crossings[0] - (crossings[-1] - crossings[0]) / max(count - 1, 1) * number
    bend = np.diff(crossings, 2)
    noise = 1.4826 * float(np.median(np.abs(bend - np.median(bend)))) / np.sqrt(6.0)
    period = float(np.median(np.diff(crossings)))
    price = _PRICE * max(noise, 1e-4 * period) ** 2
    sums = [
        np.concatenate([[0.0], np.cumsum(one)])
        for one in (number, centred, number**2, number * centred, centred**2)
    ]
    best = np.full(count + 1, np.inf)
    best[0], came = -price, np.zeros(count + 1, dtype=int)
    for last in range(1, count + 1):
        first = np.arange(0, last)
        size = last - first
        k, t, kk, kt, tt = (one[last] - one[first] for one in sums)
        spread = np.maximum(kk - k * k / size, 1e-300)
        error = np.maximum(
            tt - t * t / size - np.where(size > 1, (kt - k * t / size) ** 2 / spread, 0.0), 0.0
        )
        # two crossings always lie on a line; without its price noise would pay for pairs
        cost = best[first] + error + price + np.where(size < _FEWEST_CYCLES, 2.0 * price * size, 0.0)
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
        Dwells in order of time; empty where the signal is no stepped sine (no stretch of four like cycles).
    """
    crossings = rising_crossings(signal, rate)
    if not 4 <= crossings.size <= _MOST_CROSSINGS:
        return ()
    runs = [(first, last) for first, last in crossing_lines(crossings) if last - first >= _FEWEST_CYCLES]
    lines = [
        (first, last, *np.polyfit(np.arange(first, last), crossings[first:last], 1)) for first, last in runs
    ]
    spans: list[tuple[float, float, float]] = []
    for first, last, period, origin in lines:
        begin, end = crossings[first], crossings[last - 1] + period
        # the crossing between two dwells lies on both lines; the dwell starts there
        if spans and abs(origin + (first - 1) * period - crossings[first - 1]) < 0.5 * abs(
            period - spans[-1][2]
        ):
            begin = crossings[first - 1]
        if spans and begin - spans[-1][1] < 2.5 * period:
            earlier = spans[-1]
            if abs(earlier[2] / period - 1.0) < 2e-3 and abs(begin - earlier[1]) < 0.1 * period:
                spans[-1] = (earlier[0], end, (end - earlier[0]) / round((end - earlier[0]) / period))
                continue
            spans[-1] = (earlier[0], begin, earlier[2])
        spans.append((begin, end, period))
    if not spans:
        return ()
    length = signal.size / rate
    if spans[0][0] < 1.5 * spans[0][2]:
        spans[0] = (0.0, *spans[0][1:])
    if length - spans[-1][1] < 1.5 * spans[-1][2]:
        spans[-1] = (spans[-1][0], length, spans[-1][2])
    dwells = []
    for begin, end, period in spans:
        start, stop = round(begin * rate), min(round(end * rate), signal.size)
        frequency = refine_frequency(signal[start:stop], rate, 1.0 / period)
        dwells.append(Dwell(start, stop, frequency, (stop - start) * frequency / rate))
    return tuple(dwells)


def refine_frequency(signal: Float[np.ndarray, " time"], rate: float, frequency: float) -> float:
    """Gives the frequency [Hz] at which three harmonics leave the least of a dwell's inner part
    (Gauss-Newton).
    """
    edge = signal.size // 5
    inner = signal[edge : signal.size - edge]
    time = (np.arange(inner.size) - 0.5 * (inner.size - 1)) / rate
    start = frequency
    for _ in range(4):
        basis = harmonic_basis(time, frequency, 3)
        if inner.size <= basis.shape[1] + 1:
            return start
        c, s = _solve(basis, inner)[1:3]
        phase = 2.0 * np.pi * frequency * time
        slope = -2.0 * np.pi * time * (c * np.sin(phase) + s * np.cos(phase))
        size = max(float(np.sqrt(np.mean(slope**2))), 1e-300)
        frequency += float(_solve(np.column_stack([basis, slope / size]), inner)[-1]) / size
    # a step beyond the resolution of the window means that the stretch is no single sine
    return frequency if abs(frequency - start) * inner.size / rate < 0.5 else start


def _solve(
    basis: Float[np.ndarray, "time column"], signal: Float[np.ndarray, " time"]
) -> Float[np.ndarray, " column"]:
    """Gives least-squares coefficients by the normal equations: over whole cycles the columns are near
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
        rest = part - basis @ _solve(basis, part)
        explained.append(1.0 - float(rest @ rest) / max(float(part @ part), 1e-300))
    if np.median(explained) < 0.5:
        worst = int(np.argmin(explained))
        raise ValueError(
            f"{file} does not fit its record: a sine of {dwells[worst].frequency:.6g} Hz explains only "
            f"{100 * explained[worst]:.0f} % of the input in dwell {worst + 1}; is it the schedule of "
            "another record?"
        )
