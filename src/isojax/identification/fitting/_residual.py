"""The residual of a fit, its floor, and whether it is white."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy import signal, stats

from ..._show import Row, number, shown
from ._as_fit import Fitted, as_fit
from ._fit_result import Fit

MOST_LAGS = 25


@shown
class Residual(NamedTuple):
    """What a fitted model leaves of its records.

    Attributes:
        values: measured less simulated of each fitting record, segments restarted [SI unit of the output].
        noise_floor: rms of the noise of each record [SI unit of the output].
        whiteness: share of lags within +-25 (0 left out) whose autocorrelation stays in the 99 % band, a
            record each.
        lags: the lags [samples].
        autocorrelation: of each record's residual at the lags; where the noise is coloured, of the residual
            that the law of the noise leaves.
        cross_correlation: of the same with the drive at the lags.
        band: half width of the 99 % band of each record.
    """

    values: tuple[Float[np.ndarray, " time"], ...]
    noise_floor: Float[np.ndarray, " record"]
    whiteness: Float[np.ndarray, " record"]
    lags: Float[np.ndarray, " lag"]
    autocorrelation: Float[np.ndarray, "record lag"]
    cross_correlation: Float[np.ndarray, "record lag"]
    band: Float[np.ndarray, " record"]

    def _headline(self) -> str:
        inside = 100.0 * float(np.mean(self.whiteness))
        return f"{len(self.values)} records, {inside:.3g} % of the lags within the band of white noise (99 %)"

    def _rows(self) -> list[str | Row]:
        return [
            "noise_floor",
            *(
                Row(
                    f"values[{place}]",
                    f"{number(float(np.sqrt(np.mean(one**2))))} rms, {100.0 * white:.3g} % inside",
                )
                for place, (one, white) in enumerate(zip(self.values, self.whiteness, strict=True))
            ),
        ]


def _correlate(
    first: Float[np.ndarray, " time"], second: Float[np.ndarray, " time"]
) -> Float[np.ndarray, " lag"]:
    """Give the normalised correlation at lags -25 to 25."""
    a, b = first - first.mean(), second - second.mean()
    full = signal.correlate(a, b, mode="full", method="fft")
    middle = b.size - 1
    size = np.sqrt(np.sum(a**2) * np.sum(b**2))
    window = full[middle - MOST_LAGS : middle + MOST_LAGS + 1]
    return window / size if size > 0.0 else np.zeros_like(window)


def residual(fit: Fit | Fitted) -> Residual:
    """Give what a fit leaves of its records, every segment restarted from its own best state.

    Args:
        fit: the fit.

    Returns:
        The residual of each fitting record, with the correlations that distinguish it from white noise.

    Source: Ljung 1999, System Identification, sec. 16.6 (residual tests with a 99 % band).

    Example:
        With the fit of `fit`'s example; white noise would leave 0.99 of the lags inside its band:

        >>> print(f"{ij.residual(fitted).whiteness.mean():.1f} of the lags inside")
        0.0 of the lags inside
    """
    fit = as_fit(fit)
    runs = [run for run in fit.restarts.runs if run.record.role == "fit"]
    lags = np.arange(-MOST_LAGS, MOST_LAGS + 1, dtype=float)
    values, own, cross, band, white = [], [], [], [], []
    for run in runs:
        left = run.residual[run.counted > 0.0]
        left = np.asarray(signal.lfilter([1.0, *fit.noise.law], [1.0], left))
        drive = run.record.input[run.counted > 0.0]
        values.append(run.residual)
        own.append(_correlate(left, left))
        cross.append(_correlate(left, drive))
        band.append(float(stats.norm.ppf(0.995)) / np.sqrt(left.size))
        white.append(np.mean(np.abs(np.delete(own[-1], MOST_LAGS)) <= band[-1]))
    levels = zip(fit.noise.levels, fit.campaign.records, strict=True)
    floor = np.array([level for level, record in levels if record.role == "fit"])
    return Residual(
        tuple(values), floor, np.array(white), lags, np.array(own), np.array(cross), np.array(band)
    )
