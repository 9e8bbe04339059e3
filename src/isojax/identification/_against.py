"""An estimate held against every record of its campaign: worked out once, when it is first asked for."""

from functools import cached_property

import numpy as np

from .._results import is_successful
from ..records import Campaign
from ._errors import Errors, Restarts, Run, restart_records, run_freely, summarise, without_values
from ._estimate import Estimate
from ._problem import Bench
from ._setup import build_problem


class Against:
    """A model against records, fitted and held out.

    A search of coefficients does not need it, and it costs a good part of one; hence it waits.
    """

    def __init__(self, found: Estimate, campaign: Campaign):
        """Keep what is to be compared; nothing is simulated yet."""
        self._found = found
        self._campaign = campaign

    @cached_property
    def _runs(self) -> tuple[tuple[Run, ...], Restarts]:
        """Free runs and restarts of every record; NaN where the search failed."""
        found, fitted = self._found, self._found.bench.problem
        everything = build_problem(
            self._campaign.records,
            found.model,
            quantity=fitted.quantity,
            hold=fitted.hold,
            noise=fitted.noise,
            share=fitted.share,
            integrator=fitted.integrator,
        )
        nuisances = found.point.nuisances
        with np.errstate(over="ignore", invalid="ignore"):
            free_runs = run_freely(everything, found.model)
            if everything.records == fitted.records and everything.segments == fitted.segments:
                restarts = restart_records(
                    found.bench, found.model, nuisances.spread, nuisances, found.places
                )
            else:
                restarts = restart_records(Bench(everything), found.model, nuisances.spread)
        if not is_successful(found.result):
            free_runs = tuple(without_values(run) for run in free_runs)
            restarts = restarts._replace(runs=tuple(without_values(run) for run in restarts.runs))
        return free_runs, restarts

    @property
    def free_runs(self) -> tuple[Run, ...]:
        """Every record simulated from its start to its end with nothing fed back."""
        return self._runs[0]

    @property
    def restarts(self) -> Restarts:
        """Every record with each segment restarted from its own best initial state."""
        return self._runs[1]

    @cached_property
    def errors(self) -> dict[str, Errors | None]:
        """Errors by role, "fit" and "holdout" (None without such records)."""
        return {
            "fit": summarise(self.free_runs, self.restarts, "fit", len(self._found.places)),
            "holdout": summarise(self.free_runs, self.restarts, "holdout", 0),
        }
