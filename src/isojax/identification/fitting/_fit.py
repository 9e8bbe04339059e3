"""The fit: coefficients straight from the time histories of all records together."""

import dataclasses
from collections.abc import Callable
from typing import Any

import equinox as eqx
import numpy as np
import optimistix as optx

from ..._parameters import list_parameters, replace_parameters
from ..._results import RESULTS
from ..._types import check_float64
from ...models import Integrator, Isolator
from ...records import Campaign, NoiseEstimate, estimate_noise
from ..guess import scales as campaign_scales
from ._build_problem import build_problem
from ._estimate import Estimate, estimate, free_places
from ._evaluation import Evaluation
from ._fit_result import Fit, Statistics
from ._integration_steps import find_integrator
from ._problem import Simulator, element_names

DEFAULT_SOLVER = eqx.tree_at(
    lambda solver: solver.search,
    optx.LevenbergMarquardt(rtol=1e-9, atol=1e-9),
    # optimistix lowers the damping only after a step that attains 99 % of the predicted decrease. Along the
    # curved valley of coefficients that the records hardly tell apart none does, and the search would creep.
    optx.ClassicalTrustRegion(high_cutoff=0.75),
)
"""Levenberg-Marquardt whose damping falls after a step that attains 75 % of the predicted decrease of chi2.

Source: Nocedal & Wright 2006, *Numerical Optimization*, algorithm 4.1.
"""

MOST_STEPS = 100
"""Evaluations after which a search gives up: most need ten, a curved valley some eighty."""


def silent(line: str) -> None:
    """Take a line of progress and say nothing.

    Args:
        line: the line.
    """


def fit(
    model: Isolator,
    campaign: Campaign,
    *,
    free: tuple[str, ...] | None = None,
    fixed: tuple[str, ...] = (),
    solver: Any = DEFAULT_SOLVER,
    integrator: Integrator | None = None,
    max_steps: int = MOST_STEPS,
    progress: Callable[[str], None] = silent,
) -> Fit:
    """Fit the coefficients of a model to the time histories of all fitting records together.

    Least squares on the measured samples, weighted by the channel's noise, with exact forward-mode
    derivatives. Dwells and windows start from states of their own, and the linear stiffness may differ from
    record to record by as much as repeats show; both are eliminated before optimistix sees the residual.

    Args:
        model: start, such as `classical_guess(campaign).model`.
        campaign: the measurements.
        free: names of the coefficients to fit, and no others; all fitted kinds (and the mass, where the
            campaign frees it) if omitted.
        fixed: names of coefficients to hold.
        solver: an optimistix least-squares solver.
        integrator: solver and steps; the coarsest steps whose error is a twentieth of the noise, if omitted.
        max_steps: simulations with derivatives after which the search gives up.
        progress: told a line a step.

    Returns:
        The fit. Where the search failed, `result` says why and every error is NaN.

    Raises:
        ValueError: if a name is no parameter of the model, the model is not driven as the campaign's isolator
            is, records differ in sampling rate, or their noise is neither declared nor to be estimated.
        RuntimeError: if JAX is not in 64-bit mode.
    """
    check_float64()
    places = free_places(model, fixed, free, campaign.mass_free)
    _check_excitation(model, campaign)
    # Held-out records must not even weigh the others.
    noise = estimate_noise(dataclasses.replace(campaign, records=campaign.fit_records))
    if not (np.isfinite(noise.sigma) and noise.sigma > 0.0):
        raise ValueError(
            f"{campaign.file}: the noise of the output must be above 0, but the records, so short or so "
            f"clean, show {noise.sigma:g}; declare it: [output] noise = its rms"
        )
    scales = campaign_scales(campaign)

    def search(start: Isolator) -> Estimate:
        simulator = simulator_for(start, campaign, noise.white, integrator, noise.share)
        return estimate(
            simulator,
            start,
            places,
            scales,
            nuisances=None,
            solver=solver,
            max_steps=max_steps,
            progress=progress,
        )

    found = search(model)
    if found.result == RESULTS.not_finite:
        progress("the start runs away: again from its linear part")
        again = search(_linear_part(model, places))
        found = found if again.result == RESULTS.not_finite else again
    return complete(found, model, campaign, noise)


def _linear_part(model: Isolator, places: tuple[int, ...]) -> Isolator:
    """Give the model with every effect absent that is free and not linear: its motion stays within bounds."""
    strengths = {
        f"{name}.{element.strength}"
        for name, element in zip(element_names(model), model.elements, strict=True)
        if not element.proportional_to
    }
    numbers = [
        0.0 * entry.value if place in places and entry.name in strengths else entry.value
        for place, entry in enumerate(list_parameters(model))
    ]
    return replace_parameters(model, numbers)


def _check_excitation(model: Isolator, campaign: Campaign) -> None:
    """Refuse a model that is driven otherwise than the isolator was."""
    wanted = "base_acceleration" if campaign.input.quantity == "base_acceleration" else "force"
    if model.excitation != wanted:
        raise ValueError(
            f'Argument `model` must have excitation "{wanted}", because the input of {campaign.file} is '
            f'"{campaign.input.quantity}", but has "{model.excitation}".'
        )


def simulator_for(
    model: Isolator, campaign: Campaign, noise: float, integrator: Integrator | None, share: float = 1.0
) -> Simulator:
    """Give the bench of a campaign's fitting records.

    Args:
        model: the isolator.
        campaign: the measurements.
        noise: rms of white noise that has the density of the noise inside its band [SI unit of the output].
        integrator: solver and steps, or None to choose them.
        share: share of the samples of which the noise is independent.

    Returns:
        The bench.
    """
    problem = build_problem(
        campaign.fit_records,
        model,
        quantity=campaign.output.quantity,
        hold=campaign.input.hold,
        noise=noise,
        share=share,
        integrator=Integrator() if integrator is None else integrator,
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
        The fit; it is held against the records when that is first asked for.
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
        found.simulator.problem.step_error,
    )
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
        Evaluation(found, campaign),
    )
