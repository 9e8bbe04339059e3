"""An estimate compared with every record of its campaign: computed once, when it is first asked for."""

import dataclasses
from functools import cached_property

import numpy as np

from ..._results import is_successful
from ...records import Campaign
from ._build_problem import build_problem
from ._elimination import Nuisances
from ._errors import Errors, Restarts, Run, restart_records, run_freely, summarise, without_values
from ._estimate import Estimate
from ._problem import Problem
from ._simulator import Simulator
from ._valley import Bent, find_bent


def _carried_over(found: Estimate, simulator: Simulator) -> Nuisances:
    """Give the nuisances of a fit for a simulator that has other records beside the fitted ones."""
    model, carried, old = found.model, len(found.model.elements), found.point.nuisances
    start = simulator.settle(None, model, carried, old.spread)
    places = [place for place, record in enumerate(simulator.problem.records) if record.role == "fit"]
    own, scales = found.simulator.starts(model, found.simulator.prepared(model, carried))
    starts, units = simulator.starts(model, simulator.prepared(model, carried))
    reached = own + scales * old.states.T
    lanes = {
        (part.record, part.start, part.stop): lane for lane, part in enumerate(simulator.problem.segments)
    }
    states, segments = start.states.copy(), start.segments.copy()
    for lane, part in enumerate(found.problem.segments):
        place = lanes.get((places[part.record], part.start, part.stop))
        if place is not None:
            states[place] = (reached[:, lane] - starts[:, place]) / units[:, place]
            segments[place] = old.segments[lane]
    stiffness = start.stiffness.copy()
    stiffness[places] = old.stiffness
    return start._replace(states=states, stiffness=stiffness, segments=segments)


class Evaluation:
    """A model against records, fitted and held out.

    A search of coefficients does not need it, and it costs a good part of one; hence it waits.
    """

    def __init__(self, found: Estimate, campaign: Campaign, noise: tuple[float, ...]):
        """Keep what is to be compared; nothing is simulated yet.

        Args:
            found: the estimate.
            campaign: the measurements.
            noise: of each of their records, as in `Problem`.
        """
        self._found = found
        self._campaign = campaign
        self._noise = noise

    @cached_property
    def _everything(self) -> Problem:
        """Every record, fitted and held out, cut into segments."""
        fitted = self._found.problem
        return build_problem(
            self._campaign.records,
            self._found.model,
            quantity=fitted.quantity,
            hold=fitted.hold,
            noise=self._noise,
            share=fitted.share,
            whitening=fitted.whitening,
            integrator=fitted.integrator,
            uncut=fitted.is_uncut,
        )

    @cached_property
    def free_runs(self) -> tuple[Run, ...]:
        """Every record simulated from its start to its end with nothing fed back; NaN if the fit failed."""
        return self._run(self._everything)

    def _run(self, problem: Problem) -> tuple[Run, ...]:
        with np.errstate(over="ignore", invalid="ignore"):
            runs = run_freely(problem, self._found.model)
        return runs if is_successful(self._found.result) else tuple(map(without_values, runs))

    @cached_property
    def restarts(self) -> Restarts:
        """Every record with each segment restarted from its own best initial state; NaN if the fit failed."""
        found, fitted, everything = self._found, self._found.problem, self._everything
        nuisances = found.point.nuisances
        with np.errstate(over="ignore", invalid="ignore"):
            if everything.records == fitted.records and everything.segments == fitted.segments:
                restarts = restart_records(
                    found.simulator, found.model, nuisances.spread, nuisances, found.places
                )
            else:
                simulator, known = Simulator(everything), None
                if is_successful(found.result):
                    # Beside a fold the measured states may lead to another branch than the fit is on.
                    known = _carried_over(found, simulator)
                restarts = restart_records(simulator, found.model, nuisances.spread, known)
        if is_successful(found.result):
            return restarts
        return restarts._replace(runs=tuple(map(without_values, restarts.runs)))

    @cached_property
    def errors(self) -> dict[str, Errors | None]:
        """Errors by role, "fit" and "holdout" (None without such records)."""
        return {
            "fit": summarise(self.free_runs, self.restarts, "fit", len(self._found.places)),
            "holdout": summarise(self.free_runs, self.restarts, "holdout", 0),
        }

    @cached_property
    def bent(self) -> tuple[Bent, ...]:
        """Coefficients whose standard errors do not describe how chi2 rises; none if the fit failed."""
        return find_bent(self._found) if is_successful(self._found.result) else ()

    @property
    def known_errors(self) -> dict[str, Errors | None] | None:
        """The errors where they have been asked for; None where they would have to be computed."""
        return vars(self).get("errors")


class FreeEvaluation(Evaluation):
    """A model whose error is not noise of the output: its free runs alone are compared.

    A restart would settle initial states against an error that they do not cause.
    """

    @cached_property
    def free_runs(self) -> tuple[Run, ...]:
        """As those of an evaluation; readings of a law that jumps are band-limited or not, as fits better."""
        first = super().free_runs
        if not self._found.model.splits:
            return first
        old = self._everything.integrator
        integrator = dataclasses.replace(old, band_limited=not old.band_limited)
        other = self._run(self._everything._replace(integrator=integrator))
        return min(
            (first, other),
            key=lambda runs: sum(np.sum(one.residual**2) for one in runs if one.record.role == "fit"),
        )

    @cached_property
    def restarts(self) -> Restarts:
        """The free runs."""
        runs, point = self.free_runs, self._found.point
        return Restarts(runs, point, tuple(np.zeros(run.record.output.size) for run in runs))

    @cached_property
    def errors(self) -> dict[str, Errors | None]:
        """Errors of free runs by role; chi2/dof is their mean square over that of the fitted ones."""
        found: dict[str, Errors | None] = {}
        for role in ("fit", "holdout"):
            runs = [
                (run, level)
                for run, level in zip(self.free_runs, self._noise, strict=True)
                if run.record.role == role
            ]
            counted = [run.counted > 0.0 for run, _ in runs]
            measured = [run.record.output[kept] for (run, _), kept in zip(runs, counted, strict=True)]
            errors = [run.residual[kept] for (run, _), kept in zip(runs, counted, strict=True)]
            count = float(sum(one.size for one in errors))
            if not count:
                found[role] = None
                continue
            square = float(sum(np.sum(one**2) for one in errors))
            signal = float(sum(np.sum((one - one.mean()) ** 2) for one in measured))
            scaled = sum(
                float(np.sum((one / level) ** 2)) for one, (_, level) in zip(errors, runs, strict=True)
            )
            share = float(np.sqrt(square / signal)) if signal > 0.0 else float("nan")
            found[role] = Errors(float(np.sqrt(square / count)), share, share, scaled / count, count)
        return found
