"""How far a model is from records: free runs from start to end, and restarts at every segment."""

import dataclasses
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from ..._show import number, shown
from ...models import Isolator
from ...records import Record
from ..jacobian import STIFFNESS_SCALE_UNIT, Segment, readings
from ._elimination import Nuisances, Spread
from ._initial_states import best_nuisances, find_initial_states
from ._problem import Point, Problem, stiffness_deviation
from ._simulator import Simulator


@shown
class Errors(NamedTuple):
    """Errors of one role's records.

    Attributes:
        rmse: free-run error, rms [SI unit of the output].
        nrmse: the same over the rms of the measured output about its record's mean.
        nrmse_segments: the error with every segment restarted, likewise normalised.
        chi2_per_dof: squared whitened error with every segment restarted, a degree of freedom.
        dof: degrees of freedom: independent samples less what initial states and coefficients took.
    """

    rmse: float
    nrmse: float
    nrmse_segments: float
    chi2_per_dof: float
    dof: float

    def _headline(self) -> str:
        shares = f"NRMSE {100.0 * self.nrmse:.3g} %, restarted {100.0 * self.nrmse_segments:.3g} %"
        return f"free run {shares}, χ²/dof {self.chi2_per_dof:.4g}"


@shown
class Run(NamedTuple):
    """One record against its simulation.

    Attributes:
        record: the record.
        simulated: what the sensor chain would record [SI unit of the output].
        counted: whether each sample's error counts.
    """

    record: Record
    simulated: Float[np.ndarray, " time"]
    counted: Float[np.ndarray, " time"]

    @property
    def residual(self) -> Float[np.ndarray, " time"]:
        """Measured less simulated [SI unit of the output]; 0 where a sample does not count."""
        return np.where(self.counted > 0.0, self.record.output - self.simulated, 0.0)

    def _headline(self) -> str:
        return f"{self.record.name}, residual {number(float(np.sqrt(np.mean(self.residual**2))))} rms"


@shown
class Restarts(NamedTuple):
    """Records with every segment restarted from its own best initial state.

    Attributes:
        runs: each record, its segments joined.
        point: the equations at the best nuisances.
        deviations: of each record's linear stiffness, that of its segments included, at every sample
            [relative].
    """

    runs: tuple[Run, ...]
    point: Point
    deviations: tuple[Float[np.ndarray, " time"], ...]

    @property
    def stiffness(self) -> Float[np.ndarray, " record"]:
        """Relative deviation of each record's linear stiffness."""
        return stiffness_deviation(self.point.nuisances)


def without_values(run: Run) -> Run:
    """Give the run of a search that failed: no number may pass for its simulation."""
    return run._replace(simulated=np.full_like(run.simulated, np.nan))


def _simulate_lanes(
    simulator: Simulator, model: Isolator, nuisances: Nuisances
) -> list[Float[np.ndarray, " sample"]]:
    """Simulate every segment from its best initial state."""
    prepared = simulator.prepared(model, len(model.elements))
    starts, scales = simulator.starts(model, prepared)
    states = starts + scales * nuisances.states.T
    factor = nuisances.factor(prepared.record)
    simulated = readings(model, factor, states, prepared)
    return [simulated[: part.stop - part.start, lane] for lane, part in enumerate(prepared.segments)]


def restart_records(
    simulator: Simulator,
    model: Isolator,
    spread: Spread,
    known: Nuisances | None = None,
    places: tuple[int, ...] = (),
) -> Restarts:
    """Restart every segment from its best initial state; no coefficient is touched.

    Args:
        simulator: the records.
        model: the isolator.
        spread: prior standard deviations of the linear stiffness.
        known: nuisances to start from; the measured states if omitted.
        places: see `best_nuisances`.

    Returns:
        The records against their restarted simulations.
    """
    problem = simulator.problem
    point = best_nuisances(simulator, model, spread, known, places)
    deviations = [
        np.full(record.output.size, own)
        for record, own in zip(problem.records, stiffness_deviation(point.nuisances), strict=True)
    ]
    for part, more in zip(problem.segments, point.nuisances.segments, strict=False):
        deviations[part.record][part.start : part.stop] += STIFFNESS_SCALE_UNIT * more
    return Restarts(restarted_runs(simulator, model, point.nuisances), point, tuple(deviations))


