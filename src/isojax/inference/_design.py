"""Coefficients that meet a target, found along exact derivatives and compared with others."""

import contextlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from .._given_numbers import given_count
from .._results import result_named
from .._types import check_float64
from ..models import (
    EndsEstimated,
    Estimated,
    Isolator,
    Modelled,
    as_isolator,
    coefficient_errors,
    untested_words,
)
from ._constraint import Constraint
from ._design_result import Design, Outcome
from ._design_scan import Scan, scan_design
from ._design_search import FoundDesign, Task, search, stand
from ._design_space import NotFinite, Quantity, given_bounds, space_of

_RESTARTS = 3
"""Times that the search starts again from a better point of the scan."""

_BESIDE = 0.1
"""Distance from the start, as a share of the ranges, at which the objective is sized too."""


def design(
    model: Isolator | Modelled,
    objective: Callable[[Isolator], Any] | None = None,
    subject_to: Constraint | Sequence[Constraint] = (),
    *,
    free: Mapping[str, tuple[float, float]],
    fit: Estimated | EndsEstimated | None = None,
    scan: int = 128,
    seed: int = 0,
) -> Design:
    """Find the coefficients, the mass among them, that make an objective least within constraints.

    The search is SciPy's SLSQP with derivatives of `jax.jacfwd`, over coordinates from 0 to 1 that are
    logarithms where the bounds of a coefficient have one sign. Where a quantity fails on the way, as a fold
    that is gone, the search goes back half the way; `retreats` counts it. Then the design is compared with
    `scan` other points of the bounds; if one is better, the search starts again from it.

    With a `fit`, a constraint may ask for a chance: then not its quantity q keeps to the limit but
    `q -+ z s`, z the quantile of the chance and s the standard error of q by the delta method. The
    coefficients keep the relative errors of the fit while they are changed. So the chance that the isolator
    is stable at a force is held as the chance that the force at the fold lies above it, which is smooth; the
    chance of a cell of a map, which jumps at the fold, is not.

    Args:
        model: the isolator to start from.
        objective: function of an isolator that gives the number to make small, differentiable by
            `jax.jacfwd`; the sum of the squared relative changes of the free coefficients if omitted, so that
            the design is the nearest one.
        subject_to: what the design must keep to: `inference.at_most` and `inference.at_least`.
        free: lower and upper bound of each coefficient that may change, by name or symbol, and of "pressure"
            and "temperature" where the model follows them: then quantities see the isolator at these.
        fit: with whose errors chances are worked out; `model` is its model.
        scan: points with which the design is compared; at least 2.
        seed: of these.

    Returns:
        The design. Where no point is found that keeps the limits, `result` is `RESULTS.infeasible`, `missed`
        names the constraints that the best one breaks with by how much, and `stopped` the quantity that fails
        beyond it, as a fold that is gone.

    Raises:
        ValueError: if neither an objective nor a constraint is given, a bound, name or constraint is not what
            it must be, or a quantity is not finite at the start, or wherever the search goes from a point
            that keeps the limits: with the quantity and the coefficients.
        RuntimeError: if JAX is not in 64-bit mode.

    Source: Kraft 1988, DFVLR-FB 88-28 (SLSQP).

    Example:
        The softest spring whose static deflection under 100 N stays below 0.1 mm:

        >>> model = ij.Isolator(800.0, (ij.elements.LinearStiffness(2e6), ij.elements.LinearDamping(4e3)))
        >>> def deflection(isolator):
        ...     return 100.0 / isolator["linear_stiffness.coefficient"]
        >>> found = ij.design(
        ...     model,
        ...     lambda isolator: isolator["linear_stiffness.coefficient"],
        ...     ij.inference.at_most(deflection, 1e-4),
        ...     free={"linear_stiffness.coefficient": (1e5, 1e7)},
        ... )
        >>> print(f"{float(found.model['linear_stiffness.coefficient']):.4g} N/m, {found.scan.better} better")
        1e+06 N/m, 0 better
    """
    check_float64()
    known = model if fit is None else fit
    model = as_isolator(model, recorded=True)
    bounds = given_bounds(model, free)
    as_isolator(model, recorded=set(model.conditions) <= set(bounds))
    constraints = _constraints(subject_to)
    if objective is None and not constraints:
        raise ValueError(
            "Argument `objective` or `subject_to` must be given, but both are missing: nothing would change."
        )
    scan, seed = given_count("scan", scan, least=2), given_count("seed", seed, least=0)
    if fit is None and any(one.chance is not None for one in constraints):
        raise ValueError("Argument `fit` must be given where a constraint asks for a chance, but is missing.")
    space = space_of(model, bounds)
    errors = None if fit is None else coefficient_errors(fit, model)
    wanted = Quantity(space, objective, "the objective")
    limits = tuple(Quantity(space, one.quantity, one.name, one, errors) for one in constraints)
    start = space.coordinates(space.before)
    try:
        task = _task(wanted, limits, start)
        before = stand(task, start)[0]
        found, compared = _searched(task, start, scan, seed)
    except NotFinite as lost:
        raise ValueError(
            "Argument `model` must start where every quantity exists and is finite, and stay there, but "
            f"{lost}."
        ) from None
    ended = "successful" if found.converged else "not_converged"
    return Design(
        space.moved(found.at),
        model,
        space.names,
        space.units,
        np.asarray(space.values(found.at)),
        space.before,
        space.lower,
        space.upper,
        found.objective,
        before,
        tuple(_outcome(one, found) for one in limits),
        result_named(ended if found.feasible else "infeasible"),
        compared,
        sum(one.evaluations for one in (wanted, *limits)),
        found.retreats,
        found.stopped,
        untested_words(known, space.conditions(np.asarray(space.values(found.at)))),
    )


