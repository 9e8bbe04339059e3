"""The noise that a good fit leaves: that of the output, and what comes through the drive channel."""

import dataclasses

import numpy as np
from jaxtyping import Float

from ..._results import is_successful
from ...records import Campaign, NoiseEstimate, estimate_noise, residual_noise
from .._rules import Rules
from ._errors import Run, restarted_runs
from ._estimate import Estimate
from ._lack_of_fit import locked_power, shows_noise


def noise_left(
    found: Estimate, campaign: Campaign, noise: NoiseEstimate, rules: Rules
) -> NoiseEstimate | None:
    """Give the noise that a good fit leaves, if it is another than the output shows.

    A fit is good here where nothing of its residual is locked to the drive; how large the residual is does
    not matter. Only records in which noise and what is locked are told apart have a say.

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
    if left is None:
        return None
    return dataclasses.replace(
        left, excess=found.chi2 / found.dof / _through_the_drive(found, runs, campaign, noise)
    )


def _through_the_drive(
    found: Estimate, runs: tuple[Run, ...], campaign: Campaign, noise: NoiseEstimate
) -> float:
    """Give the mean square of the residual's noise over that of the output's, as the same windows show both.

    The output shows the noise of its sensor and the response to all real forces. What the residual holds
    beyond it without coming back with the drive came through the simulation, from the drive channel.
    """
    residuals = tuple(dataclasses.replace(run.record, output=run.residual) for run in runs)
    seen = estimate_noise(dataclasses.replace(campaign, records=residuals))
    if seen.method != noise.method or noise.method not in ("cycle_scatter", "periods"):
        return 1.0
    return max(1.0, float(np.mean((np.array(seen.whites) / np.array(found.problem.noise)) ** 2)))
