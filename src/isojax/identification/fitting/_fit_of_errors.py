"""Records without dwells, fitted together with the sizes of their errors."""

import dataclasses
import math

import numpy as np
from jaxtyping import Float

from ..._parameters import replace_at
from ..._results import RESULTS, is_successful
from ...excitations import Hold
from ...models import Integrator, Isolator
from ...records import Campaign, NoiseEstimate, Record, estimate_noise, thinned_share
from ..guess import linear_starts, wells_start
from ..innovations import ErrorFit, Measured, fit_measured, refined
from ._build_problem import build_problem
from ._covariance import invert_information
from ._elimination import Spread
from ._estimate import SMALLEST_SCATTER, Estimate, magnitudes
from ._evaluation import FreeEvaluation
from ._fit_result import Fit
from ._problem import one_hot
from ._saved_fit import Statistics
from ._search import Search
from ._simulator import Simulator

_LOUDEST = 1.3
"""Noise of a record at most, over what its output shows: the estimate has an error of its own."""

_SMALL_NOISE = 0.05
"""Noise that any record may have, over its rms: a filtered record shows too little above its band."""

_MUCH_LESS = 0.5
"""Share of the noise that periods or repeats show below which the motion itself does not repeat."""

_SHORTEST_RECORD = 64
"""Samples of a record that a filter follows, at least."""

_SHOWN = ("declared", "repeats", "periods", "cycle_scatter")
"""Methods that show the noise of the output itself."""

_KEPT_A_CYCLE = 25.0
_POWER = 0.999
"""Samples a cycle of the frequency below which so much of the output's power lies: fewer say as much."""

_LEAST_KEPT = 5000
"""Samples of all records below which none are left out."""


def suits_innovations(campaign: Campaign, stepped: bool = False) -> bool:
    """Say whether a campaign's records are followed by a filter from their first sample to their last.

    Args:
        campaign: the measurements.
        stepped: whether records may have dwells.

    Returns:
        False where a record has dwells, unless they may, or is the decay after a release; and where records
        were made under other conditions: the filter has no stiffness of each record.
    """
    if len({record.conditions for record in campaign.fit_records}) > 1:
        return False
    return all(
        (stepped or not record.dwells)
        and record.kind != "free_decay"
        and record.output.size > _SHORTEST_RECORD
        and bool(np.any(record.input))
        for record in campaign.fit_records
    )


def _thinning(records: tuple[Record, ...], hold: Hold) -> int:
    """Give how many samples may become one: what the output holds lies far below half the rate."""
    if hold == "zero_order":
        return 1
    highest = 0.0
    for record in records:
        power = np.abs(np.fft.rfft(record.output - record.output.mean())) ** 2
        share = np.cumsum(power) / max(power.sum(), 1e-300)
        highest = max(highest, float(np.searchsorted(share, _POWER)) * record.rate / record.output.size)
    samples = sum(record.output.size for record in records)
    factor = records[0].rate / (_KEPT_A_CYCLE * highest) if highest > 0.0 else 1.0
    return max(1, int(min(factor, samples / _LEAST_KEPT)))


def measured_of(campaign: Campaign, noise: NoiseEstimate, scatter: float = 0.0) -> Measured:
    """Give the records to fit, as a filter takes them.

    Args:
        campaign: the measurements.
        noise: of their output.
        scatter: see `Measured`.

    Returns:
        The records, thinned where the output is slow.
    """
    fitted = [place for place, record in enumerate(campaign.records) if record.role == "fit"]
    factor = _thinning(campaign.fit_records, campaign.input.hold)
    least = [_SMALL_NOISE * float(np.std(record.output)) for record in campaign.fit_records]
    loudest = np.maximum(_LOUDEST * np.array(noise.whites)[fitted], least)
    return Measured(
        campaign.fit_records,
        campaign.output.quantity,
        campaign.input.hold,
        loudest,
        factor,
        _declared_force(campaign, factor),
        scatter,
    )


def _declared_force(campaign: Campaign, factor: int) -> tuple[float, float]:
    """Give the rms of the random force at least and at most: noise of the drive is one, too."""
    # Of white noise so much is left where samples become one.
    left = 1.0 if factor == 1 else math.sqrt(thinned_share(factor) / factor)
    noise, own = (campaign.input.noise or 0.0) * left, campaign.random_force
    if own is None:
        return noise, math.inf
    both = math.hypot(noise, own * left)
    return both, both


