"""Candidates refitted: the model with one absent effect, everything free."""

from typing import NamedTuple

import equinox as eqx
import numpy as np
from jaxtyping import Float
from scipy import stats

from ..._parameters import list_parameters, own_parameters, replace_parameters
from ..._results import RESULTS
from ...elements import AbstractElement
from ...models import Isolator
from .._rules import Rules
from ..fitting import (
    ROUGH,
    Estimate,
    Nuisances,
    Search,
    best_nuisances,
    estimate,
    fit_by_multiple_shooting,
    one_hot,
    run_freely,
)
from ..innovations import ErrorFit
from ..jacobian import has_stiffness_scale
from ._score import Score, ScoreTest

STEP_SHARES = (1.0, 0.3, 0.03)
"""Shares of the score's linear step at which a refit may start: the first that lowers chi2."""


class Refit(NamedTuple):
    """A candidate refitted with everything free.

    Attributes:
        score: its score before.
        estimate: the refit.
        violation: what is unphysical about it, or None.
    """

    score: Score
    estimate: Estimate
    violation: str | None


def refit_candidate(test: ScoreTest, index: int, search: Search) -> Estimate:
    """Fit the model with one absent effect, everything free, from the linear step that the score gives."""
    fitted, score = test.fitted, test.scores[index]
    best: tuple[float, Isolator, Nuisances] | None = None
    places = new_places(fitted, fitted.model.with_elements(score.element))
    for share in STEP_SHARES:
        model = extended_model(fitted, score.element, share * score.strength, share * test.steps[index])
        old, new = fitted.point.nuisances, test.nuisances[index]
        motion = old.states[:, :2] + share * (new.states[:, :2] - old.states[:, :2])
        # Internal states start where the measured motion puts them.
        internal = np.zeros((motion.shape[0], model.internal_states))
        stiffness = old.stiffness + share * (new.stiffness - old.stiffness)
        segments = old.segments + share * (new.segments - old.segments)
        nuisances = Nuisances(np.hstack([motion, internal]), stiffness, segments, old.spread)
        # The columns are not needed yet, but with them the search shares the compiled code.
        directions = one_hot(model, places, [1.0] * len(places))
        point = fitted.simulator.evaluate(model, directions, nuisances)
        if point.is_finite and (best is None or point.chi2 < best[0]):
            best = (point.chi2, model, nuisances)
        if best is not None and best[0] < fitted.chi2:
            break
    if best is None:
        return fitted._replace(result=RESULTS.not_finite)
    _, model, nuisances = best
    found = estimate(fitted.simulator, model, places, rough(search, fitted), nuisances)
    if found.result in (RESULTS.successful, RESULTS.outdone) or not found.excess < fitted.excess:
        return found
    # Beside a fold the initial states that followed the steps may lie on the other branch: the measured ones
    # again.
    search.progress("the search stalled: again, from the measured states")
    again = refit_from(found, found.model, search._replace(rival=None))
    return again if again.chi2 <= found.chi2 else found


def refit_from(fitted: Estimate, model: Isolator, search: Search, far: bool = False) -> Estimate:
    """Fit a model that shares coefficients with a fitted one, everything free, from its own numbers.

    Args:
        fitted: the estimate whose records and free coefficients count.
        model: the start; elements that the estimate lacks have all their fitted kinds free.
        search: how to search.
        far: whether the start may be far off: windows of records that are left whole are then fitted first.

    Returns:
        The refit.
    """
    places, search = new_places(fitted, model), rough(search, fitted)
    if far and fitted.problem.heads:
        # Windows have a chi2 of their own, and linear steps over whole records promise nothing.
        search = search._replace(rival=None)
        model = fit_by_multiple_shooting(fitted, model, places, search)
    # The scatter of a stiffness that the fitted model lacks is still to be found.
    nuisances = None
    if has_stiffness_scale(fitted.model) == has_stiffness_scale(model):
        old = fitted.point.nuisances
        fresh = old.afresh()
        # Eliminated by one linear step from far, initial states promise a chi2 that no later step reaches.
        settled = best_nuisances(fitted.simulator, model, old.spread, fresh, places)
        nuisances = settled.nuisances if settled.is_finite else fresh
    return estimate(fitted.simulator, model, places, search, nuisances)


