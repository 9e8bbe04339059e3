"""A model fitted to records, with as many integration steps as its motion needs."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from ..._results import is_successful
from ...models import Isolator
from ._error_fit import MOST_SCORINGS, ErrorFit, first_sizes, fit_errors
from ._measured import Measured
from ._record_filter import RecordFilter, Sizes

LEAST_SUBSTEPS = 2
MOST_SUBSTEPS = 16
"""Integration steps a sample: at least, and at most."""

SMALL = 0.1
SMALL_SHARE = 3e-5
"""Change of the deviance by twice as many steps below which their error does not matter: and a sample."""


def fit_measured(
    model: Isolator,
    places: tuple[int, ...],
    magnitudes: Sequence[float],
    measured: Measured,
    sizes: Sizes | None = None,
    starts: Sequence[Float[np.ndarray, " column"]] = (),
    most_steps: int = MOST_SCORINGS,
) -> ErrorFit:
    """Fit a model to records, with more integration steps where the motion diverges.

    Args:
        model: start.
        places: coefficients to fit.
        magnitudes: of each.
        measured: the records.
        sizes: of the errors to start from; large if omitted.
        starts: other values of the coefficients, of which the best is taken.
        most_steps: of the search, at most.

    Returns:
        The fit.
    """
    steps = LEAST_SUBSTEPS
    while True:
        record_filter = RecordFilter(model, measured, steps)
        first = first_sizes(record_filter) if sizes is None else sizes
        first = first._replace(noise=np.minimum(first.noise, measured.loudest))
        found = fit_errors(
            record_filter,
            places,
            magnitudes,
            first,
            loudest=measured.loudest,
            starts=starts,
            most_steps=most_steps,
        )
        if np.isfinite(found.deviance.sum()) or steps >= MOST_SUBSTEPS:
            return found
        steps = MOST_SUBSTEPS


def refined(found: ErrorFit, magnitudes: Sequence[float]) -> ErrorFit:
    """Fit to the end, with twice as many integration steps until these leave the innovations as they are.

    Args:
        found: a fit.
        magnitudes: of its coefficients.

    Returns:
        The fit; that of the most steps where none suffice.
    """
    measured = found.filter.measured
    if not is_successful(found.result):
        found = fit_errors(
            found.filter,
            found.places,
            magnitudes,
            found.sizes,
            loudest=measured.loudest,
            starts=(found.values,),
        )
    while not steps_are_fine(found):
        steps = 2 * found.filter.steps
        if steps > MOST_SUBSTEPS:
            return found
        finer = RecordFilter(found.model, measured, steps)
        finer.spread = found.filter.spread
        again = fit_errors(finer, found.places, magnitudes, found.sizes, loudest=measured.loudest)
        if not np.isfinite(again.deviance.sum()):
            return found
        found = again
    return found


def steps_are_fine(found: ErrorFit) -> bool:
    """Say whether twice as many integration steps leave the innovations as they are.

    Args:
        found: a fit.

    Returns:
        Whether that is so.
    """
    finer = RecordFilter(found.model, found.filter.measured, 2 * found.filter.steps)
    finer.starts, finer.spread = found.filter.starts, found.filter.spread
    squares = finer.products(found.places, found.values[None], found.way, columns=False)[0, 0, 0]
    change = float(np.sum(np.abs(squares - found.products[-1, -1])))
    return change < max(SMALL, SMALL_SHARE * found.samples)