def _constraints(subject_to: Any) -> tuple[Constraint, ...]:
    """Give the constraints that a caller gave, one or several."""
    several = isinstance(subject_to, Iterable) and not isinstance(subject_to, Constraint)
    given: tuple[Any, ...] = tuple(subject_to) if several else (subject_to,)
    for one in given:
        if not isinstance(one, Constraint):
            raise ValueError(
                "Argument `subject_to` must hold constraints, such as `inference.at_most(quantity, limit)`, "
                f"but holds one of type {type(one).__name__}."
            )
    return given


def _task(wanted: Quantity, limits: tuple[Quantity, ...], start: np.ndarray) -> Task:
    """Size the objective, and see that the numbers are as many as they must be."""
    first = wanted.at(start)
    if first.value.size != 1:
        raise ValueError(
            f"Argument `objective` must give one number, but gives {first.value.size}; ask for the others in "
            "argument `subject_to`."
        )
    for one in limits:
        count, constraint = one.at(start).value.size, one.constraint
        if constraint is not None and constraint.limit.size not in (1, count):
            raise ValueError(
                f"Argument `subject_to` must have one limit or one for each of {count} numbers of "
                f"{one.name}, but has {constraint.limit.size}."
            )
    return Task(wanted, limits, _size_of(wanted, start))


def _size_of(wanted: Quantity, start: np.ndarray) -> float:
    """Give the size of the objective, value and slope: at the start, and beside it, where both may vanish."""
    sizes = [0.0]
    for at in (start, start + np.where(start > 0.5, -_BESIDE, _BESIDE)):
        with contextlib.suppress(NotFinite):
            answer = wanted.at(at)
            assert answer.slope is not None
            sizes += [abs(float(answer.value[0])), float(np.max(np.abs(answer.slope)))]
    return max(sizes) or 1.0


def _searched(task: Task, start: np.ndarray, count: int, seed: int) -> tuple[FoundDesign, Scan]:
    """Search, compare with other points, and go on from a better one."""
    found = search(task, start)
    compared, better = scan_design(task, found, count, seed)
    retreats = found.retreats
    for turn in range(1, _RESTARTS + 1):
        if better is None:
            break
        found = search(task, better)
        compared, better = scan_design(task, found, count, seed + turn)
        retreats += found.retreats
    return found._replace(retreats=retreats), compared


def _outcome(limit: Quantity, found: FoundDesign) -> Outcome:
    answer = limit.at(found.at, slopes=False)
    assert limit.constraint is not None
    return Outcome(limit.constraint, answer.value, answer.bound)
