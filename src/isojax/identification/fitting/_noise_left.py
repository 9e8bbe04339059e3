"""The noise that a good fit leaves: the output's over whole records, and what the drive channel adds."""

import dataclasses

import numpy as np
from jaxtyping import Float

from ..._results import is_successful
from ...records import Campaign, NoiseEstimate, residual_noise
from .._rules import Rules
from ._errors import restarted_runs
from ._estimate import Estimate
from ._lack_of_fit import locked_power, shows_noise


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
    locked = locked_power(runs, len(found.places), campaign.output.relative_error).p_value
    if not locked >= rules.significance:
        return None
    windows: dict[str, list[Float[np.ndarray, " _"]]] = {record.name: [] for record in campaign.records}
    for part in found.problem.segments:
        run = runs[part.record]
        if shows_noise(run.record):
            windows[run.record.name].append(run.residual[part.counted : part.stop])
    left = residual_noise(campaign, noise, [windows[record.name] for record in campaign.records])
    return None if left is None else dataclasses.replace(left, excess=found.chi2 / found.dof)
