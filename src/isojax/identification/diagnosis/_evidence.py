"""What ranks the refits of candidates: evidence, and simplicity where it does not decide."""

from ..._parameters import list_parameters
from .._rules import Rules
from ..fitting import Estimate, chi2_per_dof_of_all
from ._bounds import strength_unit
from ._findings import Candidate
from ._refit import Refit, bic, least_difference, strength_place
from ._score import Score, ScoreTest


def by_evidence(refits: list[Refit], rules: Rules) -> list[Refit]:
    """List the refits that nothing speaks against, best first.

    Of those that these data do not distinguish, the one with the fewest coefficients goes first; of as many,
    the one with the fewest internal states, and then the one that the criterion puts first.
    """
    usable = [refit for refit in refits if refit.violation is None]
    if not usable:
        return usable
    inflation = smallest_inflation(usable)
    usable = sorted(usable, key=lambda refit: bic(refit.estimate, inflation))
    most = bic(usable[0].estimate, inflation) + least_difference(usable[0].estimate, rules)
    tied = (one for one in usable if bic(one.estimate, inflation) <= most)
    first = min(tied, key=lambda refit: (len(refit.estimate.places), refit.estimate.model.internal_states))
    return [first, *(one for one in usable if one is not first)]


def smallest_inflation(usable: list[Refit]) -> float:
    """Give what model errors add to the noise at least.

    Args:
        usable: refits that nothing speaks against.

    Returns:
        The smallest chi2/dof among them, at least 1.
    """
    return min((refit.estimate.inflation for refit in usable), default=1.0)


def rank_candidates(
    whole: Estimate, test: ScoreTest, refits: list[Refit], usable: list[Refit], inflation: float
) -> tuple[Candidate, ...]:
    """List every candidate: refitted ones by evidence, then the others by score.

    Args:
        whole: the fit under diagnosis, on all samples.
        test: the score test.
        refits: the refits.
        usable: those that nothing speaks against, best first.
        inflation: see `smallest_inflation`.

    Returns:
        The candidates.
    """
    best = usable[0] if usable else None
    order = {score.element.name: index for index, score in enumerate(test.scores)}
    done = {refit.score.element.name: refit for refit in refits}
    lowest = bic(best.estimate, inflation) if best is not None else float("nan")

    def candidate(score: Score) -> Candidate:
        refit = done.get(score.element.name)
        score = score if refit is None else refit.score
        strength, error = score.strength, score.error
        chi2, delta, admissible = float("nan"), float("nan"), score.admissible
        if refit is not None and len(refit.estimate.places) > len(test.fitted.places):
            found = refit.estimate
            strength, error = _strength(refit)
            chi2 = chi2_per_dof_of_all(found.chi2 / found.dof, test.fitted, whole)
            delta = bic(found, inflation) - lowest
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
            strength_unit(score.element),
            chi2,
            delta,
            likeness,
            admissible,
        )

    names = [refit.score.element.name for refit in usable]
    first = [test.scores[order[name]] for name in names]
    rest = [score for score in test.scores if score.element.name not in names]
    return tuple(candidate(score) for score in (*first, *rest))


def ranked_first(ranking: tuple[Candidate, ...], final: Refit) -> tuple[Candidate, ...]:
    """Give a ranking whose first candidate has the figures of its last fit.

    Args:
        ranking: the candidates.
        final: the first of them, fitted to the end.

    Returns:
        The ranking.
    """
    strength, error = _strength(final)
    chi2 = final.estimate.chi2 / final.estimate.dof
    first = ranking[0]._replace(strength=strength, strength_error=error, chi2_per_dof=chi2)
    return (first, *ranking[1:])


def _strength(refit: Refit) -> tuple[float, float]:
    """Give a refitted strength and its standard error [its unit]."""
    found = refit.estimate
    place = strength_place(found, refit.score)
    value = list_parameters(found.model)[found.places[place]].value
    return float(value), float(found.uncertainty.standard_error[place])
