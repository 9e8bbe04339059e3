"""The diagnosis: from a residual to the effect that the model lacks, or to the word that nothing is."""

from collections.abc import Callable
from typing import Any

import numpy as np

from .._parameters import list_parameters, own_parameters
from .._results import RESULTS
from ..elements import AbstractElement, Scales
from ._admissible import find_violation
from ._estimate import Estimate
from ._findings import Candidate, Finding, Verdict
from ._fit import DEFAULT_SOLVER, Fit, silent
from ._refit import Refit, follows_freely, is_determined, polish, refit_candidate, strength_place
from ._scales import scales as campaign_scales
from ._score import Score, ScoreTest, absent_effects, score_test
from ._separate import separating_experiment
from ._transfer import transferred_share

GOOD = 1.05
"""chi2/dof up to which a fit is good."""

LEFT_OVER = 0.03
"""Share of the first excess that may be left where the noise is small beside every model error."""

MOST_OF_IT = 0.8
"""Share of the excess that an effect must explain to be the explanation."""

SMALLEST_GAIN = 0.002
"""Gain in chi2/dof below which no effect is named: with half a million samples anything is significant."""

SMALLEST_SHARE = 0.2
"""Share of the remaining excess that an effect must explain to be named where the fit is not good."""

SURVIVORS = 4
"""Families that are refitted."""

WORTH_REFIT = 0.04
"""Linear gain, over that of the leading family, below which no shape parameter makes up the difference."""

CLOSE_BIC = 10.0
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


