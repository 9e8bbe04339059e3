"""Errors of predictions over given times, beside those of a free run."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from ..._show import Row, number, shown
from ...records import check_window, windows_of
from ..innovations import ErrorFit, RecordFilter, Way, squares_ahead
from ._as_fit import Fitted, as_fit
from ._build_problem import build_problem
from ._errors import run_freely
from ._fit_result import Fit

_MOST_WINDOWS = 64
"""Predictions of one record and horizon, evenly spread over it."""

_SHARES = (0.01, 0.03, 0.1, 0.3)
"""Usual times of predictions, over that of the shortest stretch that a filter follows."""

_FED = 0.03
"""Time over which a filter follows a record between two predictions, at least, over the same; else as long as
these run."""


@shown
class PredictionErrors(NamedTuple):
    """rms errors of predictions, by how long they run.

    Attributes:
        horizons: times over which the model runs with nothing fed back [s].
        fit: rms error over the fitted records [SI unit of the output]; NaN where none is that long.
        holdout: the same over the held-out records.
    """

    horizons: tuple[float, ...]
    fit: Float[np.ndarray, " horizon"]
    holdout: Float[np.ndarray, " horizon"]

    def _headline(self) -> str:
        return f"rms errors of predictions over {', '.join(f'{one:g} s' for one in self.horizons)}"

    def _rows(self) -> list[Row]:
        return [
            Row(f"{horizon:g} s", f"{number(own)} fitted", f"{number(held)} held out")
            for horizon, own, held in zip(self.horizons, self.fit, self.holdout, strict=True)
        ]


def prediction_errors(fit: Fit | Fitted, horizons: Sequence[float] | None = None) -> PredictionErrors:
    """Give the rms errors of a fitted model that runs for given times with nothing fed back.

    Each prediction starts from what was measured before it: from the state to which a filter brings the model
    where the fit has one, else from the best state of the time before.

    Args:
        fit: the fit.
        horizons: times [s]. If omitted 1, 3, 10 and 30 % of the shortest record, or half of a single one;
            of a fit without a filter the time of its dwells or windows.

    Returns:
        The errors, fitted and held-out records apart.

    Raises:
        ValueError: if a horizon is shorter than two samples.

    Example:
        With the fit of `fit`'s example, beside the amplitude of the motion:

        >>> errors = ij.identification.prediction_errors(fitted, (0.1, 1.0))
        >>> bool(errors.holdout[0] < errors.holdout[1])
        True
    """
    fit = as_fit(fit)
    if horizons is not None:
        for horizon in horizons:
            check_window(horizon, fit.campaign.records[0].rate)
    if fit.innovations is not None:
        return _filtered(fit, fit.innovations, horizons)
    if horizons is None:
        return _restarted(fit)
    own, held = (np.array([_error(fit, role, one) for one in horizons]) for role in ("fit", "holdout"))
    return PredictionErrors(tuple(map(float, horizons)), own, held)


def _filtered(fit: Fit, found: ErrorFit, horizons: Sequence[float] | None) -> PredictionErrors:
    """Give the errors of predictions that start where the filter has brought the model."""
    measured, segments = found.filter.measured, found.filter.measured.segments
    unseen, count, rate = None, 0, measured.records[0].rate
    if fit.campaign.holdout_records:
        unseen, count = measured.others(fit.campaign.holdout_records)
        segments += unseen.segments
    shortest = min(one.stop - one.counted for one in segments)
    if horizons is None:
        usual = [float(f"{share * shortest / rate:.1g}") for share in _SHARES]
        horizons = [one for one in usual if one * rate >= 2.0]
    steps = [round(one * rate) for one in horizons]

    def fed(own: int) -> int:
        return max(round(_FED * shortest), min(own, shortest - own))

    def errors(record_filter: RecordFilter, way: Way, count: int) -> Float[np.ndarray, " horizon"]:
        found_at = [
            squares_ahead(record_filter, found.places, found.values, way, own, fed(own)) for own in steps
        ]
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.array(
                [float(np.sqrt(squares[:count].sum() / one[:count].sum())) for squares, one in found_at]
            )

    own = errors(found.filter, found.way, found.filter.count)
    held = np.full(len(steps), np.nan) if unseen is None else errors(*found.followed(unseen), count)
    return PredictionErrors(tuple(map(float, horizons)), own, held)


def _restarted(fit: Fit) -> PredictionErrors:
    """Give the errors of segments that are restarted from their own best state."""
    segments = fit.estimate.problem.segments
    time = float(np.median([one.stop - one.counted for one in segments])) / fit.campaign.records[0].rate
    own, held = (
        np.array([np.nan if one is None else one.nrmse_segments * one.rmse / one.nrmse])
        for one in (fit.errors["fit"], fit.errors["holdout"])
    )
    return PredictionErrors((float(f"{time:.2g}"),), own, held)


def _error(fit: Fit, role: str, horizon: float) -> float:
    """Give the rms error over the windows of one role's records."""
    cut = [
        (window, noise)
        for record, noise in zip(fit.campaign.records, fit.noise.whites, strict=True)
        if record.role == role
        for window in windows_of(record, horizon, _MOST_WINDOWS)
    ]
    if not cut:
        return float("nan")
    windows, noise = zip(*cut, strict=True)
    fitted = fit.estimate.problem
    problem = build_problem(
        windows,
        fit.model,
        quantity=fitted.quantity,
        hold=fitted.hold,
        noise=noise,
        integrator=fitted.integrator,
    )
    runs = run_freely(problem, fit.model)
    return float(np.sqrt(np.mean([np.mean(run.residual[run.counted > 0.0] ** 2) for run in runs])))
