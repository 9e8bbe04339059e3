"""The search for a design: SciPy's SLSQP in a box that shrinks where a quantity fails.

SLSQP takes bounds, inequalities and exact derivatives, which is all that a design of a few coefficients
needs. It stands in SciPy, which isojax needs anyway; optimistix has no constraints, and Ipopt would have to
be installed beside Python.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.optimize import minimize

from ._design_space import Answer, NotFinite, Quantity

ALLOWED_MISS = 1e-6
"""Share of its limit by which a number may miss it."""

_BOXES = 30
"""Boxes that are searched at most."""

_SLSQP_STEPS = 60
"""Steps of SLSQP in a box at most."""

_SMALLEST_BOX = 1e-4
"""Half the edge of a box below which a search that keeps failing is given up."""

_LEAST_PROGRESS = 1e-10
"""Change of the scaled objective at which SLSQP stops."""


class Task(NamedTuple):
    """What is to be made small, and what is to be kept to.

    Attributes:
        objective: one number.
        constraints: each with its limit.
        size: of the objective, which makes it of order one.
    """

    objective: Quantity
    constraints: tuple[Quantity, ...]
    size: float

    def margins(self, at: Float[np.ndarray, " coordinate"], slopes: bool = True) -> Answer:
        """Give the margin of every number over the size of its limit: negative where it is missed."""
        values, changes = [np.zeros(0)], [np.zeros((0, at.size))]
        for quantity in self.constraints:
            constraint = quantity.constraint
            assert constraint is not None
            answer = quantity.at(at, slopes)
            limit = np.broadcast_to(np.ravel(constraint.limit), answer.bound.shape)
            unit = (-1.0 if constraint.upper else 1.0) / limit_sizes(limit)
            values.append(unit * (answer.bound - limit))
            if answer.slope is not None:
                changes.append(unit[:, None] * answer.slope)
        margin = np.concatenate(values)
        return Answer(margin, margin, np.concatenate(changes) if slopes else None)


def limit_sizes(limit: Float[np.ndarray, " number"]) -> Float[np.ndarray, " number"]:
    """Give the sizes by which misses of limits are measured: their magnitude, one where they are zero."""
    return np.where(limit == 0.0, 1.0, np.abs(limit))


class FoundDesign(NamedTuple):
    """Where a search ended.

    Attributes:
        at: the point.
        objective: there.
        violation: largest miss of a limit, over the limit; 0 where all are kept.
        converged: whether it is a minimum of what was searched.
        retreats: how often a quantity failed on the way and the search went back.
        stopped: which quantity failed next to it, and where, if that ended the search; "" otherwise.
    """

    at: Float[np.ndarray, " coordinate"]
    objective: float
    violation: float
    converged: bool
    retreats: int
    stopped: str = ""

    @property
    def feasible(self) -> bool:
        """Whether every limit is kept."""
        return self.violation <= ALLOWED_MISS


def search(task: Task, start: Float[np.ndarray, " coordinate"]) -> FoundDesign:
    """Search for the smallest objective that keeps to the limits; where none does, for the smallest miss.

    Where the start misses a limit, the largest miss is made small first. From then on the search goes from
    one point that keeps the limits to the next. Where a quantity fails at a trial point, the search goes back
    to the box around the last good one that reaches half as far, and on from there.

    Args:
        task: objective and constraints.
        start: point at which all quantities are finite.

    Returns:
        Where it ended.

    Raises:
        NotFinite: if a quantity fails at the start, or wherever the search goes from a point that keeps the
            limits.

    Source: Kraft 1988, DFVLR-FB 88-28 (SLSQP).
    """
    nearest = FoundDesign(start, *stand(task, start), True, 0)
    if not nearest.feasible:
        nearest = _in_boxes(task, start, elastic=True)
    if not nearest.feasible:
        return nearest
    found = _in_boxes(task, nearest.at, elastic=False)
    return found._replace(retreats=found.retreats + nearest.retreats)


def _in_boxes(task: Task, start: Float[np.ndarray, " coordinate"], elastic: bool) -> FoundDesign:
    """Search in boxes: `elastic` for the smallest miss, else among points that keep the limits."""
    centre, radius, retreats = start, np.inf, 0
    for _ in range(_BOXES):
        low, high = np.maximum(0.0, centre - radius), np.minimum(1.0, centre + radius)
        try:
            end, converged = _minimise(task, centre, low, high, elastic)
            objective, violation = stand(task, end)
        except NotFinite as lost:
            retreats += 1
            radius = 0.5 * min(radius, float(np.max(np.abs(lost.at - centre))))
            if radius < _SMALLEST_BOX and elastic:
                # What the limits ask for lies where a quantity does not exist: no point keeps them.
                return FoundDesign(centre, *stand(task, centre), False, retreats, str(lost))
            if radius < _SMALLEST_BOX:
                raise
            continue
        if not elastic and violation > ALLOWED_MISS:
            radius = 0.5 * min(radius, float(np.max(np.abs(end - centre))))
            if radius < _SMALLEST_BOX:
                break
            continue
        cut = np.isclose(end, low) & (low > 0.0) | np.isclose(end, high) & (high < 1.0)
        if not cut.any() or (elastic and violation <= ALLOWED_MISS):
            return FoundDesign(end, objective, violation, converged, retreats)
        centre, radius = end, 2.0 * radius
    return FoundDesign(centre, *stand(task, centre), False, retreats)


def stand(task: Task, at: Float[np.ndarray, " coordinate"]) -> tuple[float, float]:
    """Give objective and largest miss at a point.

    Args:
        task: objective and constraints.
        at: the point.

    Returns:
        Both; the miss is 0 where all limits are kept.

    Raises:
        NotFinite: if a quantity is not.
    """
    margins = task.margins(at, slopes=False).value
    return float(task.objective.at(at, slopes=False).value[0]), float(max(0.0, -margins.min(initial=0.0)))


def _minimise(
    task: Task,
    start: Float[np.ndarray, " coordinate"],
    low: Float[np.ndarray, " coordinate"],
    high: Float[np.ndarray, " coordinate"],
    elastic: bool,
) -> tuple[Float[np.ndarray, " coordinate"], bool]:
    """Run SLSQP in a box, for the objective or, `elastic`, for the largest miss as one more unknown."""
    count = start.size

    def slopes_of(answer: Answer) -> np.ndarray:
        assert answer.slope is not None
        return answer.slope

    constraints = []
    if task.constraints:
        spare = np.ones((task.margins(start).value.size, 1)) if elastic else None

        def margin(unknown: np.ndarray) -> np.ndarray:
            kept = task.margins(unknown[:count].copy()).value
            return kept + unknown[count] if elastic else kept

        def slope(unknown: np.ndarray) -> np.ndarray:
            change = slopes_of(task.margins(unknown[:count].copy()))
            return change if spare is None else np.hstack([change, spare])

        constraints = [{"type": "ineq", "fun": margin, "jac": slope}]
    bounds = list(zip(low, high, strict=True))
    options = {"ftol": _LEAST_PROGRESS, "maxiter": _SLSQP_STEPS}
    if elastic:
        miss = stand(task, start)[1]
        first, bounds = np.append(start, miss), [*bounds, (0.0, max(miss, ALLOWED_MISS))]
        last = np.append(np.zeros(count), 1.0)
        done = minimize(
            lambda unknown: unknown[count],
            first,
            jac=lambda unknown: last,
            bounds=bounds,
            constraints=constraints,
            method="SLSQP",
            options=options,
        )
    else:
        done = minimize(
            lambda at: task.objective.at(at.copy()).value[0] / task.size,
            start,
            jac=lambda at: slopes_of(task.objective.at(at.copy()))[0] / task.size,
            bounds=bounds,
            constraints=constraints,
            method="SLSQP",
            options=options,
        )
    return np.clip(done.x[:count], low, high), bool(done.success)
