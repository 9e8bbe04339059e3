"""The settled end of a dwell, and its residual without the harmonics."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from .._record import Dwell, Record
from ._basis import drifting_harmonics, usable_orders

MOST_HARMONICS = 120
"""The harmonics of dry friction fall as 1/n, so the fortieth may still exceed the noise."""

_NOISE_CYCLES = 4.0
"""Cycles at the end of a dwell, a quarter of them and at least so many, that its noise is estimated from."""

_LONGEST_END = 0.7
"""Largest share of a dwell that this end may take: what is before it must have settled."""


class Rest(NamedTuple):
    """The residual of a dwell's end without its harmonics.

    Attributes:
        signal: Samples, in the output's unit.
        taken: Frequencies of the basis signals that were removed [Hz].
        removed: Share of the noise of each line that they took, from 0 to 1; line k of n samples lies at
            k rate/n.
    """

    signal: Float[np.ndarray, " time"]
    taken: Float[np.ndarray, " column"]
    removed: Float[np.ndarray, " line"]


def dwell_window(record: Record, dwell: Dwell) -> int | None:
    """Gives the samples of a dwell's settled end that its noise comes from; None if it is too short."""
    window = round(max(dwell.cycles / 4.0, _NOISE_CYCLES) * record.rate / dwell.frequency)
    return None if window > _LONGEST_END * (dwell.stop - dwell.start) else window


def dwell_rest(record: Record, dwell: Dwell, window: int, lines: tuple[float, ...] = ()) -> Rest:
    """Gives the end of a dwell without its harmonics up to 0.45 of the rate, at most 120.

    The cut-off of a declared filter is no limit: some harmonics exceed the noise well beyond it.

    Args:
        record: The record.
        dwell: One of its dwells.
        window: Samples of its end.
        lines: Of the mains, removed with them [Hz].

    Returns:
        The residual. Not to be written to.
    """
    orders = min(usable_orders(record.rate, dwell.frequency, MOST_HARMONICS), max(1, window // 8))

    def rest() -> Rest:
        design, inverse, taken = drifting_harmonics(window, record.rate, dwell.frequency, orders, lines)
        signal = record.output[dwell.stop - window : dwell.stop]
        lines_of_design = np.fft.rfft(design, axis=0)
        removed = np.sum((lines_of_design @ inverse) * lines_of_design.conj(), axis=1).real / window
        return Rest(signal - design @ (inverse @ (design.T @ signal)), taken, removed)

    # The bases of all dwells are too large for the processor's cache to compute them twice.
    return record.once(("dwell rest", dwell, window, orders, lines), rest)
