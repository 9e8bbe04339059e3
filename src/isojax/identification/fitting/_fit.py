"""The fit: coefficients linear from the time histories of all records together."""

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from ..._cores import in_own_threads
from ..._parameters import replace_at
from ..._progress import silent
from ..._results import RESULTS, is_successful
from ..._types import check_float64
from ...models import Integrator, Isolator, Modelled, as_isolator, check_integrator
from ...records import Campaign, estimate_noise, refuse_contradictions
from .._rules import Rules
from ..guess import as_campaign, classical_guess, linear_starts
from ._drive_noise import drive_noise
from ._estimate import Estimate, estimate, free_places
from ._fit_of_errors import as_fit_of_errors, fit_errors_of, suits_innovations
from ._fit_result import Fit
from ._noise_left import noise_left
from ._problem import Problem
from ._search import DEFAULT_SOLVER, MOST_EVALUATIONS, Search, search_of
from ._weighted_fits import complete, fit_with_errors, loudness, simulator_for, weighted_by, with_less_noise


@in_own_threads
def fit(
    model: Isolator | Modelled | Campaign | str | Path,
    campaign: Campaign | str | Path | None = None,
    *,
    free: tuple[str, ...] | None = None,
    fixed: tuple[str, ...] = (),
    solver: Any = DEFAULT_SOLVER,
    integrator: Integrator | None = None,
    max_steps: int = MOST_EVALUATIONS,
    progress: Callable[[str], None] = silent,
    rules: Rules = Rules(),
    anyway: bool = False,
) -> Fit:
    """Fit the coefficients of a model to the time histories of all fitting records together.

    Least squares on the measured samples, weighted by the channel's noise, with exact forward-mode
    derivatives. Dwells and windows start from states of their own, and the linear stiffness may differ from
    record to record by as much as repeats show; both are eliminated before optimistix sees the residual. A
    good fit whose residual shows other noise than the output does is repeated, weighted by that.

    Args:
        model: start, such as `classical_guess(campaign)` or its `.model`; a campaign by itself, or its path,
            is fitted from its classical guess.
        campaign: the measurements, or the path of their campaign.toml or its folder.
        free: names or symbols of the coefficients to fit, and no others; all fitted kinds (and the mass,
            where the campaign frees it) if omitted.
        fixed: names or symbols of coefficients to hold.
        solver: an optimistix least-squares solver.
        integrator: solver and steps; the coarsest steps of RK4 whose error is a twentieth of the noise, if
            omitted. Any other diffrax solver, such as `Integrator(diffrax.Dopri8(), rtol=1e-8)`, simulates
            every segment, free run and refit with its own tolerances, and is differentiated; it takes a law
            that jumps as `simulate` does, rounded, and several times as long.
        max_steps: simulations with derivatives after which the search gives up.
        progress: receives a line a step.
        rules: what counts as scatter of the stiffness.
        anyway: whether records that contradict their declaration are fitted all the same.

    Returns:
        The fit. Where the search failed, `result` says why and every error is NaN.

    Raises:
        ValueError: if a name is no parameter of the model, `integrator` cannot simulate records, the model is
            not driven as the campaign's isolator is, records differ in sampling rate, or their noise is
            neither declared nor to be estimated; if the records contradict their declaration, as
            `refuse_contradictions` says it.
        RuntimeError: if JAX is not in 64-bit mode.

    Example:
        With the start of `classical_guess`'s example:

        >>> fitted = ij.fit(guess.model, campaign)
        >>> print(f"{float(fitted.model['linear_stiffness.coefficient']):.2g} N/m, nrmse {fitted.nrmse:.2f}")
        1.1e+06 N/m, nrmse 0.22
        >>> fitted.parameters["k1"].unit, fitted.parameters["k1"].standard_error < 1e4
        ('N/m', True)
    """
    check_float64()
    if campaign is None and isinstance(model, Campaign | str | Path):
        campaign = as_campaign(model)
        model = classical_guess(campaign)
    campaign, model = as_campaign(campaign), as_isolator(model, recorded=True)
    if integrator is not None:
        check_integrator(integrator)
    places = free_places(model, fixed, free, campaign.mass_free)
    _check_excitation(model, campaign)
    if not anyway:
        # A delay or a skew that the model stands for contradicts nothing.
        named = tuple(element.name for element in model.elements)
        refuse_contradictions(dataclasses.replace(campaign, elements=named))
    search = search_of(campaign, rules, solver, progress, max_steps)
    found = fit_by_output(model, campaign, search, places, integrator)
    found = beside_random_force(found, search, integrator is None)
    return beside_own_noise(found, search, integrator is None)


