"""The diagnosis of records without dwells: effects weighed by the likelihood of a filter's innovations."""

import functools
from typing import NamedTuple

import numpy as np
from scipy import stats

from ...elements import CATALOGUE
from .._rules import Rules
from ..fitting import Fit, Search, fit_with_errors, magnitudes
from ..innovations import ErrorFit, refined
from ._bounds import WIDTH_95, strength_unit
from ._effect_search import (
    Refit,
    Score,
    Scores,
    Transfer,
    left_out,
    score_effects,
    transfer,
)
from ._findings import Candidate, Finding, Verdict, VerdictWord
from ._innovation_words import added_words, error_words
from ._refit_search import free_effects, place_of, seek_refits
from ._remaining_error import remaining_words
from ._separating_words import is_exact, separating_experiment

_NEXT = 2
"""Candidates that were not named whose share of the error of unseen records is told."""


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
    refits = seek_refits(found, fit, scores, search)
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
        if _takes_off(found, refit) < fit.campaign.accuracy * _rms(found):
            reason = f"{refit.score.element.name} takes off less than the declared accuracy of the channels"
            continue
        by_runs = refit.fit.is_noise or _follows(usable, rules)
        if refit.fit.is_noise_of_output and clear:
            best = Weighed(refit, Transfer(_gain(found, refit), 1.0, True))
            break
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
    return min(one.fit.free_error for one in refits) < rules.followed * _rms(refits[0].fit)


def _rms(found: ErrorFit) -> float:
    """Give the rms of the records [SI unit of the output]."""
    records = [record.output for record in found.filter.tables.records]
    return float(np.sqrt(sum(np.sum(one**2) for one in records) / sum(one.size for one in records)))


def _takes_off(found: ErrorFit, refit: Refit) -> float:
    """Give the rms that an effect takes off the error of free runs; infinite where they diverge."""
    before, after = found.free_error, refit.fit.free_error
    if not np.isfinite(before + after):
        return np.inf
    return float(np.sqrt(max(0.0, before**2 - after**2)))


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
        error = float(np.sqrt(max(own.covariance[place, place], 0.0)))
        chi2 = own.chi2 / max(1.0, own.samples - len(own.places))
        delta = np.nan if best is None else own.criterion - best.fit.criterion
        admissible = admissible and refit.violation is None
    place = None if best is None else place_of(scores, best)
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
    words = f"{error_words(found, fit, rules)} {reason[0].upper()}{reason[1:]}."
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
    names = free_effects(fine)
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
    good = whole.innovations is None or whole.innovations.is_noise
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
