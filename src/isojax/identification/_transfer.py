"""Whether a finding carries over: refit on a part of the data, predict the rest."""

from collections.abc import Callable
from typing import Any

import numpy as np

from .._results import RESULTS
from ..elements import Scales
from ._errors import restart_records
from ._estimate import Estimate, estimate
from ._fit import Fit
from ._problem import Bench, Problem


def _split(problem: Problem) -> tuple[Problem, Problem]:
    """Leave out the records of the highest level but one; without levels the second half of the segments."""
    levels = sorted({record.level for record in problem.records if record.level is not None})
    if len(levels) >= 3:
        out = {place for place, record in enumerate(problem.records) if record.level == levels[-2]}
        seen = tuple(part for part in problem.segments if part.record not in out)
        unseen = tuple(part for part in problem.segments if part.record in out)
    elif len(problem.segments) >= 4:
        half = len(problem.segments) // 2
        seen, unseen = problem.segments[:half], problem.segments[half:]
    else:
        seen = unseen = ()
        for part in problem.segments:
            middle = (part.start + part.stop) // 2
            seen += (part._replace(stop=middle),)
            unseen += (part._replace(start=middle, counted=max(middle, part.counted)),)
    return problem._replace(segments=seen, heads=()), problem._replace(segments=unseen, heads=())


def transferred_share(
    fit: Fit, extended: Estimate, scales: Scales, solver: Any, progress: Callable[[str], None]
) -> float:
    """Give the share of the excess that an effect removes on data its refit did not see.

    Both models, without and with the effect, are refitted without a part of the data (a level, or half) and
    held against that part; no coefficient is touched there.

    Args:
        fit: the fit without the effect.
        extended: the estimate with it.
        scales: magnitudes of the records.
        solver: an optimistix least-squares solver.
        progress: told a line a step.

    Returns:
        1 - (excess with the effect)/(excess without it) on the unseen part; not positive where it does not
        carry over.
    """
    seen, unseen = _split(extended.bench.problem)
    excess = []
    for found in (fit.estimate, extended):
        progress("carry-over: refit on a part of the data")
        nuisances = found.point.nuisances
        start = nuisances._replace(states=np.zeros((0, 0)))
        part = estimate(
            Bench(seen),
            found.model,
            found.places,
            scales,
            nuisances=start,
            solver=solver,
            max_steps=15,
            progress=progress,
        )
        if part.result == RESULTS.not_finite:
            return 0.0
        point = restart_records(Bench(unseen), part.model, nuisances.stiffness_spread).point
        excess.append(point.chi2 - point.free_samples)
    if not np.isfinite(excess[1]):
        return 0.0
    return float(1.0 - excess[1] / max(excess[0], 1.0)) if excess[1] < excess[0] else 0.0