def restarted_runs(simulator: Simulator, model: Isolator, nuisances: Nuisances) -> tuple[Run, ...]:
    """Simulate every record, each segment from its best initial state.

    Args:
        simulator: the records.
        model: the isolator.
        nuisances: that belong to it.

    Returns:
        The records against their simulations, segments joined.
    """
    problem = simulator.problem
    simulated = [np.full(record.output.size, np.nan) for record in problem.records]
    counted = [np.zeros(record.output.size) for record in problem.records]
    for part, values in zip(problem.segments, _simulate_lanes(simulator, model, nuisances), strict=True):
        simulated[part.record][part.start : part.stop] = values
        counted[part.record][part.counted : part.stop] = 1.0
    return tuple(Run(*entry) for entry in zip(problem.records, simulated, counted, strict=True))


def run_freely(problem: Problem, model: Isolator) -> tuple[Run, ...]:
    """Simulate each record from its start to its end with nothing fed back.

    The initial state comes from the samples that the campaign gives for it (`settle`), else from the first
    second; internal states start at rest, and no stiffness scale is applied. Where the mean of a record was
    removed that of its run is, too.

    Args:
        problem: the records.
        model: the isolator.

    Returns:
        One run a record.
    """
    runs, records = _run_once(problem, model), problem.records
    removed = [record.lacks_mean(problem.quantity) for record in records]
    if not any(removed):
        return runs
    # Initial states are sought with the mean that a record had; a run that diverged has none.
    means = [
        float(np.nan_to_num(own * run.simulated.mean(), posinf=0.0, neginf=0.0))
        for run, own in zip(runs, removed, strict=True)
    ]
    whole = [
        dataclasses.replace(record, output=record.output + mean)
        for record, mean in zip(records, means, strict=True)
    ]
    runs = _run_once(problem._replace(records=tuple(whole)), model)
    return tuple(
        Run(record, run.simulated - own * run.simulated.mean(), run.counted)
        for record, run, own in zip(records, runs, removed, strict=True)
    )


def _run_once(problem: Problem, model: Isolator) -> tuple[Run, ...]:
    """Simulate each record, its output as it stands."""
    records = problem.records
    initial = find_initial_states(problem, model)
    whole = problem._replace(
        heads=(),
        segments=tuple(
            Segment(place, 0, record.output.size, record.settle) for place, record in enumerate(records)
        ),
    )
    prepared = Simulator(whole).prepared(model, len(model.elements))
    states = np.zeros((initial.shape[0], prepared.record.size))
    states[:, : len(records)] = initial
    simulated = readings(model, np.ones(prepared.record.size), states, prepared)
    return tuple(
        Run(
            record,
            simulated[: record.output.size, place],
            (np.arange(record.output.size) >= record.settle).astype(float),
        )
        for place, record in enumerate(records)
    )


def summarise(free: tuple[Run, ...], restarts: Restarts, role: str, coefficients: int) -> Errors | None:
    """Give the errors of one role's records.

    Args:
        free: free runs of all records.
        restarts: restarted runs of all records.
        role: "fit" or "holdout".
        coefficients: coefficients that were fitted to these records.

    Returns:
        The errors, or None if no record has this role.
    """
    places = [place for place, run in enumerate(free) if run.record.role == role]
    if not places:
        return None

    def rms(runs: tuple[Run, ...]) -> tuple[float, float]:
        error = signal = count = 0.0
        for place in places:
            run = runs[place]
            kept = run.counted > 0.0
            measured = run.record.output[kept]
            error += float(np.sum(run.residual[kept] ** 2))
            signal += float(np.sum((measured - measured.mean()) ** 2))
            count += kept.sum()
        return float(np.sqrt(error / count)), float(np.sqrt(error / signal)) if signal > 0.0 else float("nan")

    rmse, nrmse = rms(free)
    point = restarts.point
    known = np.isfinite(rmse)
    chi2 = float(point.reduced.by_record[places, -1, -1].sum()) if known else float("nan")
    left = float(np.sum(point.samples[places] - point.reduced.eliminated[places])) - coefficients
    dof = max(1.0, left) if known else float("nan")
    return Errors(rmse, nrmse, rms(restarts.runs)[1], chi2 / dof, dof)