def rough(search: Search, fitted: Estimate) -> Search:
    """Give the search of a refit that is only ranked: with many samples smaller steps separate nothing."""
    return search._replace(tolerance=ROUGH * least_difference(fitted, search.rules))


def bic(found: Estimate, inflation: float) -> float:
    """Give Schwarz's criterion of an estimate.

    Args:
        found: the estimate.
        inflation: chi2/dof of the best model known, at least 1: what model errors add to the noise.

    Returns:
        chi2 / inflation + degrees of freedom of the nuisances + coefficients ln(samples). A phase found in
        each record counts as a coefficient.
    """
    phases = sum(element.phased for element in found.model.elements) * len(found.problem.records)
    samples = float(np.log(found.point.samples.sum()))
    taken = found.misfit - found.chi2
    return found.chi2 / inflation + taken + (len(found.places) + phases) * samples


def least_difference(found: Estimate, rules: Rules) -> float:
    """Give the difference of Schwarz's criterion up to which two effects are indistinguishable."""
    return max(rules.close_bic, rules.smallest_gain * found.dof * found.problem.thinned)


def new_places(fitted: Estimate | ErrorFit, model: Isolator) -> tuple[int, ...]:
    """Give the free coefficients of a model that shares some with a fitted one: those, and what is new."""
    known = {entry.name for entry in list_parameters(fitted.model)}
    return tuple(
        place
        for place, entry in enumerate(list_parameters(model))
        if entry.name in fitted.names or (entry.name not in known and entry.spec.fitted)
    )


def extended_model(
    fitted: Estimate | ErrorFit, element: AbstractElement, strength: float, step: np.ndarray
) -> Isolator:
    """Give the model with the effect at a strength, the fitted coefficients moved by a step."""
    own = [name for name, _ in own_parameters(element)]
    for old in fitted.model.elements:
        if old.name in element.absorbs:
            # What both have goes on; strengths of one unit are those of one law.
            shared = {name for name, _ in own_parameters(old)} & set(own)
            for name in shared - {element.strength}:
                element = eqx.tree_at(lambda e, n=name: getattr(e, n), element, getattr(old, name))
            if (
                dict(own_parameters(old))[old.strength].unit
                == dict(own_parameters(element))[element.strength].unit
            ):
                strength = max(strength, 0.0) + float(getattr(old, old.strength))
    model = fitted.model.with_elements(element)
    listed = list_parameters(model)
    numbers = [entry.value for entry in listed]
    # By name: an element that the new one takes the place of is gone, and those after it have moved up.
    place_of = {entry.name: place for place, entry in enumerate(listed)}
    for name, change in zip(fitted.names, step, strict=True):
        if name not in place_of:
            continue
        place = place_of[name]
        moved = float(numbers[place]) + float(change)
        spec = listed[place].spec
        if spec.lower < moved < spec.upper:
            numbers[place] = numbers[place] * 0.0 + moved
    fields = [name for name, _ in own_parameters(element)]
    place = len(listed) - len(fields) + fields.index(element.strength)
    numbers[place] = numbers[place] * 0.0 + strength
    return replace_parameters(model, numbers)


def refit_to_convergence(found: Estimate, search: Search) -> Estimate:
    """Take a rough refit to the end of its search, with the scatter that repeats show beside its law."""
    search.progress("the finding, fitted to the end")
    again = estimate(found.simulator, found.model, found.places, search, found.point.nuisances, anew=True)
    # With another scatter another sum is made least.
    comparable = again.point.nuisances.spread == found.point.nuisances.spread
    better = again.chi2 <= found.chi2 or not comparable
    return again if again.result == RESULTS.successful and better else found