def fit_by_output(
    model: Isolator,
    campaign: Campaign,
    search: Search,
    places: tuple[int, ...] | None = None,
    integrator: Integrator | None = None,
) -> Fit:
    """Fit a model, weighted by the noise that the output shows, or that the fit leaves where that is less.

    Args:
        model: start.
        campaign: the measurements.
        search: how to search.
        places: coefficients to fit, in `list_parameters`; those that the campaign frees if omitted.
        integrator: solver and steps, or None to choose them.

    Returns:
        The fit.

    Raises:
        ValueError: if records differ in sampling rate, or their noise is neither declared nor can be
            estimated.
    """
    places = free_places(model, (), None, campaign.mass_free) if places is None else places
    noise = estimate_noise(campaign)
    whole = integrator is None and search.max_steps >= MOST_EVALUATIONS
    declared = campaign.input.noise is not None or campaign.random_force is not None
    followed = whole and suits_innovations(campaign, stepped=declared)
    # Under base excitation the drive is as noisy as the response: both are readings of accelerometers.
    noisy = declared or campaign.input.quantity == "base_acceleration"
    any_followed = whole and suits_innovations(campaign, stepped=True)
    if (followed and noisy) or (any_followed and campaign.lacks_mean):
        return fit_with_errors(fit_errors_of(model, places, campaign, search), model, campaign, search)
    if not (np.isfinite(noise.sigma) and noise.sigma > 0.0):
        raise ValueError(
            f"{campaign.file}: the noise of the output must be above 0, but the records, so short or so "
            f"clean, show {noise.sigma:g}; declare it: [output] noise = its rms"
        )

    def fit_from(start: Isolator) -> Estimate:
        return estimate(simulator_for(start, campaign, noise, integrator), start, places, search)

    found = fit_from(model)
    linear = replace_at(model, places, linear_starts(model, places)[0])
    if not is_successful(found.result) and linear.parameters != model.parameters:
        diverges = found.result == RESULTS.not_finite
        why = (
            "simulation from the start values diverges" if diverges else "search from the start values fails"
        )
        search.progress(f"the {why}: again from their linear part")
        again = fit_from(linear)
        if is_successful(again.result) or (diverges and again.result != RESULTS.not_finite):
            found = again
    usual = is_successful(found.result) and found.chi2 < search.rules.contradicted * found.dof
    lost = whole and (not is_successful(found.result) or found.chi2 > still(found.problem))
    far = followed and not (usual and loudness(noise, campaign) < search.rules.loudest)
    if far or (lost and any_followed):
        search.progress("the model leaves far more than noise: again, with a random force")
        return fit_with_errors(fit_errors_of(model, places, campaign, search), model, campaign, search)
    return with_less_noise(complete(found, model, campaign, noise), search)


def beside_random_force(found: Fit, search: Search, any_steps: bool = True) -> Fit:
    """Fit again beside a random force on the mass, where a good fit leaves noise of the colour of its answer.

    A floor that shakes, or air that moves, adds most near the resonance. Dwells and periods show that as
    coloured noise of the output. A filter knows where it comes from.

    Args:
        found: a fit weighted by the noise that the output shows.
        search: how to search.
        any_steps: whether the integration steps are free.

    Returns:
        The fit; `found` itself where its noise is white, or is no answer to a random force.
    """
    campaign, rules = found.campaign, search.rules
    if not (any_steps and search.max_steps >= MOST_EVALUATIONS and found.innovations is None):
        return found
    good = is_successful(found.result) and found.stats.chi2 <= rules.good * found.stats.dof
    if not (good and found.noise.method in ("cycle_scatter", "periods")):
        return found
    if not suits_innovations(campaign, stepped=True) or drive_noise(found, rules) is not None:
        return found
    if not found.noise.whitening and weighted_by_residual(found, search) is found:
        return found
    search.progress("the noise is coloured: again, beside a random force on the mass")
    errors = fit_errors_of(
        found.model, found.estimate.places, campaign, search, found.stats.stiffness_scatter
    )
    if not (errors.is_noise and errors.has_force and is_successful(errors.result)):
        return found
    return _with_next_scatter(as_fit_of_errors(errors, found.start, campaign), found)


