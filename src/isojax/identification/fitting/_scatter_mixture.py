"""Error bars and scores that allow for the scatter of the stiffness being known from few records only."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.linalg import block_diag
from scipy.special import ndtr

from ...models import CONFIDENCE, HALF_WIDTH, NormalMixture, half_width
from ..jacobian import STIFFNESS_SCALE_UNIT
from ._covariance import Determined, Uncertainty, find_determined, invert_information, unknown
from ._elimination import Nuisances, Reduced

SCATTER_PRIOR = 1e-3
"""Scale of the half-Cauchy prior of the scatter of the linear stiffness between records [relative].

Half of its weight lies below; its tail falls so slowly that records which show more are believed.
"""

_SCATTERS = np.geomspace(1e-6, 0.3, 64)
"""Scatters over which is summed [relative]; each is a fifth larger than the last, far less than n records
can tell apart."""

_ROOT_BISECTIONS = 40

_DEVIATIONS = 9
"""Deviations of the stiffness of a planned record over which is averaged."""

_PART, _LEAST_TAIL = 0.25, 1e-4
"""Share of what larger scatters weigh that scatters taken together as one part of a law hold; and the weight
of the largest ones below which they are one part."""


class _Records(NamedTuple):
    """Normal equations of each record with its stiffness scale still in them, noise scaled to one.

    Attributes:
        left: coefficients and residual, before the scale took its share.
        row: of the scale against these.
        own: information on the scale itself.
        deviation: where the scale stands [units of `STIFFNESS_SCALE_UNIT`].
    """

    left: Float[np.ndarray, "record column column"]
    row: Float[np.ndarray, "record column"]
    own: Float[np.ndarray, " record"]
    deviation: Float[np.ndarray, " record"]


class _Mixture(NamedTuple):
    """What each scatter would make of the coefficients, along the directions that are determined.

    Attributes:
        weight: of each scatter, given the data; they add up to one.
        step: to the best coefficients.
        covariance: of the coefficients.
    """

    weight: Float[np.ndarray, " scatter"]
    step: Float[np.ndarray, "scatter direction"]
    covariance: Float[np.ndarray, "scatter direction direction"]


def integrate_scatter(reduced: Reduced, nuisances: Nuisances, inflation: float) -> Uncertainty:
    """Give the uncertainty of the coefficients over all scatters that the records allow.

    With t the scatter, the posterior of the coefficients is `sum w(t) N(b(t), C(t))`, where `w(t)` is the
    restricted likelihood of t times its half-Cauchy prior, and b and C are the generalised least squares of
    the linearised records. The standard error is the half-width about the fitted value that holds 95 % of it,
    over 1.96, so that value +- 1.96 standard errors is the interval of the mixture. The correlation is that
    of its second moments about the fitted values. The mixture goes along for other confidences, for which its
    tails are longer than those of a normal law.

    The fitted values stay those at the fit's own scatter. Their mean over all scatters would be at most
    2 % better (rms, two records), and no longer the least squares of anything.

    Args:
        reduced: equations at the solution, of several records with a stiffness scale each.
        nuisances: that the equations are about.
        inflation: factor on the squared noise: max(1, chi2/dof).

    Returns:
        The uncertainty. What the data do not determine is judged at the fit's own scatter.

    Source: Patterson & Thompson 1971, Biometrika 58:545 (restricted likelihood); Gelman 2006, Bayesian
    Analysis 1:515 (half-Cauchy prior).
    """
    matrix = reduced.matrix[:-1, :-1]
    if not np.all(np.isfinite(matrix)):
        return unknown(matrix.shape[0])
    known = find_determined(matrix)
    records = _with_scales(reduced, nuisances, known.vectors / known.size[:, None], inflation)
    found = _uncertainty(known, records, nuisances.spread.records)
    # Where a search went far astray, rounding leaves nothing of what the records say of their scales.
    return invert_information(matrix, inflation) if found is None else found


def scatter_of_next(reduced: Reduced, nuisances: Nuisances, inflation: float) -> float:
    """Give by how much the linear stiffness of a further record may deviate from the mean over records.

    Args:
        reduced: equations at the solution, of several records with a stiffness scale each.
        nuisances: that the equations are about.
        inflation: factor on the squared noise: max(1, chi2/dof).

    Returns:
        The half-width that holds 95 % over all scatters which the records allow, over 1.96 [relative]; NaN
        where the equations are singular.
    """
    matrix = reduced.matrix[:-1, :-1]
    if not np.all(np.isfinite(matrix)):
        return float("nan")
    known = find_determined(matrix)
    try:
        weight = _at(
            _with_scales(reduced, nuisances, known.vectors / known.size[:, None], inflation), _SCATTERS
        ).weight
    except np.linalg.LinAlgError:
        return float("nan")
    return float(half_width(weight, np.zeros_like(_SCATTERS), _SCATTERS, CONFIDENCE)) / HALF_WIDTH


class ScatteredScores(NamedTuple):
    """Scores of absent effects at each scatter of the stiffness; noise scaled to one.

    Attributes:
        weight: of each scatter, given the data and each effect by itself; they add up to one.
        information: g' g, with g the trace of an effect that the coefficients leave.
        score: g' r, with r the whitened residual.
    """

    weight: Float[np.ndarray, "scatter effect"]
    information: Float[np.ndarray, "scatter effect effect"]
    score: Float[np.ndarray, "scatter effect"]

    def errors(self, strength: Float[np.ndarray, " effect"]) -> Float[np.ndarray, " effect"]:
        """Give the standard errors of strengths, as `integrate_scatter` gives those of coefficients.

        Args:
            strength: of each effect by one linear step.

        Returns:
            The half-width about it that holds 95 %, over 1.96; infinite for effects without a trace.
        """
        own = np.diagonal(self.information, axis1=1, axis2=2)
        shows = np.all(own > 0.0, axis=0)
        safe = np.where(shows, own, 1.0)
        width = half_width(self.weight.T, (self.score / safe - strength).T, 1.0 / np.sqrt(safe).T, CONFIDENCE)
        return np.where(shows, width / HALF_WIDTH, np.inf)


def scores_over_scatters(
    reduced: Reduced, nuisances: Nuisances, inflation: float, coefficients: int
) -> ScatteredScores | None:
    """Give the scores of absent effects at all scatters that the records allow.

    What the records allow is judged beside the effect itself, as a t test takes the variance that is left:
    without it a stiffness that follows the pressure would pass for scatter.

    Args:
        reduced: equations at the solution: of the fitted coefficients, then of the effects.
        nuisances: that the equations are about.
        inflation: factor on the squared noise: max(1, chi2/dof).
        coefficients: how many columns are fitted.

    Returns:
        The scores; None where the equations of the coefficients are singular at some scatter.
    """
    matrix = reduced.matrix
    if not np.all(np.isfinite(matrix)):
        return None
    known = find_determined(matrix[:coefficients, :coefficients])
    absent = matrix.shape[0] - 1 - coefficients
    basis = np.asarray(block_diag(known.vectors / known.size[:, None], np.eye(absent)))
    whole, logarithm = _scattered(_with_scales(reduced, nuisances, basis, inflation), _SCATTERS)
    count = known.vectors.shape[1]
    base, cross = whole[:, :count, :count], whole[:, :count, count:]
    try:
        left = whole[:, count:, count:] - np.swapaxes(cross, 1, 2) @ np.linalg.solve(base, cross)
    except np.linalg.LinAlgError:
        return None
    logarithm = logarithm - 0.5 * (left[:, -1, -1] + np.linalg.slogdet(base)[1])
    information, score = left[:, :-1, :-1], left[:, :-1, -1]
    own = np.maximum(np.diagonal(information, axis1=1, axis2=2), 1e-300)
    beside = logarithm[:, None] + 0.5 * (score**2 / own - np.log(own))
    return ScatteredScores(_weights(beside), information, score)


def _weights(logarithm: Float[np.ndarray, "scatter ..."]) -> Float[np.ndarray, "scatter ..."]:
    """Give weights that add up to one from their logarithms."""
    weight = np.exp(logarithm - logarithm.max(axis=0))
    return weight / weight.sum(axis=0)


def expect_uncertainty(
    reduced: Reduced, nuisances: Nuisances, planned: Reduced, repeats: float, inflation: float
) -> Uncertainty:
    """Give the uncertainty that the coefficients will have once a planned record is fitted beside the others.

    What the record will show of its own stiffness is not known. The covariance is the mean over what it may
    show, which the present records predict: a scatter drawn from its posterior, and a deviation drawn from
    that. The coefficients will be those of the scatter that all records then show, not of the present one,
    which few records may show by chance. Noise changes no covariance of the linearised records.

    Args:
        reduced: equations of the present records at the solution.
        nuisances: that they are about.
        planned: equations of the planned record alone, about the same coefficients and priors; its residual
            is not looked at.
        repeats: how often the record repeats what was simulated.
        inflation: factor on the squared noise: max(1, chi2/dof).

    Returns:
        The expected uncertainty, which holds the scatter as that of a fit does.
    """
    whole = reduced.matrix[:-1, :-1] + repeats * planned.matrix[:-1, :-1]
    if not np.all(np.isfinite(whole)):
        return unknown(whole.shape[0])
    if not np.any(planned.stiffness_variance):
        return invert_information(whole, inflation)
    known = find_determined(whole)
    basis = known.vectors / known.size[:, None]
    records = _with_scales(reduced, nuisances, basis, inflation)
    alone = Nuisances(nuisances.states, np.zeros(1), nuisances.segments, nuisances.spread)
    further = _with_scales(planned, alone, basis, inflation / repeats)
    shown = _deviations(_at(records, _SCATTERS).weight, len(records.own)) / STIFFNESS_SCALE_UNIT
    covariance = np.zeros_like(whole)
    for deviation in shown:
        expected = _uncertainty(known, _together(records, _as_shown(further, deviation)), None)
        if expected is None:
            return invert_information(whole, inflation)
        covariance += expected.covariance / shown.size
    return known.uncertainty(covariance * np.outer(known.size, known.size))


def _deviations(weight: Float[np.ndarray, " scatter"], count: int) -> Float[np.ndarray, " deviation"]:
    """Give evenly likely deviations of a further record's stiffness from the mean of `count` others."""
    level = (np.arange(_DEVIATIONS) + 0.5) / _DEVIATIONS
    error = _SCATTERS[:, None] * np.sqrt(1.0 + 1.0 / count)
    high = np.full(level.size, 10.0 * _SCATTERS[-1])
    low = -high
    for _ in range(_ROOT_BISECTIONS):
        middle = 0.5 * (low + high)
        below = weight @ ndtr(middle / error) < level
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return high