def fit_errors_of(
    model: Isolator, places: tuple[int, ...], campaign: Campaign, search: Search, scatter: float = 0.0
) -> ErrorFit:
    """Fit a model and the sizes of its errors to a campaign.

    Args:
        model: start.
        places: coefficients to fit.
        campaign: the measurements.
        search: the scales of the campaign.
        scatter: see `Measured`.

    Returns:
        The fit.
    """
    measured = measured_of(campaign, estimate_noise(campaign), scatter)
    sizes = magnitudes(model, places, search.scales)
    found = fit_measured(model, places, sizes, measured, starts=linear_starts(model, places))
    wells = None if found.is_noise else wells_start(model, places, search.scales)
    if wells is None:
        return found
    search.progress("the model leaves more than noise: again, from a start with two wells")
    again = fit_measured(replace_at(model, places, wells), places, sizes, measured)
    better = again.criterion < found.criterion or not np.isfinite(found.criterion)
    return refined(again, sizes) if better else found


def as_fit_of_errors(found: ErrorFit, start: Isolator, campaign: Campaign) -> Fit:
    """Make a fit of a model whose error is more than noise of the output.

    Args:
        found: the model with the sizes of its errors.
        start: the isolator that the search started from.
        campaign: the measurements.

    Returns:
        The fit. Its errors are compared with the free run's; its error bars hold the random force.
    """
    noise = noise_of_errors(found, campaign, found.is_noise_of_output)
    fitted = [place for place, record in enumerate(campaign.records) if record.role == "fit"]
    problem = build_problem(
        campaign.fit_records,
        found.model,
        quantity=campaign.output.quantity,
        hold=campaign.input.hold,
        noise=tuple(noise.levels[place] for place in fitted),
        integrator=Integrator(substeps=found.filter.steps),
    )
    simulator, carried = Simulator(problem), len(found.model.elements)
    nuisances = simulator.settle(None, found.model, carried, Spread(SMALLEST_SCATTER))
    count, samples = len(found.places), found.samples
    result = found.result if np.isfinite(found.deviance.sum()) else RESULTS.not_finite
    point = simulator.evaluate(found.model, one_hot(found.model, found.places, [1.0] * count), nuisances)
    # Coefficients are no better known than where slopes and values of the likelihood disagree.
    inflation = max(1.0 if found.is_noise else found.inflation, found.unkept)
    uncertainty = invert_information(found.information, inflation)
    estimate = Estimate(found.model, found.places, simulator, point, uncertainty, result, found.steps)
    deviance, owners = float(found.deviance.sum()), [one.record for one in found.filter.measured.segments]
    levels = np.array([noise.levels[fitted[place]] for place in owners])
    chi2 = found.chi2 if found.is_noise else float(np.sum(found.free_squares / levels**2))
    stats = Statistics(
        int(samples),
        count,
        chi2,
        max(1.0, samples - count),
        deviance + 2.0 * count,
        found.criterion,
        found.steps,
        found.filter.scatter,
        0.0,
        math.nan,
        math.nan,
    )
    if not is_successful(result):
        stats = stats._replace(chi2=math.nan, aic=math.nan, bic=math.nan)
    return Fit(
        found.model,
        start,
        campaign,
        found.names,
        uncertainty.covariance,
        stats,
        noise,
        result,
        estimate,
        FreeEvaluation(estimate, campaign, noise.levels),
        found,
    )


def noise_of_errors(found: ErrorFit, campaign: Campaign, alone: bool) -> NoiseEstimate:
    """Give what errors are compared with: the noise where nothing else is, else the error of the free run.

    Args:
        found: the model with the sizes of its errors.
        campaign: the measurements.
        alone: whether noise of the output is the only error.

    Returns:
        The noise.
    """
    shown = estimate_noise(campaign)
    quieter = float(np.exp(0.5 * np.median(found.sizes.noise))) < _MUCH_LESS * shown.sigma
    # What a model explains is no noise, even where it differs from period to period.
    if shown.method in _SHOWN and not (alone and quieter):
        return shown
    owners = np.array([one.record for one in found.filter.measured.segments])
    lengths = np.array([one.stop - one.counted for one in found.filter.measured.segments], dtype=float)
    squares = np.exp(found.sizes.noise) * lengths if alone else found.free_squares
    own = np.array(
        [
            math.sqrt(squares[owners == place].sum() / lengths[owners == place].sum())
            for place in sorted(set(owners))
        ]
    )
    note = (
        "" if alone else "the error is not noise of the output: errors are compared with those of free runs"
    )
    return _with_levels(shown, campaign, own, note)


def _with_levels(
    shown: NoiseEstimate, campaign: Campaign, own: Float[np.ndarray, " record"], note: str
) -> NoiseEstimate:
    """Give a noise that has these levels in the records to fit, and their rms in the others."""
    lengths = [record.output.size - record.settle for record in campaign.fit_records]
    pooled = float(np.sqrt(np.average(np.square(own), weights=lengths)))
    fitted = iter(own.tolist())
    levels = tuple(next(fitted) if record.role == "fit" else pooled for record in campaign.records)
    return dataclasses.replace(
        shown,
        sigma=pooled,
        method="residual",
        per_record=levels,
        methods=("residual",) * len(levels),
        note=note,
        levels=levels,
        share=1.0,
        colour=None,
    )