def _with_next_scatter(again: Fit, found: Fit) -> Fit:
    """Keep what a fit says of a further record's stiffness."""
    further = found.stats.next_stiffness_scatter
    return again._replace(stats=again.stats._replace(next_stiffness_scatter=further))


def beside_own_noise(found: Fit, search: Search, any_steps: bool = True) -> Fit:
    """Fit again beside the noise of the drive, or by the noise that a good fit leaves.

    Dwells and periods show whether noise of the drive channel is what the fit leaves. A filter then follows
    the records, as under a random force; where it needs more than that noise, it does not stand.

    Args:
        found: a fit weighted by the noise that the output shows.
        search: how to search.
        any_steps: whether the integration steps are free.

    Returns:
        The fit.
    """
    campaign, rules = found.campaign, search.rules
    whole = any_steps and search.max_steps >= MOST_EVALUATIONS and found.innovations is None
    seen = drive_noise(found, rules) if whole and suits_innovations(campaign, stepped=True) else None
    if seen is None:
        return weighted_by_residual(found, search)
    search.progress(f"the drive channel carries noise of {seen.drive:.3g} rms: again, beside it")
    noisy = dataclasses.replace(campaign, input=dataclasses.replace(campaign.input, noise=seen.drive))
    scatter = found.stats.stiffness_scatter
    errors = fit_errors_of(found.model, found.estimate.places, noisy, search, scatter)
    alone = errors.is_noise and errors.sizes.variance < rules.as_declared * seen.drive**2
    if not (alone and is_successful(errors.result)):
        return weighted_by_residual(found, search)
    return _with_next_scatter(fit_with_errors(errors, found.start, campaign, search), found)


def weighted_by_residual(found: Fit, search: Search) -> Fit:
    """Fit again by the noise that a good fit leaves, where that is another than the output shows.

    Args:
        found: a fit weighted by the noise that the output shows.
        search: how to search.

    Returns:
        The fit; `found` itself where its residual is locked to the drive or shows the same noise.
    """
    if found.innovations is not None:
        return found
    left = noise_left(found.estimate, found.campaign, found.noise, search.rules)
    if left is None:
        return found
    search.progress("what the fit leaves is other noise than the output shows: again, weighted by that")
    return weighted_by(found, left, search)


def weighted_by_output(found: Fit, search: Search) -> Fit:
    """Undo `weighted_by_residual`: what is missing is judged by the noise that the output shows.

    Args:
        found: a fit.
        search: how to search.

    Returns:
        The fit, as `fit_by_output` weighs it.
    """
    if found.innovations is not None and found.innovations.filter.measured.force[0] > 0.0:
        declared = found.campaign.input.noise is not None or found.campaign.random_force is not None
        return (
            found if declared else fit_by_output(found.model, found.campaign, search, found.estimate.places)
        )
    jumps = found.model.splits and found.estimate.problem.is_uncut  # in the output they look like noise
    if found.noise.method != "residual" or found.innovations is not None or jumps:
        return found
    return with_less_noise(weighted_by(found, estimate_noise(found.campaign), search), search)


def still(problem: Problem) -> float:
    """Give chi2 of a mass that stands still: a fit that leaves more is none.

    Args:
        problem: the records.
    """
    pairs = zip(problem.records, problem.noise, strict=True)
    return problem.share * sum(float(np.sum((record.output / noise) ** 2)) for record, noise in pairs)


def _check_excitation(model: Isolator, campaign: Campaign) -> None:
    """Refuse a model that is driven otherwise than the isolator was."""
    wanted = "base_acceleration" if campaign.input.quantity == "base_acceleration" else "force"
    if model.excitation != wanted:
        raise ValueError(
            f'Argument `model` must have excitation "{wanted}", because the input of {campaign.file} is '
            f'"{campaign.input.quantity}", but has "{model.excitation}".'
        )
