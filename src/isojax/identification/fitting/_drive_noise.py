"""Noise of the drive channel, as the residual of a fit shows it."""

import dataclasses
from typing import NamedTuple

import numpy as np

from ..._show import number, shown
from ...records import NoiseEstimate, Record, estimate_noise
from .._rules import Rules
from ._errors import restarted_runs
from ._fit_result import Fit


@shown
class DriveNoise(NamedTuple):
    """Noise of the drive channel that the simulation brings into the residual.

    Attributes:
        drive: rms of what does not repeat in the drive [its SI unit].
        residual: rms noise of the residual [SI unit of the output].
        output: rms noise of the output itself [the same].
    """

    drive: float
    residual: float
    output: float

    def _headline(self) -> str:
        return f"{number(self.drive)} rms; residual {number(self.residual)}, output {number(self.output)} rms"


def drive_noise(fit: Fit, rules: Rules = Rules()) -> DriveNoise | None:
    """Give the noise of the drive channel where it explains why chi2/dof is above one.

    The output shows the noise of its own sensor and the response to real forces. What the residual holds
    beyond it without coming back with the drive can only have come through the simulation: noise of the drive
    channel, with the density `S_u |H|^2`.

    Args:
        fit: the fit; its records must be dwells or periods.
        rules: when a fit is good.

    Returns:
        The noise; None where it does not explain the misfit, or the records do not show it.

    Source: Pintelon & Schoukens 2012, System Identification: A Frequency Domain Approach, sec. 9.2 (noise of
    both channels in the residual).
    """
    ratio = fit.estimate.chi2 / fit.estimate.dof
    if fit.noise.method not in ("cycle_scatter", "periods") or ratio <= rules.good:
        return None
    found = fit.estimate
    runs = restarted_runs(found.simulator, found.model, found.point.nuisances)
    if not all(np.all(np.isfinite(run.residual)) for run in runs):
        return None
    seen = _noise_of(fit, tuple(dataclasses.replace(run.record, output=run.residual) for run in runs))
    if seen.method != fit.noise.method:
        return None
    own = np.array(fit.estimate.problem.noise)
    if ratio > rules.good * np.mean((np.array(seen.whites) / own) ** 2):
        return None
    drive = _noise_of(fit, tuple(dataclasses.replace(run.record, output=run.record.input) for run in runs))
    return DriveNoise(drive.sigma, seen.sigma, fit.noise.sigma)


def _noise_of(fit: Fit, records: tuple[Record, ...]) -> NoiseEstimate:
    """Give the noise that records show in the place of the output."""
    return estimate_noise(dataclasses.replace(fit.campaign, records=records))
