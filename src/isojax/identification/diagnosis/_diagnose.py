"""The diagnosis: from a residual to the effect that the model lacks, or to the word that nothing is."""

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy import stats

from ..._results import RESULTS
from ...elements import CATALOGUE, AbstractElement, Scales
from ..fitting import DEFAULT_SOLVER, MOST_STEPS, Estimate, Fit, Rival, silent
from ..guess import find_balance_start
from ..guess import scales as campaign_scales
from ._admissibility import find_violation
from ._bounds import GOOD, upper_bounds
from ._evidence import CLOSE_BIC, by_evidence, least_difference, rank_candidates, smallest_inflation
from ._findings import Candidate, Finding, Verdict
from ._imitations import find_simpler_pair
from ._refit import (
    SMALLEST_GAIN,
    Refit,
    bic,
    follows_freely,
    is_determined,
    polish,
    refit_candidate,
    refit_from,
    rivals,
)
from ._score import Score, ScoreTest, absent_effects, score_test
from ._separating_words import is_exact, separating_experiment
from ._transfer import transferred_share

CLEAN = 1.02
"""chi2/dof up to which what is left is as little as a bench repeats, whatever there was to explain."""

LEFT_OVER = 0.03
"""Share of the first excess that may be left where the noise is small beside every model error."""

MOST_OF_IT = 0.8
"""Share of the excess that an effect must explain to be the explanation."""

SMALLEST_SHARE = 0.2
"""Share of the remaining excess that an effect must explain to be named where the fit is not good."""

SURVIVORS = 4
"""Families that are refitted."""

WORTH_REFIT = 0.04
"""Linear gain, over that of the leading family, below which no shape parameter makes up the difference."""

FAR = 2.0
"""chi2/dof above which the balance of measured forces is asked, too: a score is a derivative at the fit."""

CLOSE_LIKENESS = 0.95


def is_good(chi2_per_dof: float, excess: float, first_excess: float) -> bool:
    """Say whether a fit leaves nothing worth explaining.

    Args:
        chi2_per_dof: of the fit.
        excess: chi2 - dof of the fit.
        first_excess: of the first fit of the loop.

    Returns:
        True if chi2/dof is near one, or hardly any of the first excess is left.
    """
    return chi2_per_dof <= GOOD or excess < LEFT_OVER * first_excess


def is_clean(before: Estimate, after: Estimate) -> bool:
    """Say whether so little was to explain, or is left, that no share of it need be asked for.

    Args:
        before: the estimate without what was found.
        after: the estimate with it.

    Returns:
        True if either holds.
    """
    return before.chi2 / before.dof <= GOOD or after.chi2 / after.dof <= CLEAN


def diagnose(
    fit: Fit,
    *,
    first_excess: float | None = None,
    significance: float = 0.01,
    excluded: tuple[str, ...] = (),
    solver: Any = DEFAULT_SOLVER,
    max_steps: int = MOST_STEPS,
    progress: Callable[[str], None] = silent,
) -> Verdict:
    """Name the effect that a fitted model lacks, with its evidence; or say that it lacks none.

    Held-out records take no part.

    Args:
        fit: the fit to diagnose.
        first_excess: chi2 - dof of the first fit of the loop; of this one if omitted.
        significance: family-wise level of the score test.
        excluded: catalogue names that are not to be considered.
        solver: an optimistix least-squares solver for the refits.
        max_steps: evaluations a refit at most.
        progress: told a line a step.

    Returns:
        The verdict.
    """
    fitted = fit.estimate
    if not fitted.point.is_finite:
        reason = f"The fit failed, so that there is nothing to diagnose. {RESULTS[fit.result]}"
        return Verdict("unexplained", None, (), (), float("nan"), (), {}, None, reason)
    scales = campaign_scales(fit.campaign)
    probes = absent_effects(fitted.model, scales, excluded)
    progress(f"score test of {len({probe.name for probe in probes})} absent effects")
    test = score_test(fitted, scales, probes)
    first = fitted.excess if first_excess is None else first_excess
    chi2_per_dof = fitted.chi2 / fitted.dof
    refits: list[Refit] = []
    leading = (
        _refit_from_balance(fit, test, scales, solver, max_steps, progress) if chi2_per_dof > FAR else None
    )
    if leading is not None:
        refits.append(leading)
    strongest = None
    for index, score in enumerate(test.scores):
        if len(refits) == SURVIVORS:
            break
        if not score.admissible or score.p_value > significance:
            continue
        if leading is not None and (_explains(leading, fitted) or leading.score.column == score.column):
            continue
        if strongest is not None and score.z**2 < WORTH_REFIT * strongest**2:
            break
        # The score says what one linear step could gain at most when the model is near; far away it only
        # ranks.
        if chi2_per_dof <= GOOD and score.z**2 / fitted.dof < SMALLEST_GAIN / 5.0:
            continue
        strongest = score.z if strongest is None else strongest
        progress(f"refit with {score.element.name}")
        found = refit_candidate(test, index, scales, solver, max_steps, progress, _rival(refits))
        refits.append(Refit(score, found, _violation(fit, found, score)))
    refits = _without_imitations(fit, refits, scales, solver, progress)
    if chi2_per_dof > FAR:
        for index in _unanswered(test, refits, significance):
            score = test.scores[index]
            progress(f"refit with {score.element.name}, which resembles the best")
            found = refit_candidate(test, index, scales, solver, max_steps, progress, _rival(refits))
            refits.append(Refit(score, found, _violation(fit, found, score)))
    return _judge(fit, test, refits, first, scales, significance, solver, progress)


