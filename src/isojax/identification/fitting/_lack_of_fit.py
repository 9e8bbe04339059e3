"""Lack of fit against pure error: what of a residual comes back with every cycle of the drive."""

import itertools
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy import signal, stats

from ...records import Record
from ._errors import Run

HIGHEST_ORDER = 8
"""Harmonics of the drive at which a model may be wrong."""

LINES_BESIDE = (2, 3)
"""Lines beside a harmonic, on either side, that hold noise alone. The next one also holds what drifts."""

SWEPT_CYCLES = 16
"""Cycles of a sweep over which its response hardly changes."""


class LackOfFit(NamedTuple):
    """Power of a residual at the harmonics of the drive, against the power of the lines beside them.

    Attributes:
        p_value: chance of so much locked power where the model is right; NaN where no record has a drive that
            repeats.
        ratio: locked power over what noise and the declared error of the response lead to expect.
        freedom: degrees of freedom of both powers.
    """

    p_value: float
    ratio: float
    freedom: tuple[float, float]


class _Piece(NamedTuple):
    """Whole cycles of a drive: samples, phase of the drive [rad], cycles, and the orders to look at."""

    part: slice
    phase: Float[np.ndarray, " time"]
    cycles: int
    orders: int


def lack_of_fit(runs: tuple[Run, ...], coefficients: int, tolerance: float) -> LackOfFit:
    """Test whether what a model leaves is locked to the drive.

    Noise and everything else that does not repeat lies at all frequencies alike, model errors lie at the
    harmonics of the drive. The test asks for no noise level: the lines beside the harmonics show it, whatever
    its colour.

    Args:
        runs: records against their simulation, each segment restarted from its own best state.
        coefficients: coefficients that were fitted to them.
        tolerance: error that any channel may have, over the response at the same frequency [1].

    Returns:
        The test.

    Source: Pintelon & Schoukens 2012, System Identification: A Frequency Domain Approach, sec. 11.3 (cost
    against the noise that periods show); Box & Draper 1987 (lack of fit).
    """
    locked, lines, beside = 0.0, 0, 0
    for run in runs:
        powers = [_powers(run, piece) for piece in _pieces(run.record)]
        for order in range(1, HIGHEST_ORDER + 1):
            own = [rows[order - 1] for rows in powers if len(rows) >= order]
            if not own:
                continue
            at, response, noise = (np.array(column) for column in zip(*own, strict=True))
            # One over a mean of n powers of noise is too large by n / (n - 1) on average.
            floor = np.mean(noise) * noise.size / (noise.size - 1)
            locked += float(np.sum(at / (floor + tolerance**2 * response)))
            lines += at.size
            beside += noise.size
    if not lines:
        return LackOfFit(float("nan"), float("nan"), (0.0, 0.0))
    freedom = max(1.0, 2.0 * lines - coefficients), 2.0 * beside
    ratio = 2.0 * locked / freedom[0]
    return LackOfFit(float(stats.f.sf(ratio, *freedom)), ratio, freedom)


def _pieces(record: Record) -> Iterator[_Piece]:
    """Cut a record into whole cycles of its drive; nothing where the drive has none."""
    shortest = 2 * max(LINES_BESIDE) + 2
    if record.dwells:
        for dwell in record.dwells:
            first = max(dwell.start, record.settle)
            cycles = int((dwell.stop - first) * dwell.frequency / record.rate + 1e-6)
            start = dwell.stop - round(cycles * record.rate / dwell.frequency)
            if cycles >= shortest:
                phase = 2.0 * np.pi * dwell.frequency / record.rate * np.arange(dwell.stop - start)
                yield _Piece(slice(start, dwell.stop), phase, cycles, _orders(record.rate, dwell.frequency))
    elif record.kind == "swept":
        drive = record.input - np.mean(record.input)
        turns = np.unwrap(np.angle(np.asarray(signal.hilbert(drive), dtype=complex)))
        if turns[-1] < turns[0]:
            turns = -turns
        edges = np.arange(turns[record.settle], turns[-1], 2.0 * np.pi * SWEPT_CYCLES)
        bounds = np.searchsorted(np.maximum.accumulate(turns), edges)
        for start, stop in itertools.pairwise(bounds):
            if stop - start > 4 * SWEPT_CYCLES:
                frequency = SWEPT_CYCLES * record.rate / (stop - start)
                part = slice(int(start), int(stop))
                yield _Piece(part, turns[part], SWEPT_CYCLES, _orders(record.rate, frequency))


def _orders(rate: float, frequency: float) -> int:
    return min(HIGHEST_ORDER, int(0.4 * rate / frequency))


def _powers(run: Run, piece: _Piece) -> list[tuple[float, float, list[float]]]:
    """Give, for each harmonic, power of the residual, of the response, and of the residual beside it."""
    residual, output = run.residual[piece.part], run.record.output[piece.part]
    output = output - np.mean(output)
    rows = []
    for order in range(1, piece.orders + 1):
        at = np.exp(-1j * order * piece.phase)
        sides = [
            _power(residual, np.exp(-1j * (order + sign * line / piece.cycles) * piece.phase))
            for line in LINES_BESIDE
            for sign in (-1, 1)
        ]
        rows.append((_power(residual, at), _power(output, at), sides))
    return rows


def _power(values: Float[np.ndarray, " time"], line: np.ndarray) -> float:
    return float(np.abs(values @ line) ** 2) / values.size
