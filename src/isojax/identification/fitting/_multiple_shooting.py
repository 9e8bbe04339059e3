"""A start for records that are left whole: fits to windows of them, each longer than the last."""

import itertools

from ...models import Isolator
from ..jacobian import cut_evenly, segments_between
from ._estimate import Estimate, estimate
from ._search import Search
from ._simulator import Simulator

WINDOWS = (16, 4)
"""Windows a record, in the order in which they are fitted."""


def fit_by_multiple_shooting(
    fitted: Estimate, model: Isolator, places: tuple[int, ...], search: Search
) -> Isolator:
    """Fit a model to short windows of whole records, then to longer ones.

    A free run over a whole record sums up every error of the model, and where a law jumps the run goes
    another way at each reversal that it meets differently: the error has many least values, and a descent
    ends in the one beside its start. Windows that start from states of their own forget; what fits them all
    is near what fits the whole.

    Args:
        fitted: the estimate whose records count.
        model: the start.
        places: free coefficients, by their place in `list_parameters`.
        search: how to search.

    Returns:
        The model that the longest windows leave; the start where none could be simulated.

    Source: van Domselaar & Hemker 1975, Mathematisch Centrum report NW 18/75, and Bock 1983 (multiple
    shooting), without its matching of the pieces.
    """
    problem = fitted.problem
    for count in WINDOWS:
        pieces = (
            segments_between(place, record, cut_evenly(record.output.size, count))
            for place, record in enumerate(problem.records)
        )
        segments = tuple(itertools.chain.from_iterable(pieces))
        search.progress(f"a start from {count} windows a record")
        found = estimate(Simulator(problem._replace(segments=segments, heads=())), model, places, search)
        model = found.model if found.point.is_finite else model
    return model
