"""Errors of predictions over given times, beside those of a free run."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from ..._show import Row, number, shown
from ...records import windows_of
from ._as_fit import Fitted, as_fit
from ._build_problem import build_problem
from ._errors import run_freely
from ._fit_result import Fit

_MOST_WINDOWS = 64
"""Predictions of one record and horizon, evenly spread over it."""


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


def prediction_errors(fit: Fit | Fitted, horizons: Sequence[float] = (0.1, 1.0, 10.0)) -> PredictionErrors:
    """Give the rms errors of a fitted model that runs for given times with nothing fed back.

    Args:
        fit: the fit.
        horizons: times [s]. Each record is cut into windows of this length, see
            `isojax.records.cut_into_windows`.

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
    errors = {
        role: np.array([_error(fit, role, horizon) for horizon in horizons]) for role in ("fit", "holdout")
    }
    return PredictionErrors(tuple(map(float, horizons)), errors["fit"], errors["holdout"])


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
