"""The diagnosis of records without dwells: effects weighed by the likelihood of a filter's innovations."""

import functools
from typing import NamedTuple

import numpy as np
from scipy import stats

from ...elements import CATALOGUE
from ...models import Isolator
from .._rules import Rules
from ..fitting import Fit, Search, fit_with_errors, magnitudes
from ..guess import balance_starts
from ..innovations import ErrorFit, refined
from ._bounds import WIDTH_95, strength_unit
from ._effect_search import (
    Refit,
    Score,
    Scores,
    Transfer,
    coefficients,
    left_out,
    refit_effect,
    score_effects,
    transfer,
)
from ._findings import Candidate, Finding, Verdict, VerdictWord
from ._innovation_words import added_words, error_words
from ._remaining_error import remaining_words
from ._separating_words import is_exact, separating_experiment

CHANNELS = ("The drive and the floor", "The response channel")
"""Groups of effects that are no laws of the isolator: they have a share of the refits of their own."""

_NEXT = 2
"""Candidates that were not named whose share of the error of unseen records is told."""

_BALANCED = 3
"""Effects that are refitted because the measured forces balance best with them."""

MOST_INTERNAL = 4
"""Internal states of a model that is refitted: the filter's covariance grows with their square."""


class Weighed(NamedTuple):
    """A candidate that nothing speaks against, and what it takes off records that its refit did not see.

    Attributes:
        refit: the candidate.
        transfer: what it takes off.
    """

    refit: Refit
    transfer: Transfer


def diagnose_innovations(
    search: Search, fit: Fit, significance: float | None = None, excluded: tuple[str, ...] = ()
) -> Verdict:
    """Name the effect that a model lacks, from records without dwells.

    Where the error with the effect is noise, the likelihood decides. Where the error is the model's all the
    same, innovations are neither independent nor normal, and their likelihood is too sure. An effect is then
    judged by what it takes off the squared error of free runs of records that its refit did not see.

    Args:
        search: how to search.
        fit: the fit, with the sizes of its errors.
        significance: family-wise level; `rules.significance` if omitted.
        excluded: catalogue names that are not to be considered.

    Returns:
        The verdict.

    Source: Kristensen, Madsen & Jorgensen 2004; Gelman, Hwang & Vehtari 2014, Stat. Comput. 24:997.
    """
    found, rules = fit.innovations, search.rules
    assert found is not None
    level = rules.significance if significance is None else significance
    scores = score_effects(found, search, excluded)
    search.progress(f"score test of {len(scores.scores)} absent effects")
    refits = _refits(found, fit, scores, search)
    usable = _by_evidence(found, refits, scores, level, rules)
    reason = "no absent effect is both significant and physical"
    best: Weighed | None = None
    shares: dict[str, float] = {}
    without = functools.cache(lambda: left_out(found, search))

    def weigh(refit: Refit) -> Weighed:
        one = Weighed(refit, transfer(without(), left_out(refit.fit, search)))
        shares[refit.score.element.name] = one.transfer.share if one.transfer.settled else np.nan
        return one

    for refit in usable:
        clear = _gain(found, refit) > rules.clear_gain * found.samples
        if refit.fit.is_noise_of_output and clear:
            best = Weighed(refit, Transfer(_gain(found, refit), 1.0, True))
            break
        by_runs = refit.fit.is_noise or _follows(usable, rules)
        needed = 0.0 if refit.fit.is_noise else rules.smallest_share
        if needed and by_runs and not refit.fit.free_error < found.free_error * np.sqrt(1.0 - needed):
            continue  # what does not even help the records that it was fitted to helps no others
        one = weigh(refit)
        least = 0.0 if by_runs else rules.clear_gain * found.samples
        if one.transfer.deviance > least and (one.transfer.share >= needed or not by_runs):
            best = one
            break
        reason = f"{refit.score.element.name} does not carry over to records left out of its refit"
    if best is None:
        return _nothing(found, scores, refits, reason, fit, rules, shares)
    told = 0
    for refit in usable if shares else []:
        if refit.score.element.name not in shares and told < _NEXT:
            told += weigh(refit).transfer.settled
    return _finding(search, fit, scores, refits, best, shares)


