"""The noise that a fit leaves: the output's over whole records, and what the drive channel adds."""

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Float

from ..._results import is_successful
from ...records import Campaign, NoiseEstimate, Record, quieter_noise, residual_noise
from .._rules import Rules
from ._errors import Run, restarted_runs
from ._estimate import Estimate
from ._lack_of_fit import USUAL_ACCURACY, locked_power, shows_noise


def less_noise(
    found: Estimate, campaign: Campaign, shown: NoiseEstimate, taken: NoiseEstimate
) -> NoiseEstimate | None:
    """Give the noise that a fit leaves, where it leaves less than it was weighted by.

    Args:
        found: the estimate.
        campaign: the measurements.
        shown: noise that the output shows.
        taken: noise that weighted the fit.

    Returns:
        The noise; None where the fit leaves no less.
    """
    if not is_successful(found.result) or found.problem.heads:
        return None
    # Of white noise chi2 says it; under a colour it counts what the whitening leaves.
    if taken.colour is None and found.chi2 >= found.dof:
        return None
    runs = restarted_runs(found.simulator, found.model, found.point.nuisances)
    return quieter_noise(campaign, shown, taken, _windows(found, campaign, runs, lambda record: True))


def noise_left(
    found: Estimate, campaign: Campaign, noise: NoiseEstimate, rules: Rules
) -> NoiseEstimate | None:
    """Give the noise that a good fit leaves, if it is another than the output shows.

    A fit is good here where nothing of its residual is locked to the drive; how large the residual is does
    not matter. Only records that distinguish noise from what is locked count.

    Args:
        found: the estimate, weighted by the noise that the output shows.
        campaign: the measurements.
        noise: that noise.
        rules: when a residual is locked.

    Returns:
        The noise; None where the fit is not good, or the noise stays as it is.
    """
    if not is_successful(found.result) or found.problem.heads:
        return None
    runs = restarted_runs(found.simulator, found.model, found.point.nuisances)
    locked = locked_power(runs, len(found.places), campaign.accuracy or USUAL_ACCURACY).p_value
    if not locked >= rules.significance:
        return None
    left = residual_noise(campaign, noise, _windows(found, campaign, runs, shows_noise))
    return None if left is None else dataclasses.replace(left, excess=found.chi2 / found.dof)


def _windows(
    found: Estimate, campaign: Campaign, runs: Sequence[Run], counts: Callable[[Record], bool]
) -> list[list[Float[np.ndarray, " _"]]]:
    """Give the residual of each record segment by segment; none of records that do not count."""
    windows: dict[str, list[Float[np.ndarray, " _"]]] = {record.name: [] for record in campaign.records}
    for part in found.problem.segments:
        run = runs[part.record]
        if counts(run.record):
            windows[run.record.name].append(run.residual[part.counted : part.stop])
    return [windows[record.name] for record in campaign.records]
