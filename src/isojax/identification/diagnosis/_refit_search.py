"""Which absent effects are refitted: what measured forces and scores ask for, and what looks like it."""

import numpy as np
from scipy import stats

from ...elements import CATALOGUE
from ...models import Isolator
from ..fitting import Fit, Search
from ..guess import balance_starts
from ..innovations import ErrorFit
from ._effect_search import Refit, Score, Scores, coefficients, refit_effect
from ._separating_words import is_exact

CHANNELS = ("The drive and the floor", "The response channel")
"""Groups of effects that are no laws of the isolator: they have a share of the refits of their own."""

_BALANCED = 3
"""Effects that are refitted because the measured forces balance best with them."""

MOST_INTERNAL = 4
"""Internal states of a model that is refitted: the filter's covariance grows with their square."""


def seek_refits(found: ErrorFit, fit: Fit, scores: Scores, search: Search) -> list[Refit]:
    """Refit the effects that may explain what a model leaves.

    Args:
        found: the model and the sizes of its errors.
        fit: the fit that they belong to.
        scores: of all absent effects.
        search: how to search.

    Returns:
        The refits, in the order in which they were made.
    """
    seeking = _RefitSearch(found, fit, scores, search)
    asked = seeking.by_balance()
    seeking.by_scores(asked)
    seeking.look_alikes()
    return seeking.refits


def place_of(scores: Scores, refit: Refit) -> int:
    """Give the place of a refitted effect among the scores, of which there is one a name."""
    names = [one.element.name for one in scores.scores]
    return names.index(refit.score.element.name)


def free_effects(fit: ErrorFit) -> set[str]:
    """Give the catalogue names of the effects whose strength is fitted."""
    return {name for name, kind in CATALOGUE.items() if f"{name}.{kind.strength}" in fit.names}


class _RefitSearch:
    """A search among absent effects; `refits` are those that it made."""

    def __init__(self, found: ErrorFit, fit: Fit, scores: Scores, search: Search):
        self.refits: list[Refit] = []
        self._found, self._fit, self._scores, self._search = found, fit, scores, search
        self._rules, self._begins = search.rules, dict[str, Isolator]()
        self._most = MOST_INTERNAL - found.model.internal_states

    def by_balance(self) -> list[Score]:
        """Refit the effects with which measured forces balance far better than without.

        Returns:
            The scores of what is still to be refitted, largest first.
        """
        found, scores = self._found, self._scores.scores
        asked = [
            score
            for score in scores
            if score.admissible
            and abs(score.pull) > self._least_pull()
            and score.element.internal_states <= self._most
        ]
        if found.is_noise:
            return asked
        held = {element.name for element in found.model.elements}
        absent = tuple(
            one
            for one in self._scores.probes
            if one.group not in CHANNELS
            and one.internal_states <= self._most
            and held.isdisjoint(one.absorbs)
        )
        scored = {score.element.name: score for score in scores}
        starts = balance_starts(self._fit.campaign, found.model, absent)
        starts = [one for one in starts if one.element.name in scored]
        most = self._rules.unbalanced * starts[0].unexplained if starts else np.inf
        near = [one for one in starts if one.unexplained <= most]
        self._begins = {one.element.name: one.model for one in near if one.helps}
        if not starts or starts[0].before <= most:
            return asked  # forces that balance without any effect tell none apart
        for start in near[:_BALANCED]:
            asked = [one for one in asked if one.element.name != start.element.name]
            if self._refit(scored[start.element.name], far=True):
                return []
        best = self._best()
        if best is None:
            return asked
        far = {one.element.name for one in starts} - {one.element.name for one in near}
        # Integrals of a measured motion err, and a law may make up for that: the scores must agree.
        stands_out = abs(best.score.pull)
        return [one for one in asked if one.element.name not in far or abs(one.pull) > stands_out]

    def by_scores(self, asked: list[Score]) -> None:
        """Refit effects until one explains everything."""
        left = {True: self._rules.survivors // 2, False: self._rules.survivors}
        while asked := [
            one for one in asked if left[one.element.group in CHANNELS] and self._is_hopeful(one)
        ]:
            # Of those that stand out about as much the plainest goes first: it may do.
            near = [one for one in asked if abs(one.pull) > self._rules.about_as_large * abs(asked[0].pull)]
            plainest = min(
                near, key=lambda one: (coefficients(self._found, one), one.element.internal_states)
            )
            asked = [one for one in asked if one is not plainest]
            left[plainest.element.group in CHANNELS] -= 1
            if self._refit(plainest):
                break

    def look_alikes(self) -> None:
        """Refit what may explain as much as the best: the records hardly tell it from that."""
        best = self._best()
        if best is None:
            return
        name, free = best.score.element.name, free_effects(best.fit)
        done = {place_of(self._scores, one) for one in self.refits}
        alike = _look_alikes(name)
        for place, score in enumerate(self._scores.scores):
            other = score.element.name
            near = other in alike or abs(best.score.likeness[place]) > self._rules.likeness
            few = score.element.internal_states <= self._most
            # Where a law leaves nothing but noise one with more coefficients cannot be told from it, unless
            # they would be one law if what is known beside them were not.
            twin = is_exact(name, other, set(CATALOGUE)) and not is_exact(name, other, free)
            told = not best.explains or twin or coefficients(self._found, score) <= len(best.fit.places)
            wanted = near and few and told and place not in done
            if wanted and score.admissible and self._is_hopeful(score):
                self._refit(score)

    def _refit(self, score: Score, far: bool = False) -> bool:
        """Refit an effect; say whether it leaves nothing but noise."""
        self._search.progress(f"refit with {score.element.name}")
        best = self._best()
        rival = np.inf if best is None else best.fit.criterion
        begin = self._begins.get(score.element.name)
        self.refits.append(refit_effect(self._found, score, self._search, begin, far, rival))
        return self.refits[-1].violation is None and self.refits[-1].explains

    def _best(self) -> Refit | None:
        sound = [one for one in self.refits if one.violation is None]
        return min(sound, key=lambda one: one.fit.criterion, default=None)

    def _is_hopeful(self, score: Score) -> bool:
        """Say whether an effect's score is not small beside that of the best refit."""
        best = self._best()
        if best is None or best.fit.criterion > self._found.criterion:
            return True
        return score.pull**2 >= self._rules.hopeless * best.score.pull**2

    def _least_pull(self) -> float:
        """Give the score below which chance explains the largest of so many."""
        return float(stats.norm.isf(0.5 * 0.05 / max(1, len(self._scores.scores))))


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
