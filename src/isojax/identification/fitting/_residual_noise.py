"""The noise as the residual of a fit shows it."""

import dataclasses

from ...records import Campaign, NoiseEstimate, estimate_noise
from ._errors import restart_records
from ._estimate import Estimate

SAME_NOISE = 0.005
"""Relative difference of two noise levels below which a fit with the one is a fit with the other: it moves
chi2/dof by a hundredth."""


def residual_noise(found: Estimate, campaign: Campaign) -> NoiseEstimate:
    """Give the noise that the residual of a fit shows where it does not come back with the drive.

    The output alone shows the noise of the sensor. Noise of the force or base channel reaches the residual
    through the simulation, with the density `S_u |H|^2`, and a force that the channel has measured leaves it
    again. What the model has wrong comes back with every cycle and counts no more than the response itself
    does.

    Args:
        found: the estimate.
        campaign: its records.

    Returns:
        The noise, estimated from the residual as `estimate_noise` does it from the output.

    Source: Pintelon & Schoukens 2012, System Identification: A Frequency Domain Approach, sec. 9.2 (noise of
    both channels in the residual).
    """
    nuisances = found.point.nuisances
    runs = restart_records(found.simulator, found.model, nuisances.spread, nuisances, found.places).runs
    records = tuple(dataclasses.replace(run.record, output=run.residual) for run in runs)
    return estimate_noise(dataclasses.replace(campaign, records=records))


def shows_other_noise(seen: NoiseEstimate, assumed: NoiseEstimate) -> bool:
    """Say whether a residual shows other noise than the fit assumed.

    Args:
        seen: noise of the residual.
        assumed: noise that weighed the samples.

    Returns:
        False where the residual shows nothing but the model's errors beside noise: without dwells or periods.
    """
    if seen.method != assumed.method or seen.method not in ("cycle_scatter", "periods"):
        return False
    return seen.whitening != assumed.whitening or abs(seen.white / assumed.white - 1.0) > SAME_NOISE
