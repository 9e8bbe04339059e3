"""Lack of fit against pure error: what of a residual comes back with every cycle of the drive."""

import itertools
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy import signal, stats

from ..._show import shown
from ...records import Record
from ._errors import Run
from ._fit_result import Fit

USUAL_ACCURACY = 1e-3
"""Error of the readings, as a share of them, where none is declared."""

HIGHEST_ORDER = 8
"""Highest harmonic of a sine at which a model may be wrong."""

LINES_BESIDE = (2, 3)
"""Lines beside a harmonic, on either side, that hold noise alone. The next one also holds what drifts."""

SWEPT_CYCLES = 16
"""Cycles of a sweep over which its response hardly changes."""

LINES_A_BAND = 32
"""Lines of a periodic drive over which the noise has one level."""

_HIGHEST = 0.4
"""Highest frequency, over the sampling rate: above it anti-alias filters work."""


@shown
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


class _Lines(NamedTuple):
    """Powers of lines at which the noise has one level: of the residual, of the response, of the noise."""

    locked: Float[np.ndarray, " line"]
    response: Float[np.ndarray, " line"]
    noise: Float[np.ndarray, " beside"]


def lack_of_fit(fit: Fit) -> LackOfFit:
    """Test whether what a model leaves is locked to the drive.

    Noise and everything else that does not repeat lies at all frequencies alike, model errors lie at the
    harmonics of the drive. The test asks for no noise level: the lines beside the harmonics show it, whatever
    its colour.

    Args:
        fit: the fit; its fitted records count, each segment restarted from its own best state.

    Returns:
        The test.

    Source: Pintelon & Schoukens 2012, System Identification: A Frequency Domain Approach, sec. 11.3 (cost
    against the noise that periods show); Box & Draper 1987 (lack of fit).
    """
    runs = [run for run in fit.restarts.runs if run.record.role == "fit"]
    return locked_power(runs, len(fit.free), fit.campaign.accuracy or USUAL_ACCURACY)


def shows_noise(record: Record) -> bool:
    """Say whether a record distinguishes noise from what repeats with the drive: a free decay does not.

    Args:
        record: the record.
    """
    if record.period is not None and not record.dwells:
        return record.output.size - record.settle >= 2 * record.period
    return next(_whole_cycles(record), None) is not None


def locked_power(runs: Iterable[Run], coefficients: int, tolerance: float) -> LackOfFit:
    """Test records against their simulation, as `lack_of_fit` does.

    Args:
        runs: the records, each segment restarted from its own best state.
        coefficients: coefficients that were fitted to them.
        tolerance: error that the reading may have at a line, over the response there or the rms of the
            response over all lines, whichever is larger [1].

    Returns:
        The test.
    """
    power, count, beside = 0.0, 0, 0
    for lines in itertools.chain.from_iterable(map(_lines, runs)):
        # One over a mean of n powers of noise is too large by n / (n - 1) on average.
        level = np.mean(lines.noise) * lines.noise.size / (lines.noise.size - 1)
        power += float(np.sum(lines.locked / (level + tolerance**2 * lines.response)))
        count += lines.locked.size
        beside += lines.noise.size
    if not count:
        return LackOfFit(float("nan"), float("nan"), (0.0, 0.0))
    freedom = max(1.0, 2.0 * count - coefficients), 2.0 * beside
    ratio = 2.0 * power / freedom[0]
    return LackOfFit(float(stats.f.sf(ratio, *freedom)), ratio, freedom)


def _lines(run: Run) -> Iterator[_Lines]:
    """Give the powers of a record, line by line where the noise has one level."""
    if run.record.period is not None and not run.record.dwells:
        yield from _periodic_lines(run, run.record.period)
        return
    pieces = [_powers(run, *piece) for piece in _whole_cycles(run.record)]
    for order in range(HIGHEST_ORDER):
        own = [rows[order] for rows in pieces if len(rows) > order]
        if own:
            locked, response, noise = zip(*own, strict=True)
            yield _Lines(np.array(locked), np.array(response), np.concatenate(noise))


def _periodic_lines(run: Run, period: int) -> Iterator[_Lines]:
    """Give the lines of whole periods; those between them hold what does not repeat."""
    count = (run.record.output.size - run.record.settle) // period
    if count < 2:
        return
    whole = slice(run.record.output.size - count * period, None)
    powers = [np.abs(np.fft.rfft(each[whole])) ** 2 for each in (run.residual, run.record.output)]
    places = np.arange(1, int(_HIGHEST * period)) * count
    response = np.maximum(powers[1], np.mean(powers[1][places]))
    for band in np.array_split(places, max(1, places.size // LINES_A_BAND)):
        between = band[:, None] + np.arange(1, count)
        yield _Lines(powers[0][band], response[band], powers[0][between].ravel())


def _whole_cycles(record: Record) -> Iterator[tuple[slice, Float[np.ndarray, " time"], int]]:
    """Cut a record into whole cycles of a sine: samples, phase of the drive [rad], cycles."""
    if record.dwells:
        for dwell in record.dwells:
            turn = 2.0 * np.pi * dwell.frequency / record.rate
            cycles = int((dwell.stop - max(dwell.start, record.settle)) * turn / (2.0 * np.pi) + 1e-6)
            start = dwell.stop - round(2.0 * np.pi * cycles / turn)
            if cycles > 2 * max(LINES_BESIDE):
                yield slice(start, dwell.stop), turn * np.arange(dwell.stop - start), cycles
    elif record.kind == "swept":
        drive = record.input - np.mean(record.input)
        turns = np.abs(np.unwrap(np.angle(np.asarray(signal.hilbert(drive), dtype=complex))))
        edges = np.arange(turns[record.settle], turns[-1], 2.0 * np.pi * SWEPT_CYCLES)
        bounds = np.searchsorted(np.maximum.accumulate(turns), edges)
        for start, stop in itertools.pairwise(bounds.tolist()):
            yield slice(start, stop), turns[start:stop], SWEPT_CYCLES


def _powers(
    run: Run, part: slice, phase: Float[np.ndarray, " time"], cycles: int
) -> list[tuple[float, float, list[float]]]:
    """Give, for each harmonic, power of the residual, of the response, and of the residual beside it."""
    residual, output = run.residual[part], run.record.output[part]
    sides = [
        residual * np.exp(-1j * sign * line / cycles * phase) for line in LINES_BESIDE for sign in (-1, 1)
    ]
    values = np.stack([residual, output - np.mean(output), *sides])
    turn = np.exp(-1j * phase)
    line = np.ones_like(turn)
    rows: list[list[float]] = []
    for _ in range(min(HIGHEST_ORDER, int(_HIGHEST * residual.size / cycles))):
        line = line * turn
        rows.append((np.abs(values @ line) ** 2 / residual.size).tolist())
    mean = float(np.mean([row[1] for row in rows])) if rows else 0.0
    return [(row[0], max(row[1], mean), row[2:]) for row in rows]
