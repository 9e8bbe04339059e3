"""Which absent effects are refitted, and what speaks against each refit."""

from typing import NamedTuple

from scipy import stats

from ..._results import RESULTS
from .._rules import Rules
from ..fitting import Estimate, Fit, Rival, Search
from ..guess import find_balance_start
from ._admissibility import find_violation
from ._evidence import by_evidence
from ._imitations import find_simpler_pair
from ._refit import Refit, follows_freely, is_determined, least_difference, refit_candidate, refit_from
from ._score import Score, ScoreTest


class Case(NamedTuple):
    """A fit under diagnosis.

    Attributes:
        fit: the fit.
        fitted: its estimate, on as many samples as the candidates are tried on.
        seen: the same, weighted by the noise that the residual shows.
        test: scores of the absent effects.
        significance: family-wise level of the score test.
        search: how to search among the candidates.
        finer: how to search on all samples.
        is_good: whether the fit leaves nothing worth explaining.
    """

    fit: Fit
    fitted: Estimate
    seen: Estimate
    test: ScoreTest
    significance: float
    search: Search
    finer: Search
    is_good: bool

    @property
    def rules(self) -> Rules:
        """The numbers that decide."""
        return self.search.rules

    @property
    def dof(self) -> float:
        """Degrees of freedom of the fit, of which the rules speak."""
        return self.fit.estimate.dof


def refit_candidates(case: Case) -> list[Refit]:
    """Refit the absent effects that are worth it, strongest score first.

    Args:
        case: the fit under diagnosis.

    Returns:
        The refits, in the order in which they were made, with what speaks against each.
    """
    refits = [] if case.is_good else _refit_from_balance(case)
    # A start from the balance that came to nothing takes no place of an effect that the scores ask for.
    most = case.rules.survivors + sum(one.violation is not None for one in refits)
    for index, score in enumerate(case.test.scores):
        if len(refits) == most:
            break
        known = {one.score.column for one in refits}
        if score.admissible and score.p_value <= case.significance and score.column not in known:
            refits.append(_refit(case, index, refits))
    return _without_imitations(case, refits)


def _refit(case: Case, index: int, refits: list[Refit]) -> Refit:
    """Refit a candidate, beside those that were refitted before."""
    score = case.test.scores[index]
    case.search.progress(f"refit with {score.element.name}")
    search = case.search._replace(rival=_rival(refits, case.rules))
    found = refit_candidate(case.test, index, search)
    return Refit(score, found, _violation(case, found, score))


def _rival(refits: list[Refit], rules: Rules) -> Rival | None:
    """Give what a further candidate must not stay far behind."""
    best = min(
        (one.estimate for one in refits if one.violation is None), key=lambda one: one.chi2, default=None
    )
    if best is None:
        return None
    return Rival(best.chi2, least_difference(best, rules))


def _violation(case: Case, found: Estimate, score: Score) -> str | None:
    """Say what speaks against a refit, whatever it gains."""
    fitted = case.fitted
    if found.result == RESULTS.outdone:
        return "its search came no nearer to that of another effect"
    if found.result != RESULTS.successful or found.excess >= fitted.excess:
        return "its refit did not converge"
    if not is_determined(found, score, case.rules):
        return "what it leaves in the records is not determined"
    element = found.model.element(score.element.name)
    if element is not None and not element.signed and float(getattr(element, element.strength)) < 0.0:
        return "its refit ends at a strength below zero"
    if not follows_freely(fitted, found):
        return "its free run is worse than without it"
    return find_violation(found.model, fitted.problem.records, fitted.problem.quantity)


def _refit_from_balance(case: Case) -> list[Refit]:
    """Refit the effect that the balance of measured forces asks for, if there is one.

    A score is a derivative at the fit, the balance is not. Where the fit is near the records and the balance
    is not, its search is given up as one that stays behind.
    """
    fit, fitted, test, search = case.fit, case.fitted, case.test, case.search
    absent = tuple(score.element for score in test.scores)
    start = find_balance_start(fit.campaign, fit.model, search.scales, absent)
    if start is None:
        return []
    search.progress(f"refit with {start.element.name}, from the balance of measured forces")
    rival = Rival(fitted.chi2, least_difference(fitted, case.rules))
    found = refit_from(fitted, start.model, search._replace(rival=rival), far=True)
    score = next(one for one in test.scores if one.element.name == start.element.name)
    # Far from the records the score has no say in the sign; the likelihood ratio stands for its p-value.
    drop = max(0.0, fitted.chi2 - found.chi2) / found.inflation
    extra = max(1, len(found.places) - len(fitted.places))
    p_value = float(min(1.0, len(absent) * stats.chi2.sf(drop, extra)))
    score = score._replace(element=start.element, p_value=p_value, admissible=True)
    return [Refit(score, found, _violation(case, found, score))]


def _without_imitations(case: Case, refits: list[Refit]) -> list[Refit]:
    """Strike out a best candidate that two simpler effects outdo, until the best stands."""
    refits = list(refits)
    while True:
        usable = by_evidence(refits, case.rules)
        if not usable:
            return refits
        pair = find_simpler_pair(case.fitted, usable, case.search)
        if pair is None:
            return refits
        place = next(index for index, one in enumerate(refits) if one is usable[0])
        refits[place] = usable[0]._replace(violation=f"{pair} explain more with as many coefficients")
