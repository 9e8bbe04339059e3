"""The search itself: optimistix on systems of coefficient size."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from ..._parameters import ParameterSpec, list_parameters, replace_parameters, to_free, to_physical
from ..._quick_jit import quick_jit
from ..._results import RESULTS
from ..._types import on_device
from ...models import Isolator
from ._elimination import Nuisances, promised_misfits, step_nuisances
from ._problem import Point, one_hot
from ._search import Search
from ._simulator import Simulator

FIRST_DAMPING = 1e-5
"""Marquardt's damping at the first step, over the diagonal of the normal equations: starts are good."""

REFUSALS_A_STEP = 4
"""Refused steps in a row after which each one counts for one more."""

MOST_REFUSALS = 10
"""Refused steps in a row after which the search stops. The later ones count for several, so that the last has
4^15 times the damping of the first: no descent is left untried."""

DOUBTFUL = 5
"""Refused steps in a row after which the nuisances of the best point are asked to keep what they promised."""

KEPT = 0.25
"""Share of its promised decrease that a segment must attain near the solution, else its states are held."""

IDLE = 3
"""Accepted steps that together must gain what a step must."""

PACE = 5
"""Accepted steps over which the pace of a search is taken, where another model is ahead of it. Refused ones
do not count: what comes after them may gain more than what went before."""

UNPROMISING = 3
"""Points in a row whose linear step would not reach another model, after which a search is given up."""

SHRINKS = 3
"""Refusals that a trial which diverged counts for: it lies far outside, not just a little too far."""

STALLED = 1e-2
"""Predicted share of chi2 still to gain below which a search that gains no more counts as converged."""

RUNAWAY = 1e75
"""Residual that stands for a simulation that diverged: finite, so that the solver steps back and not out."""


class Descent(NamedTuple):
    """How a search ended.

    Attributes:
        point: the best point, its columns in physical units of the free coefficients.
        result: how it ended.
        steps: evaluations of the simulation and its derivatives.
    """

    point: Point
    result: RESULTS
    steps: int


class _Local(NamedTuple):
    """Residual and Jacobian at one point, compressed to coefficient size."""

    start: Float[Array, " column"]
    residual: Float[Array, " row"]
    jacobian: Float[Array, "row column"]


def _residual(free: Float[Array, " column"], local: _Local) -> tuple[Float[Array, " row"], None]:
    """Residual as optimistix sees it: exact in value and derivative at the point where it is asked."""
    return local.residual + local.jacobian @ (free - local.start), None


def _compress(matrix: Float[np.ndarray, "column column"]) -> tuple[np.ndarray, np.ndarray]:
    """Give the residual and Jacobian of least size with the same normal equations (Cholesky factor)."""
    count = matrix.shape[0] - 1
    # A negative sum of squares is the rounding of huge numbers that cancel, see `Point.is_finite`.
    if not np.all(np.isfinite(matrix)) or matrix[-1, -1] < 0.0:
        return np.full(count + 1, RUNAWAY), np.zeros((count + 1, count))
    # Beside a simulation that almost diverged a column may cancel to nothing: its scale must stay a number.
    size = np.sqrt(np.maximum(np.diag(matrix), 1e-300 + 1e-60 * np.max(np.diag(matrix))))
    scaled = matrix / size[:, None] / size[None, :]
    ridge = 1e-14
    while True:
        try:
            factor = np.linalg.cholesky(scaled + ridge * np.eye(count + 1))
            break
        except np.linalg.LinAlgError:
            ridge *= 10.0
    factor = factor * size[:, None]
    return factor[-1].copy(), -np.vstack([factor[:count, :count].T, np.zeros((1, count))])


@quick_jit
def _to_physical(
    free: Float[Array, " column"], scales: Float[Array, " column"], specs: tuple[ParameterSpec, ...]
) -> tuple[Float[Array, " column"], Float[Array, " column"]]:
    """Give the physical coefficients of unbounded variables, and their slopes."""

    def each(free: Float[Array, " column"]) -> Float[Array, " column"]:
        pairs = zip(free, specs, scales, strict=True)
        return jnp.stack([to_physical(value, spec, scale) for value, spec, scale in pairs])

    return jax.jvp(each, (free,), (jnp.ones_like(free),))


@quick_jit
def _init(solver: Any, free: Array, local: _Local) -> Any:
    struct = jax.eval_shape(lambda: local.residual)
    return solver.init(_residual, free, local, {}, struct, None, frozenset())


@quick_jit
def _step(solver: Any, free: Array, local: _Local, state: Any) -> tuple[Array, Any]:
    free, state, _ = solver.step(_residual, free, local, {}, state, frozenset())
    return free, state


