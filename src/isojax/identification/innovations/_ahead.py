"""Errors of a model that runs for a given time from where a filter has brought it."""

import numpy as np
from jaxtyping import Float

from ..._types import on_device
from ._filter import Trace
from ._record_filter import RecordFilter
from ._sizes import Way


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

    own = way._replace(traces=[let_go(one) for one in way.traces])
    counted = [np.isfinite(np.asarray(one.deviation)).sum(axis=0) for one in own.traces]
    squares = record_filter.squares(places, values[None], own)[0]
    return squares, record_filter.by_record(counted, 1)[0].astype(float)
