"""Which absent effect the innovations of a filter ask for: scores, refits, and what carries over."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy import stats

from ..._parameters import list_parameters
from ..._results import is_successful
from ...elements import CATALOGUE, AbstractElement
from ...models import Isolator
from ..fitting import Search, magnitudes
from ..innovations import (
    ErrorFit,
    effect_products,
    first_sizes,
    fit_errors,
    fit_measured,
)
from ..jacobian import effects_without_signal
from ._admissibility import find_violation
from ._refit import extended_model, new_places
from ._score import absent_effects

_SHARES = (1.0, 0.3, 0.1, 0.03)
"""Shares of the score's linear step at which a refit may start."""

_SMALLER = 4.0
"""How far below a first guess the random force of a refit may start [log of variance]."""


class Score(NamedTuple):
    """What the innovations say of an absent effect, before any refit.

    Attributes:
        element: the effect at zero strength, with the shape of its largest score.
        z: score over its standard deviation; its sign is that of the strength.
        pull: the same for independent innovations; its square is what a linear step takes off the deviance.
        strength: by one linear step [its unit].
        error: standard error of the strength [its unit].
        visibility: share of its trace that the fitted coefficients leave.
        p_value: family-wise, over all candidates.
        admissible: whether the sign of the strength is physical.
        step: of the fitted coefficients that goes with the strength [their units].
        likeness: cosines of its trace with those of the other scores.
    """

    element: AbstractElement
    z: float
    pull: float
    strength: float
    error: float
    visibility: float
    p_value: float
    admissible: bool
    step: Float[np.ndarray, " coefficient"]
    likeness: Float[np.ndarray, " score"]


class Scores(NamedTuple):
    """Scores of all absent effects.

    Attributes:
        scores: one a family, largest first.
        hidden: catalogue names that the records cannot show beside the fitted coefficients.
        dispersion: variance of the scores from piece to piece of the records, over that of independent
            innovations: about 1 where the error is noise.
        probes: the absent effects, in all the shapes that were tried.
    """

    scores: tuple[Score, ...]
    hidden: tuple[str, ...]
    dispersion: float
    probes: tuple[AbstractElement, ...]


class Refit(NamedTuple):
    """A candidate refitted with everything free.

    Attributes:
        score: its score before.
        fit: the refit.
        violation: what speaks against it, or None.
    """

    score: Score
    fit: ErrorFit
    violation: str | None

    @property
    def explains(self) -> bool:
        """Whether nothing but noise of the output is left."""
        return self.fit.is_noise_of_output and not self.fit.has_force


def score_effects(fit: ErrorFit, search: Search, excluded: tuple[str, ...] = ()) -> Scores:
    """Test every absent effect, all at once.

    Args:
        fit: the model beside which they are absent.
        search: the scales of the campaign, and how much of a trace must be left.
        excluded: catalogue names that are not to be considered.

    Returns:
        The scores.

    Source: Rao 1948; White 1980, Econometrica 48:817 (variance of scores where the model is not quite right).
    """
    rules, records = search.rules, fit.filter.tables.records
    pointless = effects_without_signal(records)
    probes = tuple(
        probe
        for probe in absent_effects(fit.model, search.scales, excluded)
        if probe.name not in pointless and not probe.phased
    )
    # Where each record has a zero of its own, none common to all can be seen.
    zeros = {probe.name for probe in probes if probe.starts_at_mean and fit.filter.zeros is not None}
    probes = tuple(probe for probe in probes if probe.name not in zeros)
    units = np.array([1e-3 * probe.typical_strength(search.scales) for probe in probes])
    products, count = effect_products(fit, probes, units), len(fit.places)
    own = 1.0 / np.sqrt(np.maximum(np.diag(fit.information), 1e-300))
    scale = np.r_[own, np.ones(len(probes) + 1)]
    whole, pieces = products.whole * np.outer(scale, scale), products.pieces * scale[:, None]
    lost = ~np.isfinite(np.diag(whole))
    whole[lost], whole[:, lost], pieces[lost] = 0.0, 0.0, 0.0
    absorbed = np.linalg.pinv(whole[:count, :count], rcond=1e-12, hermitian=True) @ whole[:count, count:]
    left = whole[count:, count:] - whole[:count, count:].T @ absorbed
    apart = pieces[count:-1] - absorbed[:, :-1].T @ pieces[:count]
    size = np.sqrt(np.maximum(np.diag(left)[:-1], 0.0))
    visibility = size / np.sqrt(np.maximum(np.diag(whole)[count:-1], 1e-300))
    seen = (visibility > rules.smallest_visibility) & (size > 0.0)
    amount = np.where(seen, left[:-1, -1] / np.where(seen, size, 1.0) ** 2, 0.0)
    scatter = apart.var(axis=1, ddof=1) * apart.shape[1] / np.where(seen, size, 1.0) ** 2
    dispersion = float(np.median(scatter[seen])) if np.any(seen) else 1.0
    factor = np.sqrt(np.maximum(1.0, scatter)) if dispersion > rules.dispersed else np.ones_like(scatter)
    z = np.where(seen, amount * size / factor, 0.0)
    physical = np.array([probe.signed for probe in probes], dtype=bool) | (amount > 0.0)
    pull = np.abs(amount * size)
    weight = np.where(physical, pull, -1.0 / np.maximum(pull, 1e-300))
    best: dict[str, int] = {}
    for column, probe in enumerate(probes):
        if seen[column] and (probe.name not in best or weight[column] > weight[best[probe.name]]):
            best[probe.name] = column
    order = sorted(best.values(), key=lambda column: -pull[column])
    safe = np.where(seen, size, np.inf)
    likeness = (left[:-1, :-1] / np.outer(safe, safe))[np.ix_(order, order)]
    tests = int(np.sum(seen))
    scores = tuple(
        Score(
            probes[column],
            float(z[column]),
            float(amount[column] * size[column]),
            float(amount[column] * units[column]),
            float(units[column] * factor[column] / size[column]),
            float(visibility[column]),
            float(min(1.0, tests * (1 + probes[column].signed) * stats.norm.sf(abs(z[column])))),
            bool(physical[column]),
            -own * absorbed[:, column] * amount[column] + own * absorbed[:, -1],
            likeness[place],
        )
        for place, column in enumerate(order)
    )
    hidden = zeros | {probe.name for probe in probes} - set(best)
    return Scores(scores, tuple(sorted(hidden)), dispersion, probes)


