"""The range of force laws that would do in the place of what was found."""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from ..._parameters import list_parameters, replace_parameters
from ..._show import Row, amount, shown
from ...models import Isolator
from .._rules import Rules
from ..diagnosis import least_difference
from ..fitting import Estimate
from ..traces import AbstractFreeForce, FreeTraces

SAME_TRACE = 1e-6
"""Distance of a correlation from one that rounding explains."""


@shown
class AlternativeLaw(NamedTuple):
    """A force law that explains the records as well as a finding does.

    Attributes:
        formula: such as "|x| v".
        words: what kind of force it is.
        coefficient: factor before the formula [unit].
        error: its standard error, times sqrt(chi2/dof) where that exceeds one [unit].
        unit: unit of the coefficient.
        delta_chi2: chi2 with the law less chi2 with the findings, over max(chi2/dof, 1); below zero where
            the law explains more.
        likeness: correlation of its trace in the records with that of the findings, the other coefficients
            free; 1 for the same law.
        model: the isolator with the law in the place of the findings, coefficients by one linear step.
    """

    formula: str
    words: str
    coefficient: float
    error: float
    unit: str
    delta_chi2: float
    likeness: float
    model: Isolator

    @property
    def is_the_same(self) -> bool:
        """Whether the records show no difference from the findings themselves."""
        return abs(self.likeness) > 1.0 - SAME_TRACE

    def _headline(self) -> str:
        return f"{self.formula}, {amount(self.coefficient, self.unit, self.error)}, χ² {self.delta_chi2:+.3g}"


@shown
class Alternatives(NamedTuple):
    """The range of force laws that explain the records as well as findings do.

    Attributes:
        effects: catalogue names of the findings that each law stands for.
        laws: the laws, best first; empty where none does as well.
        tried: how many laws were tried.
        margin: difference of chi2, over max(chi2/dof, 1), up to which a law does as well.
    """

    effects: tuple[str, ...]
    laws: tuple[AlternativeLaw, ...]
    tried: int
    margin: float

    @property
    def better(self) -> AlternativeLaw | None:
        """The law that explains clearly more than the findings; None where none does."""
        return self.laws[0] if self.laws and self.laws[0].delta_chi2 < -self.margin else None

    def _headline(self) -> str:
        named = " and ".join(self.effects)
        return f"{len(self.laws)} of {self.tried} force laws explain the records as well as {named}"

    def _rows(self) -> list[Row]:
        return [
            Row(one.formula, amount(one.coefficient, one.unit, one.error), one.words) for one in self.laws
        ]


def find_alternatives(beside: FreeTraces, effects: tuple[str, ...], rules: Rules) -> tuple[Alternatives, ...]:
    """List the force laws that would do in the place of each finding, and of all findings together.

    A name says one law. Others leave the same trace in the records: another power, or a law that the
    catalogue does not hold. Along the fitted motion the force of a finding is taken out and a free law put
    in, with the other coefficients and the nuisances free: one linear step from a motion that both explain.

    Args:
        beside: the free laws beside the fit with the findings.
        effects: their catalogue names.
        rules: which laws do as well.

    Returns:
        The laws for each finding, then, of several, for all together.

    Source: Rao 1948, for the linear step; Davies 1977, for laws compared with what is absent under each.
    """
    groups = [(one,) for one in effects] + ([effects] if len(effects) > 1 else [])
    return tuple(_alternatives(beside, group, rules) for group in groups)


def _alternatives(beside: FreeTraces, effects: tuple[str, ...], rules: Rules) -> Alternatives:
    """List the laws that would do in the place of some findings."""
    fitted, laws, units, traces = beside
    matrix, count = traces.point.reduced.matrix, len(fitted.places)
    own = np.array([name.partition(".")[0] in effects for name in fitted.names])
    kept, found = np.flatnonzero(~own), np.flatnonzero(own)
    # What the findings did, as a combination of the columns; last, what is left beside them.
    done = np.zeros(len(matrix))
    done[-1] = 1.0
    for place in found:
        name, _, parameter = fitted.names[place].partition(".")
        element = fitted.model.element(name)
        if element is not None and parameter == element.strength:
            done[place] = float(fitted.model[fitted.names[place]]) / traces.units[place]
    inverse = np.linalg.pinv(matrix[np.ix_(kept, kept)], rcond=1e-12, hermitian=True)
    left = matrix - matrix[:, kept] @ inverse @ matrix[kept]
    own_inverse = np.linalg.pinv(left[np.ix_(found, found)], rcond=1e-12, hermitian=True)
    with_findings = left[-1, -1] - left[-1, found] @ own_inverse @ left[found, -1]
    columns = slice(count, -1)
    size, score = np.diag(left)[columns], (left @ done)[columns]
    seen = size > rules.smallest_visibility**2 * traces.point.reduced.raw[count:]
    gain = np.where(seen, score**2 / np.where(seen, size, 1.0), 0.0)
    force = done.copy()
    force[-1] = 0.0
    trace = (left @ force)[columns] / np.sqrt(max(force @ left @ force, 1e-300))
    inflation = fitted.inflation
    delta_chi2 = (done @ left @ done - gain - with_findings) / inflation
    margin = least_difference(fitted, rules)
    alternatives = []
    for place in np.argsort(delta_chi2):
        if not (seen[place] and delta_chi2[place] <= margin):
            continue
        share = score[place] / size[place]
        step = inverse @ (matrix[kept] @ done - share * matrix[kept, count + place])
        wording, unit = laws[place].wording(), float(units[place])
        law = eqx.tree_at(lambda one: getattr(one, one.strength), laws[place], jnp.asarray(share * unit))
        alternatives.append(
            AlternativeLaw(
                wording.formula,
                wording.words,
                float(share * unit * wording.factor),
                float(np.sqrt(inflation / size[place]) * unit * wording.factor),
                wording.unit,
                float(delta_chi2[place]),
                float(trace[place] / np.sqrt(size[place])),
                _in_place(fitted, effects, kept, traces.units[kept] * step, law),
            )
        )
    return Alternatives(effects, tuple(alternatives), len(laws), margin)


def _in_place(
    fitted: Estimate,
    effects: tuple[str, ...],
    kept: Int[np.ndarray, " coefficient"],
    step: Float[np.ndarray, " coefficient"],
    law: AbstractFreeForce,
) -> Isolator:
    """Give the isolator with a law in the place of the findings."""
    numbers = [entry.value for entry in list_parameters(fitted.model)]
    for place, change in zip(kept, step, strict=True):
        numbers[fitted.places[place]] = numbers[fitted.places[place]] + change
    model = replace_parameters(fitted.model, numbers)
    elements = (one for one in model.elements if one.name not in effects)
    return Isolator(model.mass, (*elements, law), model.excitation)
