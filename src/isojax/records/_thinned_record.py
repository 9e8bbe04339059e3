"""A record with fewer samples: filtered without phase, then every n-th sample."""

import dataclasses

import numpy as np
import scipy
from jaxtyping import Float

from ._record import Dwell, Record

_HALF_WIDTH = 1
"""New samples on either side that a filtered sample depends on: those at the ends are left out."""


def thin_record(record: Record, factor: int) -> Record:
    """Give a record at a lower rate.

    Drive, output and floor pass the same filter, so that the output still answers the drive where both lie
    below half the new rate.

    Args:
        record: the record.
        factor: samples that become one.

    Returns:
        The record, shorter at either end by what the filter cannot know; kept beside the one it was made of.
    """
    return record if factor == 1 else record.once(("thinned", factor), lambda: _thinned(record, factor))


def thinned_share(factor: int) -> float:
    """Give the share of white noise that the filter leaves, of all that lies below half the new rate.

    Args:
        factor: samples that become one.

    Returns:
        Variance after the filter, over the variance of as many samples of noise of the same density.
    """
    taps = _taps(factor)
    return float(factor * np.sum(taps**2))


def thinned_place(place: int, factor: int) -> int:
    """Give the first sample of a thinned record that does not lie before a sample of the record.

    Args:
        place: of the sample in the record.
        factor: samples that become one.

    Returns:
        Place in the thinned record; 0 for those that it lost.
    """
    return max(0, -(-(place - _HALF_WIDTH * factor) // factor))


def _taps(factor: int) -> Float[np.ndarray, " tap"]:
    """Give the filter: of a jump it leaves what simulated readings have of one, and nothing further away.

    `models.find_ringing` puts a jump into the samples next to it by a parabola. Its slope is `1.3 - 1.6 |u|`
    within a new sample u on either side. A sharper filter would ring where models do not, and dry friction
    would pass for another law. A sine of 36 samples a cycle loses 0.1 %, its third harmonic 0.9 %.
    """
    place = np.abs(np.arange(-factor, factor + 1)) / factor
    taps = 1.3 - 1.6 * place
    taps[[0, -1]] *= 0.5
    return taps / taps.sum()


def _thinned(record: Record, factor: int) -> Record:
    taps, lost = _taps(factor), _HALF_WIDTH * factor

    def filtered(values: Float[np.ndarray, " time"]) -> Float[np.ndarray, " fewer"]:
        # Of whole overlaps only: nothing is assumed beyond the ends.
        return scipy.signal.upfirdn(taps, values, down=factor)[2 * _HALF_WIDTH : -2 * _HALF_WIDTH]

    count = filtered(record.input).size
    dwells = tuple(
        Dwell(
            start, stop, dwell.frequency, dwell.cycles * (stop - start) * factor / (dwell.stop - dwell.start)
        )
        for dwell in record.dwells
        if (start := thinned_place(dwell.start, factor))
        < (stop := min(thinned_place(dwell.stop, factor), count))
    )
    return dataclasses.replace(
        record,
        time=np.arange(count) * factor / record.rate,
        rate=record.rate / factor,
        input=filtered(record.input),
        output=filtered(record.output),
        raw_input=filtered(record.raw_input),
        raw_output=filtered(record.raw_output),
        period=None if record.period is None or record.period % factor else record.period // factor,
        settle=thinned_place(record.settle, factor),
        dwells=dwells,
        start=(record.start + lost) // factor,
        floor=None if record.floor is None else filtered(record.floor),
    )