def descend(
    simulator: Simulator,
    model: Isolator,
    places: tuple[int, ...],
    sizes: tuple[float, ...],
    nuisances: Nuisances,
    search: Search,
) -> Descent:
    """Fit coefficients to the records, nuisances eliminated on the way.

    Each step simulates every segment once with its exact forward derivatives. optimistix sees the compressed
    residual at the point it asks for; the nuisances of a trial point are those that its step implies.

    Args:
        simulator: the records.
        model: start.
        places: free coefficients, by their place in `list_parameters`.
        sizes: magnitude of each.
        nuisances: start of the nuisances.
        search: the solver, and when it is over.

    Returns:
        The best point and how the search ended.

    Source: Golub & Pereyra 1973 (variable projection); Marquardt 1963.
    """
    listed, tolerance = list_parameters(model), search.tolerance
    values = [entry.value for entry in listed]
    specs = tuple(listed[place].spec for place in places)

    def physical(free: np.ndarray) -> tuple[Isolator, list[float]]:
        found, slopes = _to_physical(on_device(free), on_device(np.array(sizes)), specs)
        numbers = list(values)
        for place, number in zip(places, np.asarray(found), strict=True):
            numbers[place] = number
        return replace_parameters(model, numbers), [float(slope) for slope in np.asarray(slopes)]

    free = np.array([to_free(values[place], specs[c], sizes[c]) for c, place in enumerate(places)])
    # Marquardt's scaling: the solver's variables are those in which the first normal equations have an equal
    # diagonal.
    unit = np.ones(len(places))
    trial, trial_nuisances, best_free = free, nuisances, free
    scaled = on_device(free)
    best: Point | None = None
    state: Any = None
    result: Any = RESULTS.not_converged
    evaluations, refused, unpromising, decrement = 0, 0, 0, float("inf")
    levels: list[float] = []
    while evaluations < search.max_steps:
        current, slopes = physical(trial)
        point = simulator.evaluate(current, one_hot(current, places, slopes), trial_nuisances)
        evaluations += 1
        residual, jacobian = _compress(point.reduced.matrix)
        if state is None:
            if not point.is_finite:
                return Descent(point, RESULTS.not_finite, evaluations)
            unit = np.sqrt(1.0 / FIRST_DAMPING / np.maximum(np.sum(jacobian**2, axis=0), 1e-300))
        local = _Local(*map(on_device, (trial / unit, residual, jacobian * unit)))
        if state is None:
            scaled = local.start
            state = _init(search.solver, scaled, local)
        accepted = best is None or (point.is_finite and point.chi2 <= best.chi2)
        # Only a refusal may count for several: an accepted point is one step on.
        refusals = 1 if accepted else max(1 if point.is_finite else SHRINKS, 1 + refused // REFUSALS_A_STEP)
        for _ in range(refusals):
            scaled, state = _step(search.solver, scaled, local, state)
        chi2 = point.chi2 / max(1.0, point.free_samples - len(places))
        search.progress(f"step {evaluations}: chi2/dof {chi2:.6g}{'' if accepted else ' (rejected)'}")
        if accepted:
            gained = float("inf") if best is None or refused else best.chi2 - point.chi2
            best, best_free, refused = point, trial, 0
            # What a full linear step would still gain, and what the last one did gain: either may say that it
            # is over.
            decrement = float(np.sum(residual[:-1] ** 2))
            if min(decrement, gained) < tolerance * max(1.0, chi2):
                result = RESULTS.successful
                break
        else:
            refused += 1
        assert best is not None
        levels += [best.chi2] if accepted else []
        # A law with kinks lets no step pass near the solution; elsewhere so many refusals are a failure.
        # Where records are split the error itself has kinks, and a slope on either side of its least.
        idle = _gain(levels, IDLE) < tolerance * max(1.0, chi2)
        is_least = decrement < STALLED * best.chi2 or model.splits
        rival = search.rival
        if rival is not None:
            behind = best.chi2 - rival.chi2
            pace = _gain(levels, PACE) / PACE
            if point.is_finite:
                promised = point.chi2 - float(np.sum(residual[:-1] ** 2))
                unpromising = unpromising + 1 if promised - rival.chi2 > rival.tie else 0
            if behind > rival.tie and (pace * search.max_steps < behind or unpromising == UNPROMISING):
                result = RESULTS.outdone
                break
        if refused == MOST_REFUSALS or (idle and is_least):
            result = RESULTS.successful if is_least else RESULTS.not_converged
            break
        if bool(state.terminate):
            result = RESULTS.successful
            break
        owner = simulator.prepared(best.model, len(best.model.elements)).record
        # Of records left whole the first samples set the states, whatever the rest would have them do.
        own = model.splits and not simulator.problem.heads
        if own and not accepted and point.is_finite and decrement < STALLED * best.chi2:
            step = trial - best_free
            held = _held_where_promises_fail(best, point, owner, step, tolerance * max(1.0, chi2))
            if held is not None and evaluations < search.max_steps:
                search.progress("initial states beside a kink are held")
                trial, trial_nuisances, best, state, refused, levels = best_free, held, None, None, 0, []
                continue
        if refused == DOUBTFUL and evaluations < search.max_steps - 2:
            slopes = physical(best_free)[1]
            settled = _with_implied_nuisances(simulator, best, places, slopes, owner)
            evaluations += 1
            is_kept = settled.is_finite and settled.chi2 - best.chi2 <= tolerance * max(1.0, chi2)
            if not settled.is_finite:
                search.progress(
                    "the simulation from the found states diverges: again from the measured states"
                )
                settled = _from_measured_states(simulator, best, places, slopes)
                evaluations += 1
            if settled.is_finite and not is_kept:
                search.progress("restarting the search: the predicted decrease was not reached")
                trial, trial_nuisances, best, state, refused = best_free, settled.nuisances, None, None, 0
                # What was promised is no measure of what is gained from here on.
                levels = []
                continue
        trial = np.asarray(state.y_eval) * unit
        trial_nuisances = step_nuisances(best.reduced, owner, best.nuisances, trial - best_free)
    assert best is not None
    slopes = physical(best_free)[1]
    if best.nuisances.held is not nuisances.held:
        # What a search held for its own sake is neither known nor left out of the errors. Nothing moved.
        free_again = best.nuisances._replace(held=nuisances.held)
        best = simulator.evaluate(best.model, one_hot(best.model, places, slopes), free_again)
    return Descent(_in_physical_units(best, slopes), result, evaluations)


def _held_where_promises_fail(
    best: Point,
    point: Point,
    owner: Int[np.ndarray, " lanes"],
    step: Float[np.ndarray, " column"],
    least: float,
) -> Nuisances | None:
    """Give the nuisances of a point with more states held: of segments whose linear step failed; else None.

    Initial states from which a mass may stick or slide, touch or not, have no derivative that serves a whole
    step. Each new point would promise another chi2 that none attains, and a search be refused where it ends.
    """
    used, old = best.reduced.misfits.size, best.nuisances
    held = np.zeros(owner.size, bool) if old.held is None else old.held.copy()
    promised = promised_misfits(best.reduced, owner, old, point.nuisances, step)
    hoped, attained = best.reduced.misfits - promised, best.reduced.misfits - point.reduced.misfits
    failed = np.flatnonzero((attained < KEPT * hoped) & (hoped - attained > least) & ~held[:used])
    if not failed.size:
        return None
    states, better = old.states.copy(), failed[attained[failed] > 0.0]
    states[better] = point.nuisances.states[better]
    held[failed] = True
    return old._replace(states=states, held=held)


def _with_implied_nuisances(
    simulator: Simulator,
    best: Point,
    places: tuple[int, ...],
    slopes: list[float],
    owner: Int[np.ndarray, " lanes"],
) -> Point:
    """Give a point again with the nuisances that it implies.

    Its chi2 is that at the end of one linear step of the initial states. From far, that step promises what no
    later point reaches, however short the step of the coefficients.
    """
    still = np.zeros(len(places))
    moved = step_nuisances(best.reduced, owner, best.nuisances, still)
    return simulator.evaluate(best.model, one_hot(best.model, places, slopes), moved)


def _from_measured_states(
    simulator: Simulator, best: Point, places: tuple[int, ...], slopes: list[float]
) -> Point:
    """Give a point again from the measured states, where those that it implies run away."""
    fresh = simulator.settle(
        best.nuisances.afresh(), best.model, len(best.model.elements), best.nuisances.spread
    )._replace(held=best.nuisances.held)
    return simulator.evaluate(best.model, one_hot(best.model, places, slopes), fresh)


def _gain(levels: list[float], steps: int) -> float:
    """Give what the last accepted steps took off chi2; more than anything before there were so many."""
    return levels[-steps - 1] - levels[-1] if len(levels) > steps else float("inf")


def _in_physical_units(point: Point, slopes: list[float]) -> Point:
    """Rescale the columns of a point from unbounded variables to physical coefficients."""
    # At the very end of an interval nothing moves with the variable: no column, and no error bar.
    still = np.asarray(slopes) == 0.0
    factor = np.append(np.where(still, 0.0, 1.0 / np.where(still, 1.0, slopes)), 1.0)
    # Close to the end of an interval the factor may be out of range: then there is no error bar either.
    with np.errstate(over="ignore", invalid="ignore"):
        by_record = point.reduced.by_record * np.outer(factor, factor)
        stiffness_map = point.reduced.stiffness_map * factor
        # The stiffness scale stands between the coefficients and the residual.
        wide = np.insert(factor, -1, [1.0] * (point.reduced.segments_map.shape[1] - factor.size))
        segments_map = point.reduced.segments_map * wide
    return point._replace(
        reduced=point.reduced._replace(
            by_record=by_record, stiffness_map=stiffness_map, segments_map=segments_map
        )
    )
