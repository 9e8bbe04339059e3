"""Errors of a model that runs for a given time from where a filter has brought it."""

import numpy as np
from jaxtyping import Float

from ..._types import on_device
from ._filter import Trace
from ._record_filter import RecordFilter
from ._sizes import Way

_MOST_STARTS = 4
"""Steps of Gauss and Newton towards the first states of free runs."""

_START_DAMPING = 1e-3
"""Marquardt's damping of these."""

_MUCH_BETTER = 0.01
"""Share of the squares that such a step must save."""


def squares_ahead(
    record_filter: RecordFilter,
    places: tuple[int, ...],
    values: Float[np.ndarray, " column"],
    way: Way,
    ahead: int | None = None,
    fed: int = 0,
) -> tuple[Float[np.ndarray, " record"], Float[np.ndarray, " record"]]:
    """Give the squared error of predictions, by the filter with its gains held and let go in turn.

    Args:
        record_filter: the model and the records.
        places: parameters that are given.
        values: their values.
        way: the filter along the records.
        ahead: samples for which the model runs with nothing fed back; from start to end if omitted.
        fed: samples in between over which the filter follows the record again.

    Returns:
        Sum of squared errors of each record [squared SI unit of the output], and how many there are.
    """
    own = _let_go(way, ahead, fed)
    counted = [np.isfinite(np.asarray(one.deviation)).sum(axis=0) for one in own.traces]
    squares = record_filter.squares(places, values[None], own)[0]
    return squares, record_filter.by_record(counted, 1)[0].astype(float)


def free_squares(
    record_filter: RecordFilter,
    places: tuple[int, ...],
    values: Float[np.ndarray, " column"],
    way: Way,
) -> Float[np.ndarray, " record"]:
    """Give the squared error of each record, simulated with nothing fed back from its best first state.

    A filter forgets its first state, and knows it badly where its random force is large; a simulation of a
    lightly damped isolator remembers it for many cycles.

    Args:
        record_filter: the model and the records.
        places: parameters that are given.
        values: their values.
        way: the filter along the records.

    Returns:
        Sums of squares [squared SI unit of the output]; not finite where a motion diverged.
    """
    own, free = record_filter.with_own_starts(), _let_go(way)
    squares, counts = squares_ahead(own, places, values, way)
    for _ in range(_MOST_STARTS):
        variance = np.where(np.isfinite(squares), squares, 1.0) / np.maximum(counts, 1.0)
        products = own.slopes(places, values, free) / np.maximum(variance, 1e-300)
        first = own.eliminate(products, np.full(own.count, _START_DAMPING))
        begins = own.starts + first.settled
        tried = own.squares(places, values[None], free, begins[None])[0]
        better = tried < (1.0 - _MUCH_BETTER) * squares
        if not np.any(better):
            break
        own.begin(begins, own.spread, better)
        squares = np.where(better, tried, squares)
    return squares


def _let_go(way: Way, ahead: int | None = None, fed: int = 0) -> Way:
    """Give a way whose gains are zero while predictions run; no other samples count."""

    def let_go(trace: Trace) -> Trace:
        counted = np.isfinite(np.asarray(trace.deviation))
        runs = np.full((len(counted), 1), True)
        if ahead is not None:
            time, both = np.arange(len(counted))[:, None], fed + ahead
            runs = time % both >= fed
            ends = len(counted) - np.argmax(counted[::-1], axis=0)
            counted = counted & ((time // both + 1) * both <= ends)  # of whole predictions
        return trace._replace(
            gains=tuple(on_device(np.where(runs, 0.0, np.asarray(gain))) for gain in trace.gains),
            deviation=on_device(np.where(counted & runs, 1.0, np.inf)),
        )

    return way._replace(traces=[let_go(one) for one in way.traces])
