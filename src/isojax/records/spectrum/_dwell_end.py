"""The settled end of a dwell, and what its harmonics leave of it."""

from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from jaxtyping import Float

from .._record import Dwell, Record
from ._basis import drifting_harmonics

MOST_HARMONICS = 120
"""Those of dry friction fall as 1/n: the fortieth may still stand above the noise."""


class Rest(NamedTuple):
    """What the harmonics leave of a dwell's end.

    Attributes:
        signal: Samples, in the output's unit.
        taken: Frequencies of the columns that were taken out [Hz].
    """

    signal: Float[np.ndarray, " time"]
    taken: Float[np.ndarray, " column"]


def dwell_window(record: Record, dwell: Dwell) -> int | None:
    """Gives the samples of a dwell's settled end that its noise is taken from; None if it is too short."""
    window = round(max(dwell.cycles / 4.0, 4.0) * record.rate / dwell.frequency)
    return None if window > 0.7 * (dwell.stop - dwell.start) else window


_KNOWN: WeakKeyDictionary[Record, dict[tuple, Rest]] = WeakKeyDictionary()
"""The columns of all dwells outgrow a cache of the processor: what is asked again is not worked out again."""


def dwell_rest(record: Record, dwell: Dwell, window: int, lines: tuple[float, ...] = ()) -> Rest:
    """Gives what the harmonics up to 0.45 of the rate, at most 120, leave of the end of a dwell.

    A declared filter ends nothing: its cut-off is where the harmonics begin to fall, and some stand above the
    noise well beyond it.

    Args:
        record: The record.
        dwell: One of its dwells.
        window: Samples of its end.
        lines: Of the mains, taken out with them [Hz].

    Returns:
        The rest. Not to be written to.
    """
    orders = min(MOST_HARMONICS, int(0.45 * record.rate / dwell.frequency), max(1, window // 8))
    known = _KNOWN.setdefault(record, {})
    key = dwell.start, dwell.stop, dwell.frequency, window, orders, lines
    if key not in known:
        design, inverse, taken = drifting_harmonics(window, record.rate, dwell.frequency, orders, lines)
        signal = record.output[dwell.stop - window : dwell.stop]
        known[key] = Rest(signal - design @ (inverse @ (design.T @ signal)), taken)
    return known[key]