def coefficients(fit: ErrorFit, score: Score) -> int:
    """Give how many coefficients are free with an effect."""
    return len(new_places(fit, extended_model(fit, score.element, score.strength, score.step)))


def refit_effect(
    fit: ErrorFit,
    score: Score,
    search: Search,
    begin: Isolator | None = None,
    far: bool = False,
    rival: float = np.inf,
) -> Refit:
    """Fit the model with one absent effect, everything free, from the best of several starts.

    Args:
        fit: the model without it.
        score: the effect, and where its score points.
        search: the scales of the campaign.
        begin: where else to start: the model with the effect, every coefficient from the measured forces.
        far: whether the model is so far from the records that its scores mean little.
        rival: criterion of the best refit so far.

    Returns:
        The refit, with what speaks against it whatever it gains.
    """
    shares = _SHARES if score.admissible else ()
    models = [extended_model(fit, score.element, one * score.strength, one * score.step) for one in shares]
    if begin is not None:
        models.insert(0 if far else len(models), begin)
    model, places = models[0], new_places(fit, models[0])
    starts = [
        np.array([float(listed[place].value) for place in places])
        for listed in map(list_parameters, models[1:])
    ]
    sizes = first_sizes(fit.filter)
    if not far:
        sizes = sizes._replace(force=max(fit.sizes.force, sizes.force - _SMALLER))
    scales = magnitudes(model, places, search.scales)
    measured, steps = fit.filter.measured, fit.filter.steps
    found = fit_measured(model, places, scales, measured, sizes, starts, steps, rough=True, rival=rival)
    if far and begin is not None:
        # Far from the records the score has no say in the sign; the likelihood ratio stands for its p-value.
        drop, extra = fit.deviance.sum() - found.deviance.sum(), max(1, len(places) - len(fit.places))
        chance = len(CATALOGUE) * stats.chi2.sf(max(0.0, drop), extra)
        p_value = float(min(1.0, chance))
        score = score._replace(element=begin.elements[-1], p_value=p_value, admissible=True)
    return Refit(score, found, _violation(fit, found, score))


def _violation(fit: ErrorFit, found: ErrorFit, score: Score) -> str | None:
    """Say what speaks against a refit, whatever it gains."""
    if not np.isfinite(found.deviance.sum()):
        return "its refit diverged"
    element = found.model.element(score.element.name)
    if element is not None and not element.signed and float(getattr(element, element.strength)) <= 0.0:
        return "its refit ends at a strength of zero"
    tables = fit.filter.tables
    return find_violation(found.model, tables.records, tables.quantity)


class LeftOut(NamedTuple):
    """How a model does on records that its refit did not see.

    Attributes:
        deviance: -2 log-likelihood, but for a constant.
        squares: squared error of free runs [squared SI unit of the output].
        settled: whether each of its refits converged; one that did not may have stayed at what it was told by
            the record that it should not see.
    """

    deviance: float
    squares: float
    settled: bool


class Transfer(NamedTuple):
    """What an effect takes off the error of records that its refit did not see.

    Attributes:
        deviance: decrease of -2 log-likelihood: above 0 where the unseen records are more probable with it.
        share: of the squared error of their free runs.
        settled: whether the refits with it converged.
    """

    deviance: float
    share: float
    settled: bool


def transfer(before: LeftOut, after: LeftOut) -> Transfer:
    """Give what an effect takes off.

    Args:
        before: without it.
        after: with it.

    Returns:
        Both measures.
    """
    share = 1.0 - after.squares / before.squares if before.squares > 0.0 else 0.0
    return Transfer(before.deviance - after.deviance, share, after.settled)


def left_out(found: ErrorFit, search: Search) -> LeftOut:
    """Refit a model without a part of the records in turn, and predict that part.

    Args:
        found: the model.
        search: the scales of the campaign.

    Returns:
        What they say of all records together.
    """
    deviance, squares, settled = 0.0, 0.0, True
    for unseen in found.filter.measured.folds:
        part = fit_errors(
            found.filter,
            found.places,
            magnitudes(found.model, found.places, search.scales),
            found.sizes,
            judged=1.0 - unseen,
            rough=True,
            starts=(found.values,),
            loudest=found.filter.measured.loudest,
        )
        deviance += float(part.deviance[unseen].sum())
        squares += float(part.free_squares[unseen].sum())
        settled = settled and is_successful(part.result)
    return LeftOut(deviance, squares, settled)