def _unanswered(test: ScoreTest, refits: list[Refit], significance: float) -> list[int]:
    """List the effects that resemble the best one and were not refitted, as far as so many are worth it.

    Near the records derivatives that agree tell that two laws do. Far from them only a refit does.
    """
    usable = by_evidence(refits)
    if not usable:
        return []
    names = [score.element.name for score in test.scores]
    likeness = np.abs(test.likeness[names.index(usable[0].score.element.name)])
    done = {refit.score.element.name for refit in refits}
    open_still = [
        index
        for index, score in enumerate(test.scores)
        if score.element.name not in done
        and score.admissible
        and score.p_value <= significance
        and likeness[index] > CLOSE_LIKENESS
    ]
    return sorted(open_still, key=lambda index: -likeness[index])[:SURVIVORS]


def _rival(refits: list[Refit]) -> Rival | None:
    """Give what a further candidate must not stay far behind.

    One that leaves nothing to explain could only be equalled: what comes no nearer at once never will.
    """
    best = min(
        (one.estimate for one in refits if one.violation is None), key=lambda one: one.chi2, default=None
    )
    if best is None:
        return None
    spotless = best.chi2 / best.dof < 1.0 + 10.0 * SMALLEST_GAIN
    far = 10.0 * least_difference(best)
    return Rival(best.chi2, far, 3, 0.2) if spotless else Rival(best.chi2, far)


def _violation(fit: Fit, found: Estimate, score: Score) -> str | None:
    """Say what speaks against a refit, whatever it gains."""
    fitted = fit.estimate
    if found.result == RESULTS.outdone:
        return "its search came no nearer to that of another effect"
    if found.result != RESULTS.successful or found.excess >= fitted.excess:
        return "its refit did not converge"
    if not is_determined(found, score):
        return "its strength is not determined"
    element = found.model.element(score.element.name)
    if element is not None and not element.signed and float(getattr(element, element.strength)) < 0.0:
        return "its refit ends at a strength below zero"
    if not follows_freely(fitted, found):
        return "its free run is worse than without it"
    return find_violation(found.model, fit.campaign.fit_records, fitted.simulator.problem.quantity)


def _explains(refit: Refit, fitted: Estimate) -> bool:
    """Say whether a candidate alone explains most of the excess."""
    return refit.violation is None and refit.estimate.excess < (1.0 - MOST_OF_IT) * fitted.excess


def _refit_from_balance(
    fit: Fit,
    test: ScoreTest,
    scales: Scales,
    solver: Any,
    max_steps: int,
    progress: Callable[[str], None],
) -> Refit | None:
    """Refit the effect that the balance of measured forces asks for, if there is one."""
    absent = tuple(score.element for score in test.scores)
    start = find_balance_start(fit.campaign, fit.model, scales, absent)
    if start is None:
        return None
    progress(f"refit with {start.element.name}, from the balance of measured forces")
    found = refit_from(fit.estimate, start.model, scales, solver, max_steps, progress, far=True)
    score = next(one for one in test.scores if one.element.name == start.element.name)
    # Far from the records the score has no say in the sign; the likelihood ratio stands for its p-value.
    drop = max(0.0, fit.estimate.chi2 - found.chi2) / max(1.0, found.chi2 / found.dof)
    extra = max(1, len(found.places) - len(fit.estimate.places))
    p_value = float(min(1.0, len(absent) * stats.chi2.sf(drop, extra)))
    score = score._replace(element=start.element, p_value=p_value, admissible=True)
    return Refit(score, found, _violation(fit, found, score))


def _without_imitations(
    fit: Fit, refits: list[Refit], scales: Scales, solver: Any, progress: Callable[[str], None]
) -> list[Refit]:
    """Strike out a best candidate that two simpler effects outdo, until the best stands."""
    refits = list(refits)
    while True:
        usable = by_evidence(refits)
        if not usable:
            return refits
        pair = find_simpler_pair(fit.estimate, usable, fit.campaign, scales, solver, progress)
        if pair is None:
            return refits
        place = next(index for index, one in enumerate(refits) if one is usable[0])
        refits[place] = usable[0]._replace(violation=f"{pair} explain more with as many coefficients")


