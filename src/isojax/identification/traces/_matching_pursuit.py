"""Matching pursuit: which force laws outside the catalogue would explain what a fitted model leaves."""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from scipy import stats

from ..._parameters import list_parameters, replace_parameters
from ..._show import Row, amount, shown
from ...models import Isolator
from .._rules import Rules
from ..fitting import Estimate
from ._free_traces import FreeTraces
from ._projection import Projection


@shown
class SelectedLaw(NamedTuple):
    """One selected law.

    Attributes:
        formula: such as "|x| v".
        words: what kind of force it is.
        coefficient: factor before the formula, estimated together with the other laws [unit].
        error: its standard error, times sqrt(chi2/dof) where that exceeds one [unit].
        unit: unit of the coefficient.
        force: its size at the largest motion [N].
        z: score when it was selected, in standard deviations of the noise.
        share: share of the excess that the laws up to this one remove, by the linear step; 1 at most, NaN
            where chance explains the excess.
        alike: formulas of laws that would remove most of the same, nearest first: all but `smallest_share`.
    """

    formula: str
    words: str
    coefficient: float
    error: float
    unit: str
    force: float
    z: float
    share: float
    alike: tuple[str, ...]

    @property
    def force_words(self) -> str:
        """What acts, such as "a force |x| v"."""
        return "a constant force" if self.formula == "1" else f"a force {self.formula}"

    def _headline(self) -> str:
        return f"{self.formula}, {amount(self.coefficient, self.unit, self.error)}, {self.words}"


@shown
class MatchingPursuit(NamedTuple):
    """Force laws that would explain what a fitted model leaves.

    Attributes:
        laws: in the order of their selection; empty where none is significant.
        tried: how many laws were tested; 0 where what is left is no force.
        chi2_per_dof: of the fit.
        linear: the same with the laws, by the linear step.
        refitted: the same after a refit of all coefficients; NaN where none was asked for or it failed.
        model: the isolator with the laws, coefficients by the linear step.
    """

    laws: tuple[SelectedLaw, ...]
    tried: int
    chi2_per_dof: float
    linear: float
    refitted: float
    model: Isolator

    def _headline(self) -> str:
        found = f"{len(self.laws)} of {self.tried} force laws stand out of the noise"
        return f"{found}, χ²/dof {self.chi2_per_dof:.4g} without and {self.linear:.4g} with them"

    def _rows(self) -> list[Row]:
        return [
            Row(one.formula, amount(one.coefficient, one.unit, one.error), one.words) for one in self.laws
        ]


class _Selection(NamedTuple):
    place: int
    z: float
    gain: float
    alike: tuple[int, ...]


def _select(
    traces: Projection, ranks: Float[np.ndarray, " law"], fitted: Estimate, rules: Rules
) -> tuple[_Selection, ...]:
    """Select laws one after the other, each projected out of the residual and of the other laws."""
    information, score = traces.information.copy(), traces.score.copy()
    whole = np.diag(traces.information).copy()
    free = traces.visibility > rules.smallest_visibility
    chi2, dof = fitted.chi2, fitted.dof
    excess, tests = max(chi2 - dof, 1.0), max(1, int(free.sum()))
    selected: list[_Selection] = []
    while np.any(free):
        own = np.diag(information)
        # A law that the selected ones imitate counts as unseen, like one that the coefficients imitate.
        free &= own > rules.smallest_visibility**2 * whole
        if not np.any(free):
            break
        gains = np.where(free, score**2 / np.where(free, own, 1.0), 0.0)
        inflation = max(1.0, chi2 / dof)
        best = int(np.argmax(gains))
        tie = max(rules.close_bic * inflation, rules.smallest_law * gains[best])
        close = free & (gains >= gains[best] - tie)
        order = np.lexsort((-gains, np.where(close, ranks, np.inf)))
        place = int(order[0])
        gain = float(gains[place])
        chance = tests * 2.0 * stats.norm.sf(np.sqrt(gain / inflation))
        smallest = max(rules.smallest_law * excess, rules.smallest_gain * dof * fitted.problem.thinned)
        if chance > rules.significance or gain < smallest:
            break
        size = np.sqrt(np.where(free, own, np.inf))
        likeness = np.abs(information[place]) / (size * size[place])
        near = np.argsort(-likeness)
        # The share of this gain that another law in its place would leave.
        left = 1.0 - likeness**2
        alike = tuple(int(k) for k in near if left[k] <= rules.smallest_share and k != place)
        selected.append(_Selection(place, float(score[place] / size[place]), gain, alike))
        column = information[:, place].copy()
        score = score - column * score[place] / column[place]
        information = information - np.outer(column, column) / column[place]
        free[place] = False
        chi2 -= gain
    return tuple(selected)