def _as_shown(record: _Records, deviation: float) -> _Records:
    """Give the equations of a record without noise whose stiffness deviates so much, and so does the scale.

    The scale stands where the record is, so that nothing of it is left in the residual.
    """
    left, row = record.left.copy(), record.row.copy()
    left[:, -1, :], left[:, :, -1], row[:, -1] = 0.0, 0.0, 0.0
    return record._replace(left=left, row=row, deviation=np.array([deviation]))


def _together(one: _Records, other: _Records) -> _Records:
    return _Records(*(np.concatenate(pair) for pair in zip(one, other, strict=True)))


def _uncertainty(known: Determined, records: _Records, scatter: float | None) -> Uncertainty | None:
    """Sum over all scatters about the coefficients that belong to one; None where equations are singular.

    That one is the most probable where it is not given.
    """
    try:
        mixture = _at(records, _SCATTERS)
        most = mixture.step[np.argmax(mixture.weight)]
        own = most if scatter is None else _at(records, np.array([scatter])).step[0]
    except np.linalg.LinAlgError:
        return None
    # About the fitted value: what keeps it from the minimum, such as a bound, is no scatter.
    step = (mixture.step - own) @ known.vectors.T
    covariance = known.vectors @ mixture.covariance @ known.vectors.T
    moment = np.einsum("t,tij->ij", mixture.weight, covariance)
    moment += np.einsum("t,ti,tj->ij", mixture.weight, step, step)
    error = np.sqrt(np.maximum(np.einsum("tii->ti", covariance), 0.0))  # rounding may leave less than nothing
    width = half_width(mixture.weight, step.T, error.T, CONFIDENCE) / HALF_WIDTH
    scale = width / np.sqrt(np.where(np.diag(moment) > 0.0, np.diag(moment), 1.0))
    law = _merged(mixture.weight, step, covariance).propagated(np.diag(1.0 / known.size))
    return known.uncertainty(moment * np.outer(scale, scale))._replace(mixture=law)


