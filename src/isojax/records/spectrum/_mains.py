"""Hum of the mains on the output: whether it is there, and which dwells hide it under a harmonic."""

import functools
from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np
import scipy.stats
from jaxtyping import Complex

from .._record import Dwell, Record
from ._basis import meeting_order
from ._dwell_end import dwell_rest, dwell_window

MAINS = (50.0, 60.0)
"""Frequencies of public mains [Hz]."""

_BESIDE = np.array([-3.5, -2.5, -1.5, 1.5, 2.5, 3.5])
"""Where the noise next to a line is looked at, in lines of the window."""

_CLEAR = 0.75
"""Lines of the window by which what is looked at must keep off harmonics, which have been taken out."""

_CHANCE = 1e-4
"""Of a record without hum to show one."""


@dataclass(frozen=True)
class HumLine:
    """A line of the mains that stands out of a record.

    Attributes:
        record: Name of the record.
        frequency: Of the line [Hz].
        amplitude: Its mean amplitude [SI unit of the output].
    """

    record: str
    frequency: float
    amplitude: float


@dataclass(frozen=True)
class MainsCollision:
    """A dwell with a harmonic that cannot be told from the mains.

    Attributes:
        record: Name of the record.
        dwell: The dwell.
        order: Of the harmonic.
        mains: Frequency of the mains [Hz].
    """

    record: str
    dwell: Dwell
    order: int
    mains: float


_KNOWN: WeakKeyDictionary[Record, tuple[HumLine, ...]] = WeakKeyDictionary()
"""Lines that were already sought: noise, harmonics and health all ask."""


def hum_lines(record: Record) -> tuple[HumLine, ...]:
    """Gives the lines of the mains that stand out of what the harmonics leave of a record's settled dwells.

    A line counts if its power, summed over the dwells in which no harmonic is near it, exceeds that of the
    noise next to it beyond a chance of 1e-4: their ratio is F-distributed without hum.

    Args:
        record: The record.

    Returns:
        The lines; none without dwells, and none where every dwell has a harmonic there.
    """
    if record not in _KNOWN:
        found = [_stands_out(record, line) for line in MAINS if line < 0.45 * record.rate]
        _KNOWN[record] = tuple(one for one in found if one is not None)
    return _KNOWN[record]


def _stands_out(record: Record, line: float) -> HumLine | None:
    """Gives a line if it stands out of the noise."""
    powers, beside, squares = [], [], []
    for dwell in record.dwells:
        window = dwell_window(record, dwell)
        if window is None:
            continue
        resolution = record.rate / window
        sought = np.concatenate([[line], line + _BESIDE * resolution])
        off = np.abs(sought - dwell.frequency * np.round(sought / dwell.frequency))
        clear = (off >= _CLEAR * resolution) & (sought < 0.45 * record.rate)
        if not clear[0] or not np.any(clear[1:]):
            continue
        rest = dwell_rest(record, dwell, window).signal
        power = np.abs(_tones(window, record.rate, tuple(sought[clear])) @ rest) ** 2
        # Per dwell, so that one that never settled does not drown the others.
        noise = float(np.mean(power[1:]))
        if noise > 0.0:
            powers.append(power[0] / noise)
            beside.append(power.size - 1)
            squares.append(4.0 * (power[0] - noise) / window**2)
    if not powers:
        return None
    # Each ratio is F(2, 2 k); on Fisher's scale their chances add up to a chi-square.
    chances = np.maximum(scipy.stats.f.sf(powers, 2, 2 * np.array(beside)), 1e-300)
    if not scipy.stats.chi2.sf(-2.0 * np.sum(np.log(chances)), 2 * chances.size) < _CHANCE:
        return None
    return HumLine(record.name, line, float(np.sqrt(max(np.mean(squares), 0.0))))


@functools.lru_cache(maxsize=128)
def _tones(window: int, rate: float, frequencies: tuple[float, ...]) -> Complex[np.ndarray, "line time"]:
    """Gives a turning phasor for each frequency; the records of a campaign ask for the same ones."""
    time = np.arange(window) / rate
    return np.exp(-2j * np.pi * np.array(frequencies)[:, None] * time)


def mains_collisions(records: tuple[Record, ...]) -> tuple[MainsCollision, ...]:
    """Gives the dwells in which a harmonic falls on the mains: a hum there would pass for that harmonic.

    Args:
        records: The records.

    Returns:
        The dwells; where hum is seen, those on its line only.
    """
    seen = {line.frequency for record in records for line in hum_lines(record)}
    return tuple(
        MainsCollision(record.name, dwell, order, line)
        for record in records
        for dwell in record.dwells
        for line in sorted(seen or MAINS)
        if line < 0.45 * record.rate
        and (order := meeting_order(dwell.frequency, line, (dwell.stop - dwell.start) / record.rate))
        is not None
    )
