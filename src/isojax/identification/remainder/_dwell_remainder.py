"""Force residual of each dwell: its harmonics, referred to the phase of the displacement."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float

from ..._show import number, shown
from ...records import Dwell
from ...records.spectrum import fit_harmonics, settled_window
from ..fitting import Fit
from ._force_residual import ForceResidual

HARMONICS = 7

FEWEST_SETTLED_CYCLES = 4.0
"""Cycles of a dwell over which its harmonics are read, if it has so many."""

SAMPLES_A_NUMBER = 4
"""Samples for each number of a fit of harmonics."""

_PHASES = 128


@shown
class DwellRemainder(NamedTuple):
    """Force residual of one dwell.

    Phases are relative to the displacement, `x = X cos(phase)`.

    Attributes:
        record: name of its record.
        role: "fit" or "holdout".
        level: excitation level, or None.
        frequency: [Hz].
        amplitude: X, of the displacement [m].
        chi2_per_dof: squared residual, segments restarted, over the noise squared.
        harmonics: of the force residual, orders 0 to 7; real parts are in phase with x, negative imaginary
            ones with v [N].
        error: standard error of either component of each harmonic by the noise of the output; infinite
            beyond the band of the force residual [N].
        displacement: over one cycle, in equal steps of phase [m].
        velocity: [m/s].
    """

    record: str
    role: str
    level: float | None
    frequency: float
    amplitude: float
    chi2_per_dof: float
    harmonics: Complex[np.ndarray, " harmonic"]
    error: Float[np.ndarray, " harmonic"]
    displacement: Float[np.ndarray, " phase"]
    velocity: Float[np.ndarray, " phase"]

    @property
    def force(self) -> Float[np.ndarray, " phase"]:
        """Force residual over one cycle, as `displacement` [N]."""
        return _waveform(self.harmonics)

    def _headline(self) -> str:
        return f"{self.record} at {number(self.frequency)} Hz, χ²/dof {self.chi2_per_dof:.4g}"


def _waveform(harmonics: Complex[np.ndarray, " harmonic"]) -> Float[np.ndarray, " phase"]:
    phase = np.outer(2.0 * np.pi * np.arange(_PHASES) / _PHASES, np.arange(harmonics.size))
    return np.cos(phase) @ np.real(harmonics) - np.sin(phase) @ np.imag(harmonics)


def dwell_remainders(fit: Fit, residuals: tuple[ForceResidual, ...]) -> tuple[DwellRemainder, ...]:
    """Give the force residual of every dwell of a campaign.

    Args:
        fit: the fit.
        residuals: its force residuals.

    Returns:
        One per dwell whose integrals are reliable; none without dwells.
    """
    dwells = []
    for one, run, noise in zip(residuals, fit.restarts.runs, fit.noise.levels, strict=True):
        for dwell in one.record.dwells:
            window = _window(one, dwell)
            orders = min(HARMONICS, int(one.highest / dwell.frequency))
            if window.stop - window.start <= SAMPLES_A_NUMBER * (2 * orders + 1) or orders < 1:
                continue
            own = slice(dwell.start, dwell.stop)
            counted = max(1.0, float(np.sum(run.counted[own] > 0.0)))
            chi2 = float(np.sum(run.residual[own] ** 2)) / noise**2 / counted
            dwells.append(_dwell_remainder(one, dwell.frequency, window, orders, chi2))
    if not dwells:
        return ()
    # A few draws of the noise give a rough error of one dwell, but a good one of all dwells together.
    errors = np.array([one.error for one in dwells])
    finite = np.isfinite(errors)
    pooled = np.sqrt(np.sum(np.where(finite, errors, 0.0) ** 2, axis=0) / np.maximum(finite.sum(axis=0), 1))
    return tuple(one._replace(error=np.where(np.isfinite(one.error), pooled, np.inf)) for one in dwells)


def _window(one: ForceResidual, dwell: Dwell) -> slice:
    """Give the settled half of a dwell, moved to where the integrals are reliable."""
    start, stop = settled_window(
        dwell, one.record.rate, max(FEWEST_SETTLED_CYCLES, np.floor(0.5 * dwell.cycles))
    )
    late = max(0, stop - one.trusted.stop)
    return slice(max(start - late, dwell.start, one.trusted.start), stop - late)


def _dwell_remainder(
    one: ForceResidual, frequency: float, window: slice, orders: int, chi2: float
) -> DwellRemainder:
    time = np.arange(window.stop - window.start) / one.record.rate

    def harmonics(signal: Float[np.ndarray, " time"]) -> Complex[np.ndarray, " harmonic"]:
        fitted = fit_harmonics(signal[window], time, frequency, orders)[0]
        return np.concatenate([fitted, np.zeros(HARMONICS - orders)])

    x = harmonics(one.displacement)
    turned = (np.conj(x[1]) / abs(x[1])) ** np.arange(HARMONICS + 1)
    error = np.sqrt(0.5 * np.mean([np.abs(harmonics(draw)) ** 2 for draw in one.noise], axis=0))
    error[orders + 1 :] = np.inf
    return DwellRemainder(
        one.record.name,
        one.record.role,
        one.record.level,
        frequency,
        float(abs(x[1])),
        chi2,
        harmonics(one.force) * turned,
        error,
        _waveform(x * turned),
        _waveform(harmonics(one.velocity) * turned),
    )