def with_own_shape(found: Estimate, name: str, search: Search) -> Estimate:
    """Free what a finding holds of its own shape, such as the exponent of a loop, where the data ask for it.

    Else the next search would name an effect that makes up for a shape which was never fitted. Numbers of a
    computation, such as the width of a rounded corner, have no admissible interval and stay.

    Args:
        found: the finding, fitted to the end.
        name: its catalogue name.
        search: how to search.

    Returns:
        The fit with the shape free where Schwarz's criterion is clearly lower, else `found`.
    """
    listed = list_parameters(found.model)
    held = [
        place
        for place, entry in enumerate(listed)
        if entry.name.startswith(f"{name}.")
        and place not in found.places
        and np.isfinite(entry.spec.lower)
        and np.isfinite(entry.spec.upper)
    ]
    if not held:
        return found
    search.progress(f"is the shape of {name} as it was taken?")
    places = tuple(sorted((*found.places, *held)))
    freed = estimate(found.simulator, found.model, places, search, found.point.nuisances)
    inflation = freed.inflation
    clear = bic(found, inflation) - bic(freed, inflation) > search.rules.close_bic
    return freed if freed.result == RESULTS.successful and clear else found


def is_determined(found: Estimate, score: Score, rules: Rules) -> bool:
    """Say whether the trace that a refitted effect leaves in the records differs significantly from none."""
    place, name = strength_place(found, score), score.element.name
    if not found.uncertainty.determined[place]:
        return False
    own = [
        one
        for one, known in enumerate(found.uncertainty.determined)
        if known and found.names[one].startswith(f"{name}.")
    ]
    strength = float(list_parameters(found.model)[found.places[place]].value)
    error = trace_error(found.uncertainty.covariance[np.ix_(own, own)], own.index(place))
    return abs(strength) > float(stats.norm.isf(0.5 * rules.significance)) * error


def trace_error(covariance: Float[np.ndarray, "own own"], place: int) -> float:
    """Give the standard error of the size of an effect's trace, in units of its strength.

    The trace is T = s P J_s, with s the strength, J the whitened derivatives and P J what the other
    coefficients of the model cannot imitate of them: J'PJ is the inverse of the covariance. The size |T|
    changes by T'PJ/|T| with the effect's own coefficients, so that its error is 1/|P J_s|. |T| over its error
    is the same however the effect is written. A strength over its own error is not: that of a fractional
    derivative is in N s^alpha/m, and changes with alpha although the force does not.

    Args:
        covariance: of the effect's own coefficients.
        place: the strength among them.

    Returns:
        Standard error [unit of the strength].
    """
    return float(1.0 / np.sqrt(np.linalg.inv(covariance)[place, place]))


def strength_place(found: Estimate, score: Score) -> int:
    """Give the place of a candidate's strength among the free coefficients of its refit."""
    listed = [entry.name for entry in list_parameters(found.model)]
    fields = [name for name, _ in own_parameters(score.element)]
    return found.places.index(len(listed) - len(fields) + fields.index(score.element.strength))


def follows_freely(fitted: Estimate, found: Estimate) -> bool:
    """Say whether a refit still follows whole records when nothing is fed back.

    Asked only where records are left whole: an internal state that never decays can there fit a record
    from a hidden state of its own choice, and lose it from rest.

    Args:
        fitted: the estimate without the effect.
        found: the refit with it.

    Returns:
        True if the free-run error is no larger, or records are cut into segments anyway.
    """
    if not found.problem.heads:
        return True
    squares = [
        sum(float(np.sum(run.residual**2)) for run in run_freely(entry.problem, entry.model))
        for entry in (fitted, found)
    ]
    return bool(squares[1] <= squares[0])


def rivals(
    scores: tuple[Score, ...], refits: list[Refit], twins: tuple[AbstractElement, ...], names: tuple[str, ...]
) -> tuple[AbstractElement, ...]:
    """Give effects as they imitate another: refitted where they were, else with the shape of their score."""
    shapes = {score.element.name: score.element for score in scores}
    for refit in refits:
        element = refit.estimate.model.element(refit.score.element.name)
        if element is not None:
            shapes[element.name] = element
    shapes.update({twin.name: twin for twin in twins})
    return tuple(shapes[name] for name in names)
