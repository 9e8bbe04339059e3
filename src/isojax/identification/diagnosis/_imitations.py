"""Two simple effects against one law of many coefficients; effects that later ones made superfluous."""

from collections.abc import Callable
from typing import Any

from ..._results import RESULTS
from ...elements import Scales
from ...models import Isolator
from ...records import Campaign
from ..fitting import Estimate
from ._admissibility import find_violation
from ._refit import Refit, bic, follows_freely, is_determined, refit_candidate, refit_from
from ._score import absent_effects, score_test

CLEARLY = 10.0
"""Difference of Schwarz's criterion that counts as clear."""

TRIED = 2
"""Partners that are refitted."""

ROOM = 1.5
"""Times its squared score, a partner may gain at most: a score is a linear step."""


def _best_addition(
    found: Estimate,
    campaign: Campaign,
    scales: Scales,
    excluded: tuple[str, ...],
    most: int,
    to_beat: Callable[[Estimate], float],
    needed: float,
    solver: Any,
    progress: Callable[[str], None],
) -> Estimate | None:
    """Add the one effect that makes a model explain as much as another.

    Args:
        found: the model to add to, fitted.
        campaign: the measurements.
        scales: magnitudes of the records.
        excluded: catalogue names that are not to be considered.
        most: coefficients that the result may have.
        to_beat: how much Schwarz's criterion falls below that of the other model.
        needed: chi2 that the addition must reach to matter.
        solver: an optimistix least-squares solver.
        progress: told a line a step.

    Returns:
        The first admissible refit that is clearly better, or None.
    """
    test = score_test(found, scales, absent_effects(found.model, scales, excluded))
    tried = 0
    for index, score in enumerate(test.scores):
        if tried == TRIED or found.chi2 - ROOM * score.z**2 > needed:
            break
        if not score.admissible:
            continue
        tried += 1
        progress(f"refit with {score.element.name} beside {found.model.elements[-1].name}")
        pair = refit_candidate(test, index, scales, solver, 20, progress)
        if (
            pair.result == RESULTS.successful
            and len(pair.places) <= most
            and to_beat(pair) > CLEARLY
            and is_determined(pair, score)
            and find_violation(pair.model, campaign.fit_records, pair.simulator.problem.quantity) is None
            and follows_freely(found, pair)
        ):
            return pair
    return None


def find_simpler_pair(
    fitted: Estimate,
    usable: list[Refit],
    campaign: Campaign,
    scales: Scales,
    solver: Any,
    progress: Callable[[str], None],
) -> str | None:
    """Say which two simpler effects explain clearly more than the best candidate, at no more coefficients.

    A search that adds one effect a time prefers a law of three coefficients that imitates two effects a
    little to either of them. Such a law has to beat the best simpler candidate and its best partner.

    Args:
        fitted: the estimate without any of them.
        usable: admissible refits, best first.
        campaign: the measurements.
        scales: magnitudes of the records.
        solver: an optimistix least-squares solver.
        progress: told a line a step.

    Returns:
        Both names in words, or None where the best candidate stands.
    """
    best = usable[0].estimate
    room = len(best.places) - len(fitted.places)
    simpler = [one for one in usable[1:] if len(one.estimate.places) - len(fitted.places) < room]
    if not simpler:
        return None
    rival = simpler[0]

    def gained(pair: Estimate) -> float:
        inflation = max(1.0, pair.chi2 / pair.dof)
        return bic(best, inflation) - bic(pair, inflation)

    progress(f"can two simpler effects do better than {usable[0].score.element.name}?")
    pair = _best_addition(
        rival.estimate,
        campaign,
        scales,
        (usable[0].score.element.name,),
        len(best.places),
        gained,
        best.chi2,
        solver,
        progress,
    )
    if pair is None:
        return None
    return f"{rival.score.element.words} and {pair.model.elements[-1].words}"


def find_superfluous(
    final: Estimate,
    names: tuple[str, ...],
    campaign: Campaign,
    scales: Scales,
    solver: Any,
    progress: Callable[[str], None],
) -> str | None:
    """Find an effect, among those added one after the other, that the final model would do better without.

    The first effect of several was named while the others were missing. It is superfluous if the model
    without it is no worse by Schwarz's criterion, or if another effect in its place is clearly better.

    Args:
        final: the final model, fitted.
        names: catalogue names of the effects to ask about, in the order in which they were added.
        campaign: the measurements.
        scales: magnitudes of the records.
        solver: an optimistix least-squares solver.
        progress: told a line a step.

    Returns:
        Its catalogue name, or None where each is needed.
    """
    for name in names:
        if final.model.element(name) is None:  # a later one contains it
            continue
        progress(f"is {name} still needed?")
        left = tuple(element for element in final.model.elements if element.name != name)
        model = Isolator(final.model.mass, left, final.model.excitation)
        without = refit_from(final, model, scales, solver, 20, progress)
        if without.result != RESULTS.successful:
            continue

        def gained(other: Estimate) -> float:
            inflation = max(1.0, min(final.chi2 / final.dof, other.chi2 / other.dof))
            return bic(final, inflation) - bic(other, inflation)

        if gained(without) >= 0.0:
            return name
        if _best_addition(
            without, campaign, scales, (name,), len(final.places), gained, final.chi2, solver, progress
        ):
            return name
    return None
