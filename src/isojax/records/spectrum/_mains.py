"""Hum of the mains on the output: its lines, and the dwells that hide it under a harmonic."""

import functools
from dataclasses import dataclass

import numpy as np
import scipy
from jaxtyping import Complex

from ..._show import shown
from .._record import Dwell, Record
from ._basis import USABLE_SHARE, meeting_order
from ._dwell_end import dwell_rest, dwell_window

MAINS = (50.0, 60.0)
"""Frequencies of public mains [Hz]."""

_NEIGHBOURS = np.array([-3.5, -2.5, -1.5, 1.5, 2.5, 3.5])
"""Distances from a line at which the noise is estimated, in lines of the window."""

_KEPT_OFF = 0.75
"""Lines of the window by which these frequencies must differ from the harmonics, which have been removed."""

_FALSE_ALARM = 1e-4
"""Chance that a record without hum shows one."""


@shown
@dataclass(frozen=True)
class HumLine:
    """A significant line of the mains in a record.

    Attributes:
        record: Name of the record.
        frequency: Of the line [Hz].
        amplitude: Its mean amplitude [SI unit of the output].
    """

    record: str
    frequency: float
    amplitude: float


@shown
@dataclass(frozen=True)
class MainsCollision:
    """A dwell with a harmonic that cannot be separated from the mains.

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


def hum_lines(record: Record) -> tuple[HumLine, ...]:
    """Gives the significant lines of the mains in a record's settled dwells, without their harmonics.

    In each dwell without a harmonic nearby, the power of the line is compared with the noise next to it.
    Without hum their ratio is F-distributed; a line counts if all ratios together have a chance below 1e-4.

    Args:
        record: The record.

    Returns:
        The lines; none without dwells, and none where every dwell has a harmonic there.
    """

    def significant() -> tuple[HumLine, ...]:
        lines = [_significant_line(record, line) for line in MAINS if line < USABLE_SHARE * record.rate]
        return tuple(one for one in lines if one is not None)

    # Noise, harmonics and health all ask for them.
    return record.once("hum lines", significant)


def _significant_line(record: Record, line: float) -> HumLine | None:
    """Gives a line if it is significantly above the noise."""
    powers, beside, squares = [], [], []
    for dwell in record.dwells:
        window = dwell_window(record, dwell)
        if window is None:
            continue
        resolution = record.rate / window
        sought = np.concatenate([[line], line + _NEIGHBOURS * resolution])
        off = np.abs(sought - dwell.frequency * np.round(sought / dwell.frequency))
        clear = (off >= _KEPT_OFF * resolution) & (sought < USABLE_SHARE * record.rate)
        if not clear[0] or not np.any(clear[1:]):
            continue
        rest = dwell_rest(record, dwell, window).signal
        power = np.abs(_tones(window, record.rate, tuple(sought[clear])) @ rest) ** 2
        # Per dwell, so that one that never settled does not hide the others.
        noise = float(np.mean(power[1:]))
        if noise > 0.0:
            powers.append(power[0] / noise)
            beside.append(power.size - 1)
            squares.append(4.0 * (power[0] - noise) / window**2)
    if not powers:
        return None
    # Each ratio is F(2, 2 k); on Fisher's scale their chances add up to a chi-square.
    chances = np.maximum(scipy.stats.f.sf(powers, 2, 2 * np.array(beside)), 1e-300)
    if not scipy.stats.chi2.sf(-2.0 * np.sum(np.log(chances)), 2 * chances.size) < _FALSE_ALARM:
        return None
    return HumLine(record.name, line, float(np.sqrt(max(np.mean(squares), 0.0))))


@functools.lru_cache(maxsize=128)
def _tones(window: int, rate: float, frequencies: tuple[float, ...]) -> Complex[np.ndarray, "line time"]:
    """Gives a rotating phasor for each frequency; the records of a campaign share them."""
    time = np.arange(window) / rate
    return np.exp(-2j * np.pi * np.array(frequencies)[:, None] * time)


def mains_collisions(records: tuple[Record, ...]) -> tuple[MainsCollision, ...]:
    """Gives the dwells in which a harmonic falls on the mains, where hum looks like that harmonic.

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
        if line < USABLE_SHARE * record.rate
        and (order := meeting_order(dwell.frequency, line, (dwell.stop - dwell.start) / record.rate))
        is not None
    )