def _merged(
    weight: Float[np.ndarray, " scatter"],
    mean: Float[np.ndarray, "scatter column"],
    covariance: Float[np.ndarray, "scatter column column"],
) -> NormalMixture:
    """Take scatters beside each other together, with the moments that they have together."""
    above = np.maximum(np.cumsum(weight[::-1])[::-1], _LEAST_TAIL)
    _, part = np.unique(np.floor(np.log(above) / np.log(1.0 - _PART)), return_inverse=True)
    share = np.zeros((part.max() + 1, weight.size))
    share[part, np.arange(weight.size)] = weight
    weights = share.sum(axis=1)
    share = share / weights[:, None]
    means = share @ mean
    away = mean - means[part]
    moments = covariance + away[:, :, None] * away[:, None, :]
    scatters = np.sqrt(share @ _SCATTERS**2)
    return NormalMixture(weights, means, np.einsum("ps,sij->pij", share, moments), scatters)


def _with_scales(
    reduced: Reduced, nuisances: Nuisances, basis: Float[np.ndarray, "column direction"], inflation: float
) -> _Records:
    """Undo the elimination of the records' scales, in a basis of the coefficients."""
    deviation, spread = nuisances.stiffness, nuisances.spread.records / STIFFNESS_SCALE_UNIT
    pivot = STIFFNESS_SCALE_UNIT**2 / reduced.stiffness_variance
    row = pivot[:, None] * reduced.stiffness_map
    left = reduced.by_record + row[:, :, None] * reduced.stiffness_map[:, None, :]
    left[:, -1, -1] -= (deviation / spread) ** 2
    row[:, -1] += deviation / spread**2
    turn = np.asarray(block_diag(basis, 1.0))
    own = np.maximum(pivot - spread**-2, 0.0)
    return _Records(turn.T @ left @ turn / inflation, row @ turn / inflation, own / inflation, deviation)


