"""Nuisances at given coefficients, and the state in which a record begins."""

import numpy as np
from jaxtyping import Float

from .._parameters import list_parameters
from ..models import Isolator
from ..records import Record
from ._elimination import Nuisances, step_nuisances
from ._problem import Bench, Point, Problem
from ._segments import Segment

ROUNDS = 3
"""Gauss-Newton steps for the nuisances at given coefficients; their effect is all but linear."""


SETTLED = 1e-2
"""Change of chi2, per max(chi2/dof, 1), below which the nuisances stand."""


def best_nuisances(bench: Bench, model: Isolator, spread: float, known: Nuisances | None = None) -> Point:
    """Find the nuisances at given coefficients.

    Args:
        bench: the records.
        model: the isolator.
        spread: prior standard deviation of each record's linear stiffness.
        known: where to begin; at the measured states if omitted.

    Returns:
        The point; no coefficient has a column.
    """
    nothing = np.zeros((len(list_parameters(model)), 0))
    carried = len(model.elements)
    point = bench.evaluate(model, nothing, bench.settle(known, model, carried, spread))
    owner = bench.prepared(model, carried).record
    for _ in range(ROUNDS):
        if not point.is_finite:
            break
        moved = step_nuisances(point.reduced, owner, point.nuisances, np.zeros(0))
        before, point = point, bench.evaluate(model, nothing, moved)
        if abs(before.chi2 - point.chi2) < SETTLED * max(1.0, point.chi2 / max(1.0, point.free_samples)):
            break
    return point


def head_segments(records: tuple[Record, ...]) -> tuple[Segment, ...]:
    """Give the beginning of each record: the samples that the campaign gives for it, else the first second.

    Args:
        records: the records.

    Returns:
        One segment a record.
    """

    def head(place: int, record: Record) -> Segment:
        length = record.settle if record.settle >= 8 else round(record.rate)
        return Segment(place, 0, min(length, record.output.size), 0)

    return tuple(head(place, record) for place, record in enumerate(records))


def beginning_states(problem: Problem, model: Isolator) -> Float[np.ndarray, "state record"]:
    """Find the state in which each record begins: the one from which the model follows its beginning best.

    Internal states begin at rest.

    Args:
        problem: the records.
        model: the isolator.

    Returns:
        States, one column a record.
    """
    bench = Bench(problem._replace(segments=head_segments(problem.records), heads=()), at_rest=True)
    point = best_nuisances(bench, model, 1e-9)
    starts, scales = bench.starts(model, bench.prepared(model, len(model.elements)))
    return (starts + scales * point.nuisances.states.T)[:, : len(problem.records)]