def diagnose(
    fit: Fit,
    *,
    first_excess: float | None = None,
    significance: float = 0.01,
    excluded: tuple[str, ...] = (),
    solver: Any = DEFAULT_SOLVER,
    max_steps: int = 40,
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
    for index, score in enumerate(test.scores):
        if len(refits) == SURVIVORS:
            break
        if not score.admissible or score.p_value > significance:
            continue
        if refits and score.z**2 < WORTH_REFIT * refits[0].score.z ** 2:
            break
        # The score says what one linear step could gain at most when the model is near; far away it only
        # ranks.
        if chi2_per_dof <= GOOD and score.z**2 / fitted.dof < SMALLEST_GAIN / 5.0:
            continue
        progress(f"refit with {score.element.name}")
        found = refit_candidate(test, index, scales, solver, max_steps, progress)
        violation = None
        if found.result != RESULTS.successful or found.excess >= fitted.excess:
            violation = "its refit did not converge"
        elif not is_determined(found, score):
            violation = "its strength is not determined"
        elif not follows_freely(fitted, found):
            violation = "its free run is worse than without it"
        else:
            violation = find_violation(found.model, fit.campaign.fit_records, fitted.bench.problem.quantity)
        refits.append(Refit(score, found, violation))
    return _judge(fit, test, refits, first, scales, significance, solver, progress)


def remaining_bounds(fit: Fit) -> dict[str, tuple[float, str]]:
    """Say how large each absent effect could still be beside a fitted model, at its typical shape.

    Args:
        fit: the fit.

    Returns:
        Upper bound of each strength and its unit, by catalogue name.
    """
    scales = campaign_scales(fit.campaign)
    # One shape an effect will do for a bound; the grids are for finding.
    typical = {probe.name: type(probe).guess(scales) for probe in absent_effects(fit.model, scales)}
    test = score_test(fit.estimate, scales, tuple(typical.values()))
    return _bounds(test, fit.estimate, None)


def _bic(found: Estimate, inflation: float) -> float:
    return found.chi2 / inflation + len(found.places) * float(np.log(found.point.samples.sum()))


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
    usable = [refit for refit in refits if refit.violation is None]
    smallest = min((refit.estimate.chi2 / refit.estimate.dof for refit in usable), default=1.0)
    inflation = max(1.0, smallest)
    usable.sort(key=lambda refit: _bic(refit.estimate, inflation))
    good = is_good(fitted.chi2 / fitted.dof, fitted.excess, first_excess)
    ranking = _ranking(test, refits, usable, inflation)
    bounds = _bounds(test, fitted, None)
    if usable:
        best = usable[0]
        gain = fitted.chi2 - best.estimate.chi2
        extra = len(best.estimate.places) - len(fitted.places)
        needed = SMALLEST_GAIN if good else max(SMALLEST_GAIN, SMALLEST_SHARE * fitted.excess / fitted.dof)
        enough = gain / fitted.dof >= needed
        clear = _bic(fitted, inflation) - _bic(best.estimate, inflation) > CLOSE_BIC
        share = transferred_share(fit, best.estimate, scales, solver, progress) if enough and clear else 0.0
        if enough and clear and share > 0.0:
            usable[0] = best._replace(estimate=polish(best.estimate, scales, solver, progress))
            return _found(fit, test, usable, ranking, first_excess, share, inflation)
        reason = (
            f"adding {best.score.element.name} gains {gain / fitted.dof:.2g} of chi2/dof for {extra} more "
            "coefficients"
            + (
                ""
                if share > 0.0 or not (enough and clear)
                else ", but it does not carry over to data left out of its refit"
            )
        )
    else:
        reason = "no absent effect is both significant and physical"
    verdict = "none" if good else "unexplained"
    words = "The fit is good and " if good else "The fit is not good, but "
    return Verdict(verdict, None, ranking, (), 1.0, test.hidden, bounds, None, words + reason + ".")


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
    explained = (fitted.chi2 - best.estimate.chi2) / max(fitted.excess, 1.0)
    together = tuple(
        entry.effect
        for entry in ranking
        if entry.effect != name
        and entry.admissible
        and (
            entry.delta_bic <= CLOSE_BIC
            or (np.isnan(entry.delta_bic) and abs(entry.likeness) > CLOSE_LIKENESS)
        )
    )
    finding = Finding(
        name,
        together,
        best.score.p_value,
        float(min(explained, 1.0)),
        share,
        ranking,
        separating_experiment(name, together),
    )
    good = is_good(best.estimate.chi2 / best.estimate.dof, best.estimate.excess, first_excess)
    if good:
        verdict = "found"
    elif explained >= MOST_OF_IT:
        verdict = "partly_explained"
    else:
        verdict = "unexplained"
    left = best.estimate.excess / max(fitted.excess, 1.0)
    before, after = fitted.chi2 / fitted.dof, best.estimate.chi2 / best.estimate.dof
    reason = f"Adding {best.score.element.words} takes chi2/dof from {before:.4g} to {after:.4g}."
    bounds = _bounds(test, fitted, name)
    return Verdict(
        verdict, finding, ranking, together, float(max(left, 0.0)), test.hidden, bounds, best.estimate, reason
    )


def _strength(element: AbstractElement) -> str:
    """Give the unit of an element's strength."""
    return dict(own_parameters(element))[element.strength].unit


def _ranking(
    test: ScoreTest, refits: list[Refit], usable: list[Refit], inflation: float
) -> tuple[Candidate, ...]:
    """List every candidate: refitted ones by evidence, then the others by score."""
    best = usable[0] if usable else None
    order = {score.element.name: index for index, score in enumerate(test.scores)}
    done = {refit.score.element.name: refit for refit in refits}
    lowest = _bic(best.estimate, inflation) if best is not None else float("nan")

    def candidate(score: Score) -> Candidate:
        refit = done.get(score.element.name)
        strength, error = score.strength, score.error
        chi2, delta, admissible = float("nan"), float("nan"), score.admissible
        if refit is not None and len(refit.estimate.places) > len(test.fitted.places):
            found = refit.estimate
            place = strength_place(found, score)
            strength = float(list_parameters(found.model)[found.places[place]].value)
            error = float(found.uncertainty.standard_error[place])
            chi2 = found.chi2 / found.dof
            delta = _bic(found, inflation) - lowest
            admissible = admissible and refit.violation is None
        likeness = (
            0.0
            if best is None
            else float(test.likeness[order[score.element.name], order[best.score.element.name]])
        )
        return Candidate(
            score.element.name,
            score.element.words,
            score.z,
            score.p_value,
            score.visibility,
            strength,
            error,
            _strength(score.element),
            chi2,
            delta,
            likeness,
            admissible,
        )

    names = [refit.score.element.name for refit in usable]
    first = [test.scores[order[name]] for name in names]
    rest = [score for score in test.scores if score.element.name not in names]
    return tuple(candidate(score) for score in (*first, *rest))


def _bounds(test: ScoreTest, fitted: Estimate, found: str | None) -> dict[str, tuple[float, str]]:
    """Say how large each effect that was not found could still be, inflated by the misfit."""
    inflation = float(np.sqrt(max(1.0, fitted.chi2 / fitted.dof)))
    return {
        score.element.name: (abs(score.strength) + 1.96 * inflation * score.error, _strength(score.element))
        for score in test.scores
        if score.element.name != found
    }
