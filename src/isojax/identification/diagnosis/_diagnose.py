"""The diagnosis: from a residual to the effect that the model lacks, or to the word that nothing is."""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

from ..._cores import in_own_threads
from ..._progress import silent
from ..._results import RESULTS, is_successful
from ...elements import CATALOGUE, AbstractElement
from .._rules import Rules
from ..fitting import (
    DEFAULT_SOLVER,
    MOST_EVALUATIONS,
    DriveNoise,
    Fit,
    Fitted,
    Search,
    as_fit,
    complete,
    drive_noise,
    lack_of_fit,
    on_all_samples,
    plain_unit,
    search_of,
    still,
    thinned,
    unlocked_tone,
    weighted_by_output,
    weighted_by_residual,
)
from ..traces import FreeTraces, SelectedLaw, matching_pursuit, trace_free_laws
from ._bounds import upper_bounds
from ._by_innovations import diagnose_innovations
from ._candidate_refits import Case, refit_candidates
from ._evidence import by_evidence, rank_candidates, ranked_first, smallest_inflation
from ._findings import Candidate, Finding, Verdict
from ._refit import Refit, bic, least_difference, refit_to_convergence, rivals, with_own_shape
from ._score import absent_effects, score_test
from ._separating_words import is_exact, separating_experiment
from ._transfer import transferred_share


class Diagnosis(NamedTuple):
    """A verdict, and what of its work serves others.

    Attributes:
        verdict: what the residual says.
        beside: traces of the free force laws beside the fit, weighted as it is; None where there are none.
    """

    verdict: Verdict
    beside: FreeTraces | None = None


def is_good(fit: Fit, rules: Rules) -> bool:
    """Say whether a fit leaves nothing worth explaining.

    Args:
        fit: the fit.
        rules: when that is so.

    Returns:
        Whether chi2/dof, by the noise that the output shows, is near one and what is left is no more locked
        to the drive than noise and the declared error of the response are.
    """
    if fit.innovations is not None:
        return fit.innovations.is_noise
    return max(_ratio(fit), fit.noise.excess) <= rules.good and not is_locked(fit, rules)


def is_locked(fit: Fit, rules: Rules) -> bool:
    """Say whether what a fit leaves comes back with every cycle of the drive."""
    return lack_of_fit(fit).p_value < rules.significance


def leaves_noise(fit: Fit, rules: Rules) -> bool:
    """Say whether nothing that a fit leaves comes back with the drive; False where no drive repeats."""
    return lack_of_fit(fit).p_value >= rules.significance


@in_own_threads
def diagnose(
    fit: Fit | Fitted,
    *,
    significance: float | None = None,
    excluded: tuple[str, ...] = (),
    solver: Any = DEFAULT_SOLVER,
    max_steps: int = MOST_EVALUATIONS,
    progress: Callable[[str], None] = silent,
    rules: Rules = Rules(),
) -> Verdict:
    """Name the effect that a fitted model lacks, with its evidence; or say that it lacks none.

    Held-out records take no part.

    Args:
        fit: the fit to diagnose.
        significance: family-wise level of the score test; `rules.significance` if omitted.
        excluded: catalogue names that are not to be considered.
        solver: an optimistix least-squares solver for the refits.
        max_steps: simulations with derivatives of a refit at most.
        progress: receives a line a step.
        rules: numbers that decide the verdict.

    Returns:
        The verdict.

    Example:
        With the fit of `fit`'s example:

        >>> verdict = ij.diagnose(fitted)
        >>> verdict.verdict, verdict.finding.effect
        ('found', 'coulomb_friction')
    """
    fit = as_fit(fit)
    search = search_of(fit.campaign, rules, solver, progress, max_steps)
    return diagnose_with(search, weighted_by_output(fit, search), significance, excluded).verdict


def diagnose_with(
    search: Search,
    fit: Fit,
    significance: float | None = None,
    excluded: tuple[str, ...] = (),
) -> Diagnosis:
    """Diagnose as `diagnose` does, with a search of the campaign that is known already.

    Args:
        search: how to search.
        fit: see `diagnose`; weighted by the noise that the output shows.
        significance: see `diagnose`.
        excluded: see `diagnose`.

    Returns:
        The diagnosis.
    """
    if not fit.estimate.point.is_finite:
        reason = f"The fit failed, so that there is nothing to diagnose. {RESULTS[fit.result]}"
        return Diagnosis(Verdict("unexplained", None, (), (), float("nan"), (), {}, None, reason))
    if fit.innovations is not None:
        return Diagnosis(diagnose_innovations(search, fit, significance, excluded))
    case = case_of(search, fit, significance, excluded)
    return weigh_refits(case, refit_candidates(case))