def _refits(found: ErrorFit, fit: Fit, scores: Scores, search: Search) -> list[Refit]:
    """Refit the effects that the balance of forces and the scores ask for; then what looks like the best."""
    rules, refits = search.rules, list[Refit]()

    def refit(score: Score, begin: Isolator | None = None) -> bool:
        search.progress(f"refit with {score.element.name}")
        rivals = [one.fit.criterion for one in refits if one.violation is None]
        refits.append(refit_effect(found, score, search, begin, min(rivals, default=np.inf)))
        return refits[-1].violation is None and refits[-1].explains

    asked = [
        score
        for score in scores.scores
        if score.admissible
        and abs(score.pull) > _least_pull(scores)
        and found.model.internal_states + score.element.internal_states <= MOST_INTERNAL
    ]
    left = {True: rules.survivors // 2, False: rules.survivors}
    held = {element.name for element in found.model.elements}
    absent = tuple(one for one in scores.probes if one.group not in CHANNELS and held.isdisjoint(one.absorbs))
    for start in [] if found.is_noise else balance_starts(fit.campaign, found.model, absent)[:_BALANCED]:
        score = next((one for one in scores.scores if one.element.name == start.element.name), None)
        if score is None:
            continue
        asked = [one for one in asked if one is not score]
        if refit(score, start.model):
            asked = []
            break
    while asked := [one for one in asked if left[one.element.group in CHANNELS]]:
        # Of those that stand out about as much the plainest goes first: it may do.
        near = [one for one in asked if abs(one.pull) > rules.about_as_large * abs(asked[0].pull)]
        plainest = min(near, key=lambda one: (coefficients(found, one), one.element.internal_states))
        asked = [one for one in asked if one is not plainest]
        left[plainest.element.group in CHANNELS] -= 1
        if refit(plainest):
            break  # nothing can explain more, but another law may explain as much
    best = min(
        (one for one in refits if one.violation is None), key=lambda one: one.fit.criterion, default=None
    )
    if best is None:
        return refits
    alike = _look_alikes(best.score.element.name)
    place, free = _place(scores, best), _free_effects(best.fit)
    for index, score in enumerate(scores.scores):
        near = score.element.name in alike or abs(best.score.likeness[index]) > rules.likeness
        done = any(_place(scores, one) == index for one in refits)
        few = found.model.internal_states + score.element.internal_states <= MOST_INTERNAL
        # Where a law leaves nothing but noise one with more coefficients cannot be told from it, unless they
        # would be one law if what is known beside them were not.
        pair = best.score.element.name, score.element.name
        twin = is_exact(*pair, set(CATALOGUE)) and not is_exact(*pair, free)
        told = not best.explains or twin or coefficients(found, score) <= len(best.fit.places)
        if near and few and told and not done and index != place and score.admissible:
            refit(score)
    return refits


def _place(scores: Scores, refit: Refit) -> int:
    """Give the place of a refitted effect among the scores, of which there is one a name."""
    names = [one.element.name for one in scores.scores]
    return names.index(refit.score.element.name)


def _least_pull(scores: Scores) -> float:
    """Give the score below which chance explains the largest of so many."""
    return float(stats.norm.isf(0.5 * 0.05 / max(1, len(scores.scores))))


def _look_alikes(name: str) -> set[str]:
    """Give the catalogue names of effects that are declared to look like one."""
    found: set[str] = set()
    for kind_name, kind in CATALOGUE.items():
        for alike in kind.look_alikes:
            group = {kind_name, *alike.others}
            if name == kind_name or (name in group and alike.among):
                found |= group
            elif name in alike.others:
                found.add(kind_name)
    return found - {name}


def _free_effects(fit: ErrorFit) -> set[str]:
    """Give the catalogue names of the effects whose strength is fitted."""
    return {name for name, kind in CATALOGUE.items() if f"{name}.{kind.strength}" in fit.names}


def _gain(found: ErrorFit, refit: Refit) -> float:
    return float(found.deviance.sum() - refit.fit.deviance.sum())


def _by_evidence(
    found: ErrorFit, refits: list[Refit], scores: Scores, level: float, rules: Rules
) -> list[Refit]:
    """List the refits that are significant and physical, best first.

    Of those that are as good the one with the fewest coefficients goes first, then the one with the fewest
    internal states, then the commoner one.
    """
    dispersion, tests = max(1.0, scores.dispersion), max(1, len(scores.scores))
    usable = []
    for refit in refits:
        extra = len(refit.fit.places) - len(found.places)
        gain = _gain(found, refit) / dispersion
        chance = tests * stats.chi2.sf(max(gain, 0.0), max(1, extra))
        if (
            refit.violation is None
            and chance < level
            and gain - extra * np.log(found.samples) > rules.close_bic
        ):
            usable.append(refit)
    if any(one.fit.is_noise for one in usable):
        usable = sorted(usable, key=lambda one: (not one.fit.is_noise, one.fit.criterion))
        lowest = usable[0].fit.criterion + rules.close_bic
        tied = [one for one in usable if one.fit.is_noise and one.fit.criterion <= lowest]
    elif usable and not _follows(usable, rules):
        usable = sorted(usable, key=lambda one: one.fit.criterion)
        tied = [one for one in usable if one.fit.criterion <= usable[0].fit.criterion + rules.close_bic]
    else:
        # The error is the model's: what a free run leaves counts, record by record over its size.
        usable = sorted(usable, key=lambda one: one.fit.free_error)
        tied = [one for one in usable if _as_good(one.fit, usable[0].fit, rules)]
    if not usable:
        return []
    first = min(
        tied,
        key=lambda one: (len(one.fit.places), one.fit.model.internal_states, one.score.element.seldom),
    )
    return [first, *(one for one in usable if one is not first)]


def _follows(refits: list[Refit], rules: Rules) -> bool:
    """Say whether a free run of some model follows the records: none does where the motion is irregular."""
    records = [record.output for record in refits[0].fit.filter.tables.records]
    rms = float(np.sqrt(sum(np.sum(one**2) for one in records) / sum(one.size for one in records)))
    return min(one.fit.free_error for one in refits) < rules.followed * rms


def _candidate(
    score: Score, refits: list[Refit], best: Refit | None, scores: Scores, shares: dict[str, float]
) -> Candidate:
    name = score.element.name
    refit = next((one for one in refits if one.score.element.name == name), None)
    strength, error, chi2, delta, admissible = score.strength, score.error, np.nan, np.nan, score.admissible
    element = score.element
    if refit is not None and np.isfinite(refit.fit.deviance.sum()):
        own = refit.fit
        name = f"{element.name}.{element.strength}"
        place = own.names.index(name)
        strength = float(own.values[place])
        inverse = np.linalg.pinv(own.information, hermitian=True)
        error = float(np.sqrt(max(inverse[place, place], 0.0)))
        chi2 = own.chi2 / max(1.0, own.samples - len(own.places))
        delta = np.nan if best is None else own.criterion - best.fit.criterion
        admissible = admissible and refit.violation is None
    place = None if best is None else _place(scores, best)
    return Candidate(
        element.name,
        element.words,
        score.z,
        score.p_value,
        score.visibility,
        strength,
        error,
        strength_unit(element),
        float(chi2),
        float(delta),
        0.0 if place is None else float(score.likeness[place]),
        admissible,
        shares.get(element.name, np.nan),
    )


def _ranking(
    scores: Scores, refits: list[Refit], best: Refit | None, shares: dict[str, float]
) -> tuple[Candidate, ...]:
    first = [] if best is None else [best.score]
    others = sorted((one for one in refits if one is not best), key=lambda one: one.fit.criterion)
    order = [*first, *(one.score for one in others)]
    done = {one.element.name for one in order}
    order += [one for one in scores.scores if one.element.name not in done]
    return tuple(_candidate(score, refits, best, scores, shares) for score in order)


def _nothing(
    found: ErrorFit,
    scores: Scores,
    refits: list[Refit],
    reason: str,
    fit: Fit,
    rules: Rules,
    shares: dict[str, float],
) -> Verdict:
    """Word that nothing is named."""
    good = found.is_noise
    bounds = {}
    if good:
        bounds = {
            one.element.name: (abs(one.strength) + WIDTH_95 * one.error, strength_unit(one.element))
            for one in scores.scores
        }
    verdict: VerdictWord = "none" if good else "unexplained"
    words = f"{error_words(found, fit)} {reason[0].upper()}{reason[1:]}."
    if not good:
        words = f"{words} {remaining_words(fit.free_runs)}".strip()
    ranking = _ranking(scores, refits, None, shares)
    return Verdict(verdict, None, ranking, (), 1.0, scores.hidden, bounds, None, words)


def _finding(
    search: Search,
    fit: Fit,
    scores: Scores,
    refits: list[Refit],
    best: Weighed,
    shares: dict[str, float],
) -> Verdict:
    """Word a finding."""
    found, rules, refit = fit.innovations, search.rules, best.refit
    assert found is not None
    search.progress("the finding, fitted to the end")
    fine = refined(refit.fit, magnitudes(refit.fit.model, refit.fit.places, search.scales))
    whole = fit_with_errors(fine, fit.model, fit.campaign, search)
    name = refit.score.element.name
    names = _free_effects(fine)
    together = tuple(
        one.score.element.name
        for one in refits
        if one is not refit
        and one.violation is None
        and _is_alike(one, refit, rules)
        and name not in CATALOGUE[one.score.element.name].absorbs
    )
    exact = tuple(
        one for one in CATALOGUE if one != name and one not in together and is_exact(name, one, names)
    )
    together += exact
    before, after = found.free_error, fine.free_error
    explained = 1.0 - (after / before) ** 2 if np.isfinite(after) and before > 0.0 else 0.0
    explained = 1.0 if fine.is_noise else explained
    good = whole.innovations is None or whole.innovations.is_noise or whole.estimate.inflation < rules.good
    verdict: VerdictWord = "found" if good else "unexplained"
    if not good and explained >= 1.0 - rules.smallest_share:
        verdict = "partly_explained"
    ranking = _ranking(scores, refits, refit, shares)
    finding = Finding(
        name,
        together,
        refit.score.p_value,
        float(np.clip(explained, 0.0, 1.0)),
        float(np.clip(best.transfer.share, 0.0, 1.0)),
        ranking,
        separating_experiment(name, together),
    )
    reason = added_words(ranking, best.transfer.share, fine.is_noise)
    if not fine.is_noise:
        reason = f"{reason} {remaining_words(whole.free_runs)}".strip()
    return Verdict(verdict, finding, ranking, together, 1.0 - explained, scores.hidden, {}, whole, reason)


def _is_alike(one: Refit, best: Refit, rules: Rules) -> bool:
    """Say whether the records do not tell a law from the best one."""
    if best.fit.is_noise:
        tie = max(rules.close_bic, rules.smallest_gain * best.fit.samples)
        return one.fit.criterion <= best.fit.criterion + tie
    return _as_good(one.fit, best.fit, rules)


def _as_good(one: ErrorFit, best: ErrorFit, rules: Rules) -> bool:
    """Say whether a model follows the records about as well as another, when nothing is fed back."""
    return one.free_error <= best.free_error * (1.0 + rules.free_run_tie)
