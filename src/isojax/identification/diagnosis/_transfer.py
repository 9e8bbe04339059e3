"""Whether a finding carries over: refit on a part of the data, predict the rest."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy import stats

from ..._results import RESULTS
from .._rules import Rules
from ..fitting import Estimate, Problem, Search, Simulator, Spread, best_nuisances, estimate, one_hot
from ._refit import rough

UNKNOWN = 1e-12
"""Share of its information below which a combination of coefficients counts as unknown."""


def _split(fitted: Estimate, extended: Estimate, rules: Rules) -> tuple[Problem, Problem]:
    """Leave out the records of the highest level but one; without an inner level every other segment.

    Two levels are not separated: a law fitted to the lower alone says little of the upper. Nor is a level
    left out at which the effect is not significant, unless its records are whole segments (releases): every
    other one of those would leave out the highest.
    """
    problem = extended.problem
    levels = sorted({record.level for record in problem.records if record.level is not None})
    out = set()
    if inner := levels[1:-1]:
        out = {place for place, record in enumerate(problem.records) if record.level == inner[-1]}
        gains = _misfit_by_record(fitted) - _misfit_by_record(extended)
        gain = gains[list(out)].sum() / extended.inflation
        extra = max(1, len(extended.places) - len(fitted.places))
        separated = len(problem.segments) > len(problem.records)
        if separated and not stats.chi2.sf(gain, extra) < rules.significance:
            out = set()
    if out:
        seen = tuple(part for part in problem.segments if part.record not in out)
        unseen = tuple(part for part in problem.segments if part.record in out)
    elif len(problem.segments[1::2]) > 1:
        seen, unseen = problem.segments[::2], problem.segments[1::2]
    else:
        seen = unseen = ()
        for part in problem.segments:
            middle = (part.counted + part.stop) // 2
            seen += (part._replace(stop=middle),)
            unseen += (part._replace(start=middle, counted=middle),)
    return problem._replace(segments=seen, heads=()), problem._replace(segments=unseen, heads=())


def _misfit_by_record(found: Estimate) -> Float[np.ndarray, " record"]:
    """Give chi2 of each record, with what its nuisances took."""
    return found.point.reduced.by_record[:, -1, -1] + found.point.reduced.eliminated


class _Prediction(NamedTuple):
    """Data that a refit did not see, with the refit's parameter uncertainty.

    With r the whitened error, J its slopes and C the covariance of the coefficients:

    Attributes:
        excess: chi2 - dof, chi2 being `r' (I + J C J')^-1 r = r'r - r'J (C^-1 + J'J)^-1 J'r`.
        volume: `log det(I + J C J')`: what the model might have predicted instead.
    """

    excess: float
    volume: float


def _predict(part: Estimate, unseen: Problem, spread: Spread) -> _Prediction:
    """Predict data that a refit did not see; NaN where the motion diverges."""
    simulator = Simulator(unseen)
    known = part.point.reduced.matrix[:-1, :-1]
    sizes = 1.0 / np.sqrt(np.maximum(np.diag(known), 1e-300))
    nuisances = best_nuisances(simulator, part.model, spread, places=part.places).nuisances
    point = simulator.evaluate(part.model, one_hot(part.model, part.places, list(sizes)), nuisances)
    matrix = point.reduced.matrix
    slopes, error = matrix[:-1, :-1], matrix[:-1, -1]
    if not np.all(np.isfinite(matrix)):
        return _Prediction(float("nan"), float("nan"))
    # The diagonal of the known information is one in these units; its rounding alone keeps the rest apart.
    before = known * np.outer(sizes, sizes) + UNKNOWN * np.eye(len(sizes))
    step = np.linalg.solve(before + slopes, error)
    volume = np.linalg.slogdet(before + slopes)[1] - np.linalg.slogdet(before)[1]
    return _Prediction(float(matrix[-1, -1] - error @ step - point.free_samples), float(volume))


def transferred_share(fitted: Estimate, extended: Estimate, search: Search) -> float:
    """Give the share of the excess that an effect removes on data its refit did not see.

    Both models, without and with the effect, are refitted without a part of the data (a level, or half) and
    predict that part. The prediction includes the refit's parameter uncertainty.

    Args:
        fitted: the estimate without the effect.
        extended: the estimate with it.
        search: how to search.

    Returns:
        1 - (excess with the effect)/(excess without it) on the unseen part; 0 where that part is no more
        probable with the effect than without it or a refit diverges on the part that it sees, 1 where only
        the motion without it diverges on the unseen part.

    Source: Gelman, Hwang & Vehtari 2014, Stat. Comput. 24:997 (log predictive density of unseen data).
    """
    seen, unseen = _split(fitted, extended, search.rules)
    predictions, quick = [], rough(search, fitted)
    for found in (fitted, extended):
        search.progress("carry-over: refit on a part of the data")
        nuisances = found.point.nuisances
        simulator = Simulator(seen)
        part = estimate(simulator, found.model, found.places, quick, nuisances.afresh())
        if part.result == RESULTS.not_finite:
            return 0.0
        predictions.append(_predict(part, unseen, nuisances.spread))
    without, with_effect = predictions
    if not np.isfinite(with_effect.excess):
        return 0.0
    # Without the effect its coefficients, bent to make up for it, may let the motion diverge elsewhere.
    if not np.isfinite(without.excess):
        return 1.0
    inflation = extended.inflation
    gained = (without.excess - with_effect.excess) / inflation + without.volume - with_effect.volume
    return float(1.0 - with_effect.excess / max(without.excess, 1.0)) if gained > 0.0 else 0.0