def case_of(
    search: Search, fit: Fit, significance: float | None = None, excluded: tuple[str, ...] = ()
) -> Case:
    """Score the absent effects beside a fit; the arguments are those of `diagnose_with`."""
    # Noise that only the residual shows imitates effects: slow noise an offset, that of a shaken base a mode.
    by_residual = weighted_by_residual(fit, search).estimate
    fitted, coarser = thinned(fit.estimate, search)
    seen = fitted if by_residual is fit.estimate else thinned(by_residual, search)[0]
    if seen.problem.thinned != fitted.problem.thinned:  # coloured noise keeps every sample
        seen, fitted, coarser = by_residual, fit.estimate, search
    probes = absent_effects(fitted.model, coarser.scales, excluded)
    search.progress(f"score test of {len({probe.name for probe in probes})} absent effects")
    return Case(
        fit,
        fitted,
        seen,
        score_test(seen, coarser, probes)._replace(fitted=fitted),
        search.rules.significance if significance is None else significance,
        coarser,
        search,
        is_good(fit, search.rules),
    )


def weigh_refits(case: Case, refits: list[Refit]) -> Diagnosis:
    """Weigh the refits, and word the verdict."""
    fitted, rules, test = case.fitted, case.rules, case.test
    inflation = smallest_inflation(by_evidence(refits, rules))
    good = case.is_good
    reason = "no absent effect is both significant and physical"
    refits = list(refits)
    while usable := by_evidence(refits, rules):
        best = usable[0]
        gain = fitted.misfit - best.estimate.misfit
        needed = max(rules.smallest_gain, _needed_share(case) * fitted.excess / case.dof, _inaccuracy(case))
        clear = bic(fitted, inflation) - bic(best.estimate, inflation) > rules.close_bic
        too_little = _too_little(best, gain, case)
        if gain / case.dof < needed or not clear:
            reason = too_little
            break
        share = transferred_share(fitted, best.estimate, case.search)
        against = "it does not carry over to data left out of its refit"
        if share > 0.0:
            ranking = rank_candidates(case.fit.estimate, test, refits, usable, inflation)
            name = best.score.element.name
            converged = refit_to_convergence(best.estimate, case.search)
            shaped = with_own_shape(converged, name, case.search)
            whole = on_all_samples(shaped, case.fit.estimate, case.search, case.finer)
            if is_successful(whole.result) and whole.misfit < case.fit.estimate.misfit:
                usable[0] = best._replace(estimate=whole)
                return Diagnosis(_verdict_of_finding(case, usable, ranked_first(ranking, usable[0]), share))
            against = "its refit to all samples did not converge"
        # What imitates the missing effect on the records of its refit alone must not hide that effect.
        reason = f"{too_little}, but {against}"
        place = next(index for index, one in enumerate(refits) if one is best)
        refits[place] = best._replace(violation=against)
    ranking = rank_candidates(case.fit.estimate, test, refits, by_evidence(refits, rules), inflation)
    bounds = upper_bounds(test, None) if good else {}
    tone = unlocked_tone(case.fit, rules)
    # Tests of all samples together overlook a law that the catalogue lacks until it is many standard errors
    # large. A free law like it does not.
    beside = trace_free_laws(case.seen, case.search) if good and tone is None else None
    law = None if beside is None else _clear_law(beside, rules)
    repeats_nothing = not good and leaves_noise(case.fit, rules)
    noise = drive_noise(case.fit, rules) if repeats_nothing else None
    verdict = "none" if (good or noise is not None) and tone is None and law is None else "unexplained"
    words = "The fit is good and " if good else "The fit is not good, but "
    if tone is not None:
        words = tone.words(plain_unit("SI unit of the output", case.fit.campaign)) + "; "
    elif law is not None:
        words = f"The fit is good, but {law.force_words} stands out of what it leaves, z = {law.z:.3g}; "
    elif repeats_nothing:
        words = _words_of_noise(case.fit, noise)
    words = f"{words}{reason}."
    said = Verdict(verdict, None, ranking, (), 1.0, test.hidden, bounds, None, words, tone, law)
    return Diagnosis(said, beside if case.seen is case.fitted else None)


