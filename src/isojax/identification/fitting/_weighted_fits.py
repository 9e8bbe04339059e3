"""Estimates made into fits, weighted by the noise that they leave; with a random force and without."""

import math

import numpy as np

from ..._results import is_successful
from ...models import Integrator, Isolator
from ...records import Campaign, NoiseEstimate
from ..innovations import ErrorFit
from ._build_problem import build_problem
from ._estimate import Estimate, estimate
from ._evaluation import Evaluation
from ._fit_of_errors import as_fit_of_errors, noise_of_errors
from ._fit_result import Fit
from ._integration_steps import find_integrator
from ._noise_left import less_noise
from ._saved_fit import Statistics
from ._search import Search
from ._simulator import Simulator

_WEIGHINGS = 4
"""Times that a fit is weighted anew by less noise."""

_OF_A_SOLUTION = ("chi2", "aic", "bic", "stiffness_scatter", "segment_scatter", "next_stiffness_scatter")
"""Statistics that a search which failed does not have."""

_FEW_STEPS = 20
"""Simulations with derivatives of a search that starts where a filter ended."""


def loudness(noise: NoiseEstimate, campaign: Campaign) -> float:
    """Give the noise by which records weigh, over the rms of their output: the median of all."""
    pairs = zip(noise.levels, campaign.records, strict=True)
    return float(np.median([level / max(float(np.std(one.output)), 1e-300) for level, one in pairs]))


def fit_with_errors(found: ErrorFit, start: Isolator, campaign: Campaign, search: Search) -> Fit:
    """Make a fit of a model that was fitted together with the sizes of its errors.

    Where noise of the output is the only error, a search without a random force ends it: initial states are
    then exact. Of a law that jumps the filter has them, and sees jumps that are misplaced as such; of records
    whose mean was removed it has the zeros.

    Args:
        found: the model with the sizes of its errors.
        start: the isolator that the search started from.
        campaign: the measurements.
        search: how to search.

    Returns:
        The fit.
    """
    if found.is_noise_of_output and not found.model.splits and found.filter.zeros is None:
        noise = noise_of_errors(found, campaign, alone=True)
        simulator = simulator_for(found.model, campaign, noise, None, uncut=True)
        near = search._replace(max_steps=_FEW_STEPS)
        plain = complete(estimate(simulator, found.model, found.places, near), start, campaign, noise)
        if is_successful(plain.result) and np.all(np.isfinite(plain.covariance)):
            return plain._replace(innovations=found)
    return as_fit_of_errors(found, start, campaign)


def with_less_noise(found: Fit, search: Search) -> Fit:
    """Fit again by the noise that a fit leaves, as long as that is less than what it was weighted by.

    Noise that is taken for far too loud lets a fit end far from its best, so that one round may not do.
    """
    shown = found.noise
    for _ in range(_WEIGHINGS):
        less = less_noise(found.estimate, found.campaign, shown, found.noise)
        if less is None:
            return found
        search.progress("the fit leaves less than the noise that the output shows: again, weighted by that")
        again = weighted_by(found, less, search)
        if again is found:
            return found
        found = again
    return found


def weighted_by(found: Fit, noise: NoiseEstimate, search: Search) -> Fit:
    """Fit again by other noise; the fit itself where that fails."""
    problem = found.estimate.problem._replace(
        noise=_whites_fitted(noise, found.campaign), share=noise.share, whitening=noise.whitening
    )
    again = estimate(Simulator(problem), found.model, found.estimate.places, search)
    if not is_successful(again.result):
        return found
    steps = found.stats.steps + again.steps
    return complete(again._replace(steps=steps), found.start, found.campaign, noise)


def _whites_fitted(noise: NoiseEstimate, campaign: Campaign) -> tuple[float, ...]:
    return tuple(
        own for own, record in zip(noise.whites, campaign.records, strict=True) if record.role == "fit"
    )


def simulator_for(
    model: Isolator,
    campaign: Campaign,
    noise: NoiseEstimate,
    integrator: Integrator | None,
    uncut: bool = False,
) -> Simulator:
    """Give the simulator of a campaign's fitting records.

    Args:
        model: the isolator.
        campaign: the measurements.
        noise: the noise of the output.
        integrator: solver and steps, or None to choose them.
        uncut: see `build_problem`.

    Returns:
        The simulator.
    """
    problem = build_problem(
        campaign.fit_records,
        model,
        quantity=campaign.output.quantity,
        hold=campaign.input.hold,
        noise=_whites_fitted(noise, campaign),
        share=noise.share,
        whitening=noise.whitening,
        integrator=Integrator() if integrator is None else integrator,
        uncut=uncut,
    )
    if integrator is None:
        problem = find_integrator(problem, model)
    return Simulator(problem)


def complete(found: Estimate, start: Isolator, campaign: Campaign, noise: NoiseEstimate) -> Fit:
    """Make an estimate into a fit.

    Args:
        found: the estimate.
        start: the isolator that the search started from.
        campaign: the measurements.
        noise: the noise.

    Returns:
        The fit; it is compared with every record when that is first asked for.
    """
    samples, count = int(found.point.samples.sum()), len(found.places)
    stats = Statistics(
        samples,
        count,
        found.chi2,
        found.dof,
        found.chi2 + 2.0 * count,
        found.chi2 + count * float(np.log(samples)),
        found.steps,
        *found.point.nuisances.spread,
        found.problem.step_error,
        found.next_stiffness_scatter,
    )
    if not is_successful(found.result):
        stats = stats._replace(**dict.fromkeys(_OF_A_SOLUTION, math.nan))
    return Fit(
        found.model,
        start,
        campaign,
        found.names,
        found.uncertainty.covariance,
        stats,
        noise,
        found.result,
        found,
        Evaluation(found, campaign, noise.whites),
    )
