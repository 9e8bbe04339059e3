"""A design: coefficients that meet a target, and how they were checked."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from .._results import RESULTS, is_successful
from .._show import Row, amount, number, shown
from ..models import Isolator
from ._constraint import Constraint
from ._design_scan import Scan
from ._design_search import ALLOWED_MISS, limit_sizes

_ACTIVE = 1e-4
"""Margin over the limit below which a constraint holds the design where it is."""


@shown
class Outcome(NamedTuple):
    """A constraint at a design.

    Attributes:
        constraint: it.
        value: its quantity, flat.
        bound: the same; with a chance, the end of the quantity that lies on its side of the limit with it.
    """

    constraint: Constraint
    value: Float[np.ndarray, " number"]
    bound: Float[np.ndarray, " number"]

    @property
    def _limits(self) -> Float[np.ndarray, " number"]:
        return np.broadcast_to(np.ravel(self.constraint.limit), self.bound.shape)

    @property
    def margins(self) -> Float[np.ndarray, " number"]:
        """Distance of each number to its limit, negative where it is missed [unit of the quantity]."""
        room = self._limits - self.bound
        return room if self.constraint.upper else -room

    @property
    def kept(self) -> bool:
        """Whether every number keeps to its limit."""
        return bool(np.all(self.margins >= -ALLOWED_MISS * limit_sizes(self._limits)))

    @property
    def active(self) -> bool:
        """Whether the limit holds the design where it is."""
        return bool(np.min(self.margins / limit_sizes(self._limits)) < _ACTIVE)

    @property
    def words(self) -> str:
        """Whether it is kept, with the number that lies closest to its limit or misses it most."""
        place = int(np.argmin(self.margins / limit_sizes(self._limits)))
        value, margin = number(float(self.value[place])), float(self.margins[place])
        sure = "" if self.constraint.chance is None else f", its end {number(float(self.bound[place]))}"
        if not self.kept:
            return f"{value}{sure}: missed by {number(-margin)}"
        return f"{value}{sure}: {'at its limit' if self.active else f'{number(margin)} to spare'}"

    def _headline(self) -> str:
        return f"{self.constraint.words}: {self.words}"


@shown
class Design(NamedTuple):
    """Coefficients that meet a target.

    Attributes:
        model: the isolator with them; where the limits cannot be kept, the one that misses them least.
        start: the isolator that the search started from.
        names: of the free coefficients, and of the operating conditions at which `model` is.
        units: of each.
        values: of each at the design.
        before: of each at the start.
        lower: smallest value of each.
        upper: largest value of each.
        objective: at the design.
        objective_before: at the start.
        outcomes: each constraint at the design.
        result: how the search ended.
        scan: the design compared with other coefficients.
        evaluations: of quantities, those of the scan included.
        retreats: how often a quantity failed on the way and the search went back.
        stopped: which quantity fails next to the best point, and where, if no point keeps the limits and the
            search ended at the failure; "" otherwise.
        untested: that an operating condition lies beyond those of the fitted records, as far as `fit` or the
            fit given as `model` knows them; "" otherwise.
    """

    model: Isolator
    start: Isolator
    names: tuple[str, ...]
    units: tuple[str, ...]
    values: Float[np.ndarray, " coefficient"]
    before: Float[np.ndarray, " coefficient"]
    lower: Float[np.ndarray, " coefficient"]
    upper: Float[np.ndarray, " coefficient"]
    objective: float
    objective_before: float
    outcomes: tuple[Outcome, ...]
    result: RESULTS
    scan: Scan
    evaluations: int
    retreats: int
    stopped: str
    untested: str = ""

    @property
    def changes(self) -> Float[np.ndarray, " coefficient"]:
        """Change of each over its value at the start."""
        return (self.values - self.before) / np.where(self.before == 0.0, 1.0, np.abs(self.before))

    @property
    def missed(self) -> tuple[str, ...]:
        """The constraints that are not kept, in words with by how much; none where the design is one."""
        return tuple(one._headline() for one in self.outcomes if not one.kept)

    def _headline(self) -> str:
        if self.missed:
            return f"not reached: no point was found that keeps the constraints; {_broken(self.outcomes)}"
        how = "" if is_successful(self.result) else f", not converged: {RESULTS[self.result]}"
        return f"objective {number(self.objective_before)} → {number(self.objective)}{how}"

    def _rows(self) -> list[Row]:
        rows = [
            Row(
                name,
                f"{amount(value, unit)} ({100.0 * change:+.3g} %)",
                f"between {number(low)} and {number(high)}",
            )
            for name, unit, value, change, low, high in zip(
                self.names,
                self.units,
                self.values.tolist(),
                self.changes.tolist(),
                self.lower.tolist(),
                self.upper.tolist(),
                strict=True,
            )
        ]
        return rows + [Row(one.constraint.words, one.words) for one in self.outcomes]

    def _lines(self) -> list[str]:
        back = f", {self.retreats} times back from where a quantity failed" if self.retreats else ""
        end = [f"  the search went no further because {self.stopped}"] if self.stopped else []
        end += [f"  {self.untested}"] if self.untested else []
        return [*end, f"  {self.scan.words}", f"  {self.evaluations} evaluations{back}"]


def _broken(outcomes: tuple[Outcome, ...]) -> str:
    """Say which constraints the best point breaks, and by how much."""
    lost = [one for one in outcomes if not one.kept]
    words = " and ".join(f"{one.constraint.words} by {number(-float(np.min(one.margins)))}" for one in lost)
    return f"the best one breaks {words}"
