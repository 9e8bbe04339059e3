"""Nuisances at given coefficients, and the initial state of a record."""

import numpy as np
from jaxtyping import Float, Int

from ...models import Isolator
from ...records import Record, ringing_frequency
from ..jacobian import FIRST_STATES, SHORTEST, Segment, readings
from ._elimination import Nuisances, Spread, step_nuisances
from ._problem import Point, Problem, one_hot
from ._simulator import Simulator

ROUNDS = 3
"""Gauss-Newton steps for the nuisances at given coefficients; their effect is all but linear."""

RELEASED_ROUNDS = 12
"""The same where a record starts with a release: its first states are poorly known, its motion is large."""

MOST_WORSENING = 1.1
"""Factor on the error of a record up to which a step stands: chi2 is that at the end of the next one."""

HALVINGS = 5
"""How often the step of a record is halved before it is given up."""

_BAD_START = 1.3
"""chi2/dof above which initial states are sought further."""

HELD = Spread(1e-9)
"""Spread of the linear stiffness between records that leaves it where it is."""

SETTLED = 1e-2
"""Change of chi2, per max(chi2/dof, 1), below which the nuisances stand."""

FIRST_PERIODS = 1.0
"""Periods at the start of a record over which its state is sought first."""

SMALL_STEP = 1e-4
"""Step of a state, over its range, that no longer counts."""


def best_nuisances(
    simulator: Simulator,
    model: Isolator,
    spread: Spread,
    known: Nuisances | None = None,
    places: tuple[int, ...] = (),
) -> Point:
    """Find the nuisances at given coefficients.

    Args:
        simulator: the records.
        model: the isolator.
        spread: prior standard deviations of the linear stiffness.
        known: where to start; at the measured states if omitted.
        places: coefficients that have columns at the point; they stay as they are. A search for the same ones
            shares the compiled code.

    Returns:
        The point.
    """
    released = any(record.kind == "free_decay" for record in simulator.problem.records)
    start = simulator.settle(known, model, len(model.elements), spread)
    if released and known is None:
        start = _first_periods(simulator, model, start)
    point = _settle_from(simulator, model, start, released, places)
    if released or known is not None or not may_start_wrong(simulator, point):
        return point
    further = _settle_from(simulator, model, _first_periods(simulator, model, start), True, places)
    return further if further.chi2 < point.chi2 else point


def may_start_wrong(simulator: Simulator, point: Point, from_others: bool = False) -> bool:
    """Say whether what is left may come of the initial states.

    It is more than noise, or laws jump, which look like noise in the output themselves. Dwells settle: their
    measured states are right, but those on which a search moved from another model's may not be.

    Args:
        simulator: the records.
        point: the equations at some coefficients.
        from_others: whether the search for the states began at those of another model.

    Returns:
        Whether to seek the states further.
    """
    settles = any(record.dwells for record in simulator.problem.records) and not from_others
    return not settles and (point.model.splits or not point.chi2 < _BAD_START * max(1.0, point.free_samples))


def _first_periods(simulator: Simulator, model: Isolator, start: Nuisances) -> Nuisances:
    """Find the initial states of the first periods of each segment: over them no phase error can grow."""
    problem, carried = simulator.problem, len(model.elements)
    lanes = len(problem.segments)

    def first(segment: Segment) -> Segment:
        record = problem.records[segment.record]
        length = round(FIRST_PERIODS * record.rate / ringing_frequency(record.output, record.rate))
        return segment._replace(
            stop=min(segment.stop, max(segment.start, segment.counted) + max(length, SHORTEST))
        )

    segments = tuple(map(first, problem.segments))
    short = Simulator(problem._replace(segments=segments, heads=()), simulator.at_rest)
    begun = short.settle(None, model, carried, HELD)
    begun.states[:lanes, :2] = _best_tried(
        Simulator(short.problem._replace(segments=segments * (len(FIRST_STATES) + 1)), simulator.at_rest),
        model,
        lanes,
    )
    found = _settle_from(short, model, begun, True)
    if not found.is_finite:
        return start
    own, scales = short.starts(model, short.prepared(model, carried))
    starts, units = simulator.starts(model, simulator.prepared(model, carried))
    states = own + scales * found.nuisances.states.T
    # Either simulator may carry lanes beyond the segments, which hold nothing.
    used = slice(lanes)
    moved = start.states.copy()
    # What starts at rest has no unit and does not move.
    moved[used] = ((states[:, used] - starts[:, used]) / np.where(units > 0.0, units, np.inf)[:, used]).T
    return start._replace(states=moved)