def _judge(
    fit: Fit,
    test: ScoreTest,
    refits: list[Refit],
    first_excess: float,
    scales: Scales,
    significance: float,
    solver: Any,
    progress: Callable[[str], None],
) -> Verdict:
    """Weigh the refits, and word the verdict."""
    fitted = fit.estimate
    inflation = smallest_inflation(by_evidence(refits))
    good = is_good(fitted.chi2 / fitted.dof, fitted.excess, first_excess)
    reason = "no absent effect is both significant and physical"
    refits = list(refits)
    while usable := by_evidence(refits):
        best = usable[0]
        gain = fitted.misfit - best.estimate.misfit
        needed = max(SMALLEST_GAIN, _needed_share(fitted) * fitted.excess / fitted.dof)
        clear = bic(fitted, inflation) - bic(best.estimate, inflation) > CLOSE_BIC
        too_little = _too_little(best, gain, fitted)
        if gain / fitted.dof < needed or not clear:
            reason = too_little
            break
        share = transferred_share(fit, best.estimate, scales, solver, progress)
        if share > 0.0:
            ranking = rank_candidates(test, refits, usable, inflation)
            usable[0] = best._replace(estimate=polish(best.estimate, scales, solver, progress))
            return _found(fit, test, usable, ranking, first_excess, share, inflation)
        # What imitates the missing effect on the records of its refit alone must not hide that effect.
        reason = f"{too_little}, but it does not carry over to data left out of its refit"
        place = next(index for index, one in enumerate(refits) if one is best)
        refits[place] = best._replace(violation="it does not carry over to data left out of its refit")
    ranking = rank_candidates(test, refits, by_evidence(refits), inflation)
    bounds = upper_bounds(test, fitted, None)
    verdict = "none" if good else "unexplained"
    words = "The fit is good and " if good else "The fit is not good, but "
    return Verdict(verdict, None, ranking, (), 1.0, test.hidden, bounds, None, words + reason + ".")


def _too_little(best: Refit, gain: float, fitted: Estimate) -> str:
    """Word what the best effect would gain: of chi2/dof where little but noise is left, else a share."""
    gained = (
        f"takes {gain / fitted.dof:.2g} off chi2/dof"
        if fitted.chi2 / fitted.dof <= GOOD
        else f"explains {100.0 * gain / max(fitted.excess, 1.0):.2g} % of what is left beyond the noise"
    )
    extra = len(best.estimate.places) - len(fitted.places)
    more = "1 more coefficient" if extra == 1 else f"{extra} more coefficients"
    return f"adding {best.score.element.name} {gained} with {more}"


def _needed_share(fitted: Estimate) -> float:
    """Give the share of the remaining excess that an effect must explain to be named.

    Where more than noise is left every small error of the model is significant: only what explains a good
    part of the rest counts there.
    """
    return 0.0 if fitted.chi2 / fitted.dof <= GOOD else SMALLEST_SHARE


def _twins(best: Refit) -> tuple[AbstractElement, ...]:
    """Give the laws that are the finding's own by another name, beside what is free, as they are declared."""
    found = best.estimate
    element = found.model.element(best.score.element.name)
    if element is None:
        return ()
    translated = (kind.twin_of(element) for kind in CATALOGUE.values())
    free = {name for name in CATALOGUE if f"{name}.{CATALOGUE[name].strength}" in found.names}
    return tuple(
        twin
        for twin in (*element.twins(), *translated)
        if twin is not None and is_exact(element.name, twin.name, free)
    )


def _found(
    fit: Fit,
    test: ScoreTest,
    usable: list[Refit],
    ranking: tuple[Candidate, ...],
    first_excess: float,
    share: float,
    inflation: float,
) -> Verdict:
    """Word a finding."""
    fitted, best = fit.estimate, usable[0]
    name = best.score.element.name
    explained = (fitted.misfit - best.estimate.misfit) / max(fitted.excess, 1.0)
    together = tuple(
        entry.effect
        for entry in ranking
        if entry.effect != name
        and entry.admissible
        # A law that contains the finding follows it everywhere, and was not found to say more.
        and name not in CATALOGUE[entry.effect].absorbs
        and (
            entry.delta_bic <= least_difference(best.estimate)
            or (np.isnan(entry.delta_bic) and abs(entry.likeness) > CLOSE_LIKENESS)
        )
    )
    twins = tuple(twin for twin in _twins(best) if any(twin.name == entry.effect for entry in ranking))
    together += tuple(twin.name for twin in twins if twin.name not in together)
    finding = Finding(
        name,
        together,
        best.score.p_value,
        float(min(explained, 1.0)),
        share,
        ranking,
        separating_experiment(name, together),
        rivals(test.scores, usable, twins, together),
    )
    good = is_good(best.estimate.chi2 / best.estimate.dof, best.estimate.excess, first_excess)
    if good and (is_clean(fitted, best.estimate) or explained >= MOST_OF_IT):
        verdict = "found"
    elif explained >= MOST_OF_IT:
        verdict = "partly_explained"
    else:
        verdict = "unexplained"
    left = best.estimate.excess / max(fitted.excess, 1.0)
    before, after = fitted.chi2 / fitted.dof, best.estimate.chi2 / best.estimate.dof
    reason = f"Adding {best.score.element.words} takes chi2/dof from {before:.4g} to {after:.4g}."
    bounds = upper_bounds(test, fitted, name)
    return Verdict(
        verdict, finding, ranking, together, float(max(left, 0.0)), test.hidden, bounds, best.estimate, reason
    )
