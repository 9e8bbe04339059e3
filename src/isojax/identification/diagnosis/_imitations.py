"""Two simple effects against one law of many coefficients; effects that later ones made superfluous."""

from collections.abc import Callable
from typing import NamedTuple

from ..._results import RESULTS
from ...models import Isolator
from ..fitting import Estimate, Search
from ._admissibility import find_violation
from ._refit import Refit, bic, follows_freely, is_determined, refit_candidate, refit_from
from ._score import absent_effects, score_test


class Superfluous(NamedTuple):
    """An effect that a model would do better without.

    Attributes:
        effect: catalogue name.
        without: the model without it, fitted.
        is_better: whether that model is no worse by Schwarz's criterion; if not, one with another effect is.
    """

    effect: str
    without: Estimate
    is_better: bool


class _Opponent(NamedTuple):
    """The model that a smaller one with a partner must beat.

    Attributes:
        estimate: the model, fitted.
        gained: by how much Schwarz's criterion of another estimate is lower.
    """

    estimate: Estimate
    gained: Callable[[Estimate], float]


def _best_addition(found: Estimate, excluded: str, opponent: _Opponent, search: Search) -> Estimate | None:
    """Add the one effect that makes a model clearly better than another of as many coefficients."""
    rules, other = search.rules, opponent.estimate
    test = score_test(found, search, absent_effects(found.model, search.scales, (excluded,)))
    tried = 0
    for index, score in enumerate(test.scores):
        if tried == rules.survivors or found.chi2 - score.z**2 > other.chi2:
            break
        if not score.admissible:
            continue
        tried += 1
        search.progress(f"refit with {score.element.name} beside {found.model.elements[-1].name}")
        pair = refit_candidate(test, index, search)
        if (
            pair.result == RESULTS.successful
            and len(pair.places) <= len(other.places)
            and opponent.gained(pair) > rules.close_bic
            and is_determined(pair, score, search.rules)
            and find_violation(pair.model, pair.problem.records, pair.problem.quantity) is None
            and follows_freely(found, pair)
        ):
            return pair
    return None


def find_simpler_pair(fitted: Estimate, usable: list[Refit], search: Search) -> str | None:
    """Say which two simpler effects explain clearly more than the best candidate, at no more coefficients.

    A search that adds one effect a time prefers a law of three coefficients that imitates two effects a
    little to either of them. Such a law has to beat the best simpler candidate and its best partner.
    """
    best = usable[0].estimate
    room = len(best.places) - len(fitted.places)
    simpler = [one for one in usable[1:] if len(one.estimate.places) - len(fitted.places) < room]
    if not simpler:
        return None
    rival = simpler[0]

    def gained(pair: Estimate) -> float:
        inflation = pair.inflation
        return bic(best, inflation) - bic(pair, inflation)

    name = usable[0].score.element.name
    search.progress(f"can two simpler effects do better than {name}?")
    pair = _best_addition(rival.estimate, name, _Opponent(best, gained), search)
    if pair is None:
        return None
    return f"{rival.score.element.words} and {pair.model.elements[-1].words}"


def find_superfluous(final: Estimate, names: tuple[str, ...], search: Search) -> Superfluous | None:
    """Find an effect, among those added one after the other, that the final model would do better without.

    The first effect of several was named while the others were missing. It is superfluous if the model
    without it is no worse by Schwarz's criterion, or if another effect in its place is clearly better.

    Args:
        final: the final model, fitted.
        names: catalogue names of the effects to ask about, in the order in which they were added.
        search: how to search.

    Returns:
        The effect, or None where each is needed.
    """
    for name in names:
        if final.model.element(name) is None:  # a later one contains it
            continue
        search.progress(f"is {name} still needed?")
        left = tuple(element for element in final.model.elements if element.name != name)
        model = Isolator(final.model.mass, left, final.model.excitation)
        without = refit_from(final, model, search)
        if without.result != RESULTS.successful:
            continue

        def gained(other: Estimate) -> float:
            inflation = min(final.inflation, other.inflation)
            return bic(final, inflation) - bic(other, inflation)

        if gained(without) >= 0.0 or _best_addition(without, name, _Opponent(final, gained), search):
            return Superfluous(name, without, gained(without) >= 0.0)
    return None