def _clear_law(beside: FreeTraces, rules: Rules) -> SelectedLaw | None:
    """Give the free force law that stands out most, if it is as clear as an effect must be to be named."""
    fitted, laws = beside.fitted, matching_pursuit(beside, rules).laws
    if not laws:
        return None
    gained = laws[0].z ** 2 / fitted.inflation - math.log(fitted.point.samples.sum())
    return laws[0] if gained > rules.close_bic else None


def _words_of_noise(fit: Fit, seen: DriveNoise | None) -> str:
    """Word what exceeds the noise of the output without coming back with the drive."""
    if seen is None:
        return (
            "What exceeds the noise is not locked to the drive: the noise is larger than it was measured, or "
            "something drifts, modulates or disturbs; "
        )
    drive, output = (plain_unit(f"SI unit of the {one}", fit.campaign) for one in ("input", "output"))
    return (
        f"The drive channel carries noise of {seen.drive:.3g} {drive} rms. The simulation brings it into the "
        f"residual, whose noise is {seen.residual:.3g} {output} rms where the output has {seen.output:.3g}. "
        f"This explains chi2/dof {fit.stats.chi2 / fit.stats.dof:.3g}; "
    )


def _too_little(best: Refit, gain: float, case: Case) -> str:
    """Word what the best effect would gain: of chi2/dof where little but noise is left, else a share."""
    fitted = case.fitted
    gained = (
        f"takes {gain / case.dof:.2g} off chi2/dof"
        if case.is_good
        else f"explains {100.0 * gain / max(fitted.excess, 1.0):.2g} % of the residual beyond the noise"
    )
    extra = len(best.estimate.places) - len(fitted.places)
    more = "1 more coefficient" if extra == 1 else f"{extra} more coefficients"
    return f"adding {best.score.element.name} {gained} with {more}"


def _needed_share(case: Case) -> float:
    """Give the share of the remaining excess that an effect must explain to be named.

    Where the residual exceeds the noise every small error of the model is significant: there an effect must
    explain a good part of the excess.
    """
    return 0.0 if case.is_good else case.rules.smallest_share


def _inaccuracy(case: Case) -> float:
    """Give the chi2/dof that the declared error of the readings makes."""
    problem, accuracy = case.fitted.problem, case.fit.campaign.accuracy
    return accuracy**2 * still(problem) / case.dof


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


def _look_alikes(name: str, best: Refit, ranking: tuple[Candidate, ...], rules: Rules) -> tuple[str, ...]:
    """Give the catalogue names of the effects that these data do not distinguish from a finding."""
    return tuple(
        entry.effect
        for entry in ranking
        if entry.effect != name
        and entry.admissible
        # A law that contains the finding follows it everywhere, and was not found to say more.
        and name not in CATALOGUE[entry.effect].absorbs
        and entry.delta_bic <= least_difference(best.estimate, rules)
    )


def _verdict_of_finding(
    case: Case, usable: list[Refit], ranking: tuple[Candidate, ...], share: float
) -> Verdict:
    """Word a finding."""
    fitted, best, rules, test = case.fit.estimate, usable[0], case.rules, case.test
    name = best.score.element.name
    explained = (fitted.misfit - best.estimate.misfit) / max(fitted.excess, 1.0)
    together = _look_alikes(name, best, ranking, rules)
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
    before, after = case.fit, complete(best.estimate, case.fit.model, case.fit.campaign, case.fit.noise)
    if is_good(after, rules):
        verdict = "found"
    elif explained >= 1.0 - rules.smallest_share:
        verdict = "partly_explained"
    else:
        verdict = "unexplained"
    left = best.estimate.excess / max(fitted.excess, 1.0)
    reason = (
        f"Adding {best.score.element.words} takes chi2/dof from {_ratio(before):.4g} to {_ratio(after):.4g}."
    )
    bounds = upper_bounds(test, name) if case.is_good else {}
    return Verdict(
        verdict, finding, ranking, together, float(max(left, 0.0)), test.hidden, bounds, after, reason
    )


def _ratio(fit: Fit) -> float:
    return fit.estimate.chi2 / fit.estimate.dof  # also of a fit that failed