def no_laws(fitted: Estimate, tried: int = 0) -> MatchingPursuit:
    """Give the pursuit of an estimate of which no law was selected."""
    chi2_per_dof = fitted.chi2 / fitted.dof
    return MatchingPursuit((), tried, chi2_per_dof, chi2_per_dof, float("nan"), fitted.model)


def matching_pursuit(beside: FreeTraces, rules: Rules) -> MatchingPursuit:
    """Select free force laws that explain what a fit leaves: orthogonal matching pursuit on exact columns.

    The law of the largest score is selected and projected out of the residual and of all other laws, as the
    fitted coefficients were, until none is significant. Of laws that the data do not distinguish the plainest
    is selected.

    Args:
        beside: the laws beside the fit.
        rules: which laws stand out of the noise.

    Returns:
        The laws, not refitted.

    Source: Pati, Rezaiifar & Krishnaprasad 1993 (orthogonal matching pursuit).
    """
    fitted, laws, units, traces = beside
    wordings = [law.wording() for law in laws]
    selected = _select(traces, np.array([one.rank for one in wordings]), fitted, rules)
    if not selected:
        return no_laws(fitted, len(laws))
    chi2_per_dof = fitted.chi2 / fitted.dof
    places = [one.place for one in selected]
    inverse = np.linalg.inv(traces.information[np.ix_(places, places)])
    amount = inverse @ traces.score[places]
    linear = (fitted.chi2 - sum(one.gain for one in selected)) / (fitted.dof - len(selected))
    error = np.sqrt(np.diag(inverse) * max(1.0, linear))
    exceeds = stats.chi2.sf(fitted.chi2, fitted.dof) < rules.significance
    described, removed = [], 0.0
    for one, strength, spread in zip(selected, amount, error, strict=True):
        removed += one.gain
        words, unit = wordings[one.place], float(units[one.place])
        described.append(
            SelectedLaw(
                words.formula,
                words.words,
                float(strength * unit * words.factor),
                float(spread * unit * words.factor),
                words.unit,
                float(strength * unit),
                one.z,
                min(1.0, float(removed / fitted.excess)) if exceeds else float("nan"),
                tuple(wordings[place].formula for place in one.alike),
            )
        )
    chosen = [
        eqx.tree_at(lambda e: getattr(e, e.strength), laws[place], jnp.asarray(float(strength)))
        for place, strength in zip(places, amount * units[places], strict=True)
    ]
    step = traces.step[:, -1] - traces.step[:, places] @ amount
    model = Isolator(fitted.model.mass, (*fitted.model.elements, *chosen), fitted.model.excitation)
    listed = list_parameters(model)
    numbers = [entry.value for entry in listed]
    for place, change in zip(fitted.places, step, strict=True):
        moved = float(numbers[place]) + float(change)
        if listed[place].spec.lower < moved < listed[place].spec.upper:
            numbers[place] = numbers[place] + float(change)
    model = replace_parameters(model, numbers)
    return MatchingPursuit(tuple(described), len(laws), chi2_per_dof, float(linear), float("nan"), model)