class _Scattered(NamedTuple):
    """The records' equations at each scatter, their scales eliminated.

    Attributes:
        whole: normal equations of the coefficients, residual last.
        logarithm: of the prior of the scatter, per logarithm of it because the grid is even in that, and of
            the volume of the scales.
    """

    whole: Float[np.ndarray, "scatter column column"]
    logarithm: Float[np.ndarray, " scatter"]


def _scattered(records: _Records, scatters: Float[np.ndarray, " scatter"]) -> _Scattered:
    """Give the equations at each scatter."""
    tight = (STIFFNESS_SCALE_UNIT / scatters[:, None]) ** 2
    pivot = records.own + tight
    row = np.repeat(records.row[None], scatters.size, axis=0)
    row[..., -1] -= records.deviation * tight
    whole = records.left.sum(axis=0) - np.einsum("tr,tri,trj->tij", 1.0 / pivot, row, row)
    whole[:, -1, -1] += np.sum(records.deviation**2 * tight, axis=1)
    prior = np.log(scatters) - np.log1p((scatters / SCATTER_PRIOR) ** 2)
    return _Scattered(whole, prior - 0.5 * np.sum(np.log(pivot / tight), axis=1))


def _at(records: _Records, scatters: Float[np.ndarray, " scatter"]) -> _Mixture:
    """Give weight, step and covariance at each scatter."""
    whole, logarithm = _scattered(records, scatters)
    score = whole[:, :-1, -1]
    covariance = np.linalg.inv(whole[:, :-1, :-1])
    step = np.einsum("tij,tj->ti", covariance, score)
    chi2 = whole[:, -1, -1] - np.sum(step * score, axis=1)
    weight = _weights(logarithm - 0.5 * (chi2 + np.linalg.slogdet(whole[:, :-1, :-1])[1]))
    return _Mixture(weight, step, covariance)


def log_likelihood(
    reduced: Reduced, nuisances: Nuisances, inflation: float, scatters: bool
) -> tuple[float, Float[np.ndarray, " column"]]:
    """Give the logarithm of the likelihood of coefficients, over all scatters, with its gradient.

    `log sum p(t) exp(-chi2(t) / 2)`, with p the prior of the scatter and the volume of the records' scales;
    the gradient is J'r at each scatter, weighted alike. Where the equations stand still for another step of
    the nuisances the gradient is exact.

    Args:
        reduced: equations at these coefficients.
        nuisances: that the equations are about.
        inflation: factor on the squared noise: max(1, chi2/dof) of the fit.
        scatters: whether the records tell a scatter of the stiffness, which is then summed over.

    Returns:
        Both, up to a constant; not finite where the equations are not.
    """
    matrix = reduced.matrix
    if not scatters or not np.all(np.isfinite(matrix)):
        return -0.5 * float(matrix[-1, -1]) / inflation, matrix[:-1, -1] / inflation
    records = _with_scales(reduced, nuisances, np.eye(matrix.shape[0] - 1), inflation)
    whole, logarithm = _scattered(records, _SCATTERS)
    logarithm = logarithm - 0.5 * whole[:, -1, -1]
    weight = np.exp(logarithm - logarithm.max())
    return float(logarithm.max() + np.log(weight.sum())), weight / weight.sum() @ whole[:, :-1, -1]
