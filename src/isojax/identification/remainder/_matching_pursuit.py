"""Matching pursuit: what force laws, named nowhere, would make up what a fitted model leaves."""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from scipy import stats

from ..._parameters import list_parameters, replace_parameters
from ..._results import is_successful
from ...models import Isolator
from .._rules import Rules
from ..diagnosis import Projection, project, refit_from
from ..fitting import Estimate, Search, silent
from ._free_laws import AbstractFreeForce, free_laws


class PursuedLaw(NamedTuple):
    """One law of the pursuit.

    Attributes:
        formula: such as "|x| v".
        words: what kind of force it is.
        coefficient: what stands before the formula, all pursued laws together [unit].
        error: its standard error, times sqrt(chi2/dof) where that exceeds one [unit].
        unit: unit of the coefficient.
        force: its size at the largest motion [N].
        z: score when it was taken, in standard deviations of the noise.
        share: share of the excess that the laws up to this one remove, by the linear step; 1 at most.
        alike: formulas of laws whose traces are more than 0.95 alike, nearest first.
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


class Pursuit(NamedTuple):
    """What force laws would make up what a fitted model leaves.

    Attributes:
        laws: largest first; empty where nothing stands out of the noise.
        tried: how many laws were held against the remainder.
        chi2_per_dof: of the fit.
        linear: the same with the laws, by the linear step.
        refitted: the same with everything fitted again; NaN where that was not asked for or failed.
    """

    laws: tuple[PursuedLaw, ...]
    tried: int
    chi2_per_dof: float
    linear: float
    refitted: float


class _Taken(NamedTuple):
    place: int
    z: float
    gain: float
    alike: tuple[int, ...]


def _pursue(
    traces: Projection, ranks: Float[np.ndarray, " law"], fitted: Estimate, rules: Rules
) -> tuple[_Taken, ...]:
    """Take the laws one after the other, each projected out of what is left."""
    information, score = traces.information.copy(), traces.score.copy()
    whole = np.diag(traces.information).copy()
    free = traces.visibility > rules.smallest_visibility
    chi2, dof = fitted.chi2, fitted.dof
    excess, tests = max(chi2 - dof, 1.0), max(1, int(free.sum()))
    taken: list[_Taken] = []
    while len(taken) < rules.pursuit_laws and np.any(free):
        own = np.diag(information)
        # What the laws taken before leave of a trace, as what the coefficients leave.
        free &= own > 1e-3 * whole
        if not np.any(free):
            break
        gains = np.where(free, score**2 / np.where(free, own, 1.0), 0.0)
        inflation = max(1.0, chi2 / dof)
        best = int(np.argmax(gains))
        tie = max(rules.close_bic * inflation, rules.pursuit_tie * gains[best])
        close = free & (gains >= gains[best] - tie)
        order = np.lexsort((-gains, np.where(close, ranks, np.inf)))
        place = int(order[0])
        gain = float(gains[place])
        chance = tests * 2.0 * stats.norm.sf(np.sqrt(gain / inflation))
        smallest = max(rules.pursuit_share * excess, rules.smallest_gain * dof)
        if chance > rules.pursuit_significance or gain < smallest:
            break
        size = np.sqrt(np.where(free, own, np.inf))
        likeness = np.abs(information[place]) / (size * size[place])
        near = np.argsort(-likeness)
        alike = tuple(int(k) for k in near if likeness[k] > rules.close_likeness and k != place)
        taken.append(_Taken(place, float(score[place] / size[place]), gain, alike))
        column = information[:, place].copy()
        score = score - column * score[place] / column[place]
        information = information - np.outer(column, column) / column[place]
        free[place] = False
        chi2 -= gain
    return tuple(taken)


def pursue_laws(fitted: Estimate, search: Search, *, refit: bool) -> Pursuit:
    """Make up what a fit leaves from free force laws: orthogonal matching pursuit on exact columns.

    The law of the largest score is taken and projected out of the residual and of all other laws, as the
    fitted coefficients were, until nothing stands out. Of laws that the data do not tell apart the plainest
    is taken.

    Args:
        fitted: the estimate.
        search: how to search.
        refit: whether to fit everything again with the laws, to say what the linear step is worth.

    Returns:
        The laws.

    Source: Pati, Rezaiifar & Krishnaprasad 1993 (orthogonal matching pursuit).
    """
    laws = free_laws(search.scales)
    search.progress(f"pursuit among {len(laws)} free force laws")
    units = np.array([1e-3 * law.typical_strength(search.scales) for law in laws])
    traces = project(fitted, laws, units)
    wordings = [law.wording() for law in laws]
    taken = _pursue(traces, np.array([one.rank for one in wordings]), fitted, search.rules)
    chi2_per_dof = fitted.chi2 / fitted.dof
    if not taken:
        return Pursuit((), len(laws), chi2_per_dof, chi2_per_dof, float("nan"))
    places = [one.place for one in taken]
    inverse = np.linalg.inv(traces.information[np.ix_(places, places)])
    amount = inverse @ traces.score[places]
    left = fitted.chi2 - sum(one.gain for one in taken)
    linear = left / (fitted.dof - len(taken))
    error = np.sqrt(np.diag(inverse) * max(1.0, linear))
    found, gone = [], 0.0
    for one, strength, spread in zip(taken, amount, error, strict=True):
        gone += one.gain
        words, unit = wordings[one.place], float(units[one.place])
        found.append(
            PursuedLaw(
                words.formula,
                words.words,
                float(strength * unit * words.factor),
                float(spread * unit * words.factor),
                words.unit,
                float(strength * unit),
                one.z,
                min(1.0, float(gone / max(fitted.excess, 1.0))),
                tuple(wordings[place].formula for place in one.alike),
            )
        )
    again = float("nan")
    if refit:
        search.progress("refit with " + ", ".join(law.formula for law in found))
        chosen = [
            eqx.tree_at(lambda e: getattr(e, e.strength), laws[place], jnp.asarray(float(strength)))
            for place, strength in zip(places, amount * units[places], strict=True)
        ]
        step = traces.step[:, -1] - traces.step[:, places] @ amount
        again = _refitted(fitted, chosen, step, search)
    return Pursuit(tuple(found), len(laws), chi2_per_dof, float(linear), again)


def _refitted(
    fitted: Estimate, laws: list[AbstractFreeForce], step: Float[np.ndarray, " coefficient"], search: Search
) -> float:
    """Give chi2/dof with the laws, everything free, from a step of the coefficients."""
    model = Isolator(fitted.model.mass, (*fitted.model.elements, *laws), fitted.model.excitation)
    listed = list_parameters(model)
    numbers = [entry.value for entry in listed]
    for place, change in zip(fitted.places, step, strict=True):
        moved = float(numbers[place]) + float(change)
        if listed[place].spec.lower < moved < listed[place].spec.upper:
            numbers[place] = numbers[place] + float(change)
    search = search._replace(max_steps=search.rules.description_evaluations, progress=silent)
    found = refit_from(fitted, replace_parameters(model, numbers), search)
    return found.chi2 / found.dof if is_successful(found.result) and np.isfinite(found.chi2) else float("nan")