def _best_tried(many: Simulator, model: Isolator, lanes: int) -> Float[np.ndarray, "lane 2"]:
    """Give the start of each segment, of those tried, from which it is followed best.

    Args:
        many: the segments, as often as starts are tried.
        model: the isolator.
        lanes: count of the segments.

    Returns:
        Deviations from the measured start, in its scales.
    """
    carried = len(model.elements)
    prepared = many.prepared(model, carried)
    starts, scales = many.starts(model, prepared, carried)
    own = (starts[:2, :lanes] / scales[:2, :lanes]).T
    tried = np.concatenate([np.zeros((1, lanes, 2)), FIRST_STATES[:, None] - own])
    used = tried.size // 2
    starts[:2, :used] += scales[:2, :used] * tried.reshape(-1, 2).T
    simulated = readings(model, np.ones(prepared.record.size), starts, prepared)
    weight, measured = (
        prepared.in_lanes(np.asarray(getattr(batch, name)).T for batch in prepared.batches).T
        for name in ("weight", "measured")
    )
    squares = np.sum((weight * (simulated - measured)) ** 2, axis=0)[:used]
    best = np.argmin(np.nan_to_num(squares, nan=np.inf).reshape(-1, lanes), axis=0)
    return tried[best, np.arange(lanes)]


def _settle_from(
    simulator: Simulator, model: Isolator, start: Nuisances, released: bool, places: tuple[int, ...] = ()
) -> Point:
    """Take Gauss-Newton steps of the nuisances until they stand."""
    directions = one_hot(model, places, [1.0] * len(places))
    still = np.zeros(len(places))
    carried = len(model.elements)
    point = simulator.evaluate(model, directions, start)
    owner = simulator.prepared(model, carried).record
    for _ in range(RELEASED_ROUNDS if released else ROUNDS):
        if not point.is_finite:
            break
        moved = step_nuisances(point.reduced, owner, point.nuisances, still)
        before, point = point, simulator.evaluate(model, directions, moved)
        if released:
            point = _shortened(simulator, directions, before, point, owner)
        # chi2 is that at the end of the step, as if the response were linear; of a release also the step must
        # be small, since its motion is not.
        is_small = not released or np.max(np.abs(moved.states - before.nuisances.states)) < SMALL_STEP
        if is_small and abs(before.chi2 - point.chi2) < SETTLED * max(
            1.0, point.chi2 / max(1.0, point.free_samples)
        ):
            break
    return point


def _shortened(
    simulator: Simulator,
    directions: Float[np.ndarray, "parameter column"],
    before: Point,
    after: Point,
    owner: Int[np.ndarray, " lanes"],
) -> Point:
    """Halve the step of each record whose error it raised; where that does not help, stay."""
    known, share = before.reduced.by_record[:, -1, -1], np.ones(before.samples.size)
    old, new, found = before.nuisances, after.nuisances, after
    for halving in range(HALVINGS + 1):
        worse = ~(found.reduced.by_record[:, -1, -1] <= MOST_WORSENING * known + 1.0)
        if not np.any(worse):
            break
        share = np.where(worse, 0.5 * share if halving < HALVINGS else 0.0, share)
        moved = share[owner]
        between = old._replace(
            states=_between(old.states, new.states, moved[:, None]),
            stiffness=_between(old.stiffness, new.stiffness, share),
            segments=_between(old.segments, new.segments, moved),
        )
        found = simulator.evaluate(before.model, directions, between)
    return found


def _between(old: np.ndarray, new: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Give what lies a share of the way from old to new; what does not move may lead to no number."""
    return old + np.where(share > 0.0, share * (new - old), 0.0)


def head_segments(records: tuple[Record, ...]) -> tuple[Segment, ...]:
    """Give the first samples of each record: those that the campaign gives for it, else the first second."""

    def head(place: int, record: Record) -> Segment:
        length = record.settle if record.settle >= SHORTEST else round(record.rate)
        return Segment(place, 0, min(length, record.output.size), 0)

    return tuple(head(place, record) for place, record in enumerate(records))


def find_initial_states(problem: Problem, model: Isolator) -> Float[np.ndarray, "state record"]:
    """Find the initial state of each record: the one from which the model follows its first samples best.

    Internal states start at rest.
    """
    simulator = Simulator(problem._replace(segments=head_segments(problem.records), heads=()), at_rest=True)
    point = best_nuisances(simulator, model, HELD)
    starts, scales = simulator.starts(model, simulator.prepared(model, len(model.elements)))
    return (starts + scales * point.nuisances.states.T)[:, : len(problem.records)]
