"""A model fitted to records, with as many integration steps as its motion needs."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from ..._results import is_successful
from ...models import Isolator
from ._error_fit import ErrorFit
from ._fit_errors import first_sizes, fit_errors, simulation_sizes
from ._measured import Measured
from ._record_filter import COPIES, RecordFilter
from ._sizes import Sizes

SUBSTEPS = (2, 8, 16)
"""Integration steps a sample that are tried in turn; the most at once where a filter diverges."""

MOST_SEARCHES = 3
"""Searches of full length that end a rough one: large records creep along a valley."""

SMALL = 0.1
SMALL_SHARE = 3e-5
"""Change of the deviance by twice as many steps below which their error does not matter: and a sample."""

SMALL_MOVE = 0.01
"""Squared step of the coefficients over their errors that does not matter."""

ROUGH_SHARE = 1e-3
"""The same a sample where a fit is only ranked."""


def fit_measured(
    model: Isolator,
    places: tuple[int, ...],
    magnitudes: Sequence[float],
    measured: Measured,
    sizes: Sizes | None = None,
    starts: Sequence[Float[np.ndarray, " column"]] = (),
    steps: int = SUBSTEPS[0],
    rough: bool = False,
    rival: float = np.inf,
) -> ErrorFit:
    """Fit a model to records, with as many integration steps as show which law it is.

    A law that bends within a sample is another law where the steps are coarse, unless they are split there.

    Args:
        model: start.
        places: coefficients to fit.
        magnitudes: of each.
        measured: the records.
        sizes: of the errors to start from; large if omitted.
        starts: other values of the coefficients, of which the best is taken.
        steps: integration steps a sample to begin with.
        rough: whether the fit is only ranked among others.
        rival: criterion of the best of the others; what stays behind it needs no finer steps and no long
            search.

    Returns:
        The fit; that of the most steps where none suffice.
    """
    while True:
        record_filter = RecordFilter(model, measured, steps)
        found = fit_errors(
            record_filter,
            places,
            magnitudes,
            first_sizes(record_filter) if sizes is None else sizes,
            loudest=measured.loudest,
            starts=starts,
            rough=rough,
            rival=rival,
        )
        if model.splits and not found.is_noise_of_output:
            found = min(
                (found, _simulated(found, magnitudes, starts, rough)), key=lambda one: float(one.criterion)
            )
        finer = [one for one in SUBSTEPS if one > steps]
        if not finer:
            return found
        if not np.isfinite(found.deviance.sum()):
            steps = finer[-1]
            continue
        if model.splits or steps_are_fine(found, ROUGH_SHARE, rival):
            return found
        steps, starts = finer[0], (found.values, *starts[: COPIES - 2])
        if is_successful(found.result):
            sizes = found.sizes


def refined(found: ErrorFit, magnitudes: Sequence[float]) -> ErrorFit:
    """Fit to the end, with twice as many integration steps until these leave the innovations as they are.

    Readings beside the jumps of dry friction hardly ever are; there, until they make the records no more
    probable.

    Args:
        found: a fit.
        magnitudes: of its coefficients.

    Returns:
        The fit; that of the most steps where none suffice.
    """
    while True:
        for _ in range(MOST_SEARCHES):
            if is_successful(found.result):
                break
            found = _onward(found, magnitudes)
        steps = 2 * found.filter.steps
        if steps > SUBSTEPS[-1] or steps_are_fine(found):
            return found
        again = _onward(found, magnitudes, found.filter.with_steps(steps, found.model))
        gain = float(found.deviance.sum() - again.deviance.sum())
        if not (np.isfinite(gain) and (gain > SMALL or not found.model.slides)):
            return found
        found = again


def _simulated(
    found: ErrorFit,
    magnitudes: Sequence[float],
    starts: Sequence[Float[np.ndarray, " column"]],
    rough: bool,
) -> ErrorFit:
    """Fit once more, from a filter on that all but simulates, whose noise is whatever the model leaves.

    Where a law jumps a filter that trusts the records learns little of it; a simulation finds the jumps.
    """
    old, measured = found.filter, found.filter.measured
    begun = fit_errors(
        RecordFilter(old.model, measured, old.steps),
        found.places,
        magnitudes,
        simulation_sizes(old),
        loudest=np.full_like(measured.loudest, np.inf),
        starts=(*starts[: COPIES - 2], found.values),
        rough=True,
    )
    if not begun.criterion < found.criterion:
        return found
    return _onward(begun, magnitudes, rough=rough)


def _onward(
    found: ErrorFit, magnitudes: Sequence[float], over: RecordFilter | None = None, rough: bool = False
) -> ErrorFit:
    """Search on from where a fit ended, its noise no louder than the records show."""
    return fit_errors(
        found.filter if over is None else over,
        found.places,
        magnitudes,
        found.sizes,
        loudest=found.filter.measured.loudest,
        starts=(found.values,),
        rough=rough,
    )


def steps_are_fine(found: ErrorFit, share: float = SMALL_SHARE, rival: float = np.inf) -> bool:
    """Say whether twice as many integration steps leave the coefficients where they are.

    Where the error is noise, the likelihood decides, and must stay as well.

    Args:
        found: a fit.
        share: change of the deviance a sample that does not matter.
        rival: criterion of another fit; nothing matters that leaves this one behind it.

    Returns:
        Whether that is so.
    """
    finer = found.filter.with_steps(2 * found.filter.steps, found.model)
    products, _ = finer.of_coefficients(finer.slopes(found.places, found.values, found.way))
    change = (products - found.products).sum(axis=-1)[:, -1]
    moved = float(change[:-1] @ found.covariance @ change[:-1])
    risen = abs(float(change[-1]))
    if found.criterion - risen > rival:
        return True
    return moved < SMALL_MOVE and (not found.is_noise or risen < max(SMALL, share * found.samples))
