"""What is left of each dwell: its harmonics, with the displacement and with the velocity."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float

from ...records import Dwell
from ...records.spectrum import fit_harmonics, settled_window
from ..fitting import Fit
from ._force_residual import ForceResidual

HARMONICS = 7

PARTS = ("mean", "with x", "with v", *(f"harmonic {order}" for order in range(2, HARMONICS + 1)), "the rest")
"""Parts of the latent force of a dwell, in the order of `DwellRemainder.power`."""

_PHASES = 128

_OF_NOISE = 3.0
"""Standard deviations by which the power of the latent force must exceed that of the noise."""


class DwellRemainder(NamedTuple):
    """What is left of one dwell.

    Phases count from those of the displacement, `x = X cos(phase)`.

    Attributes:
        record: name of its record.
        role: "fit" or "holdout".
        level: excitation level, or None.
        frequency: [Hz].
        amplitude: X, of the displacement [m].
        chi2_per_dof: squared residual, segments restarted, over the noise squared.
        harmonics: of the latent force, orders 0 to 7; real parts go with x, negative imaginary ones with v
            [N].
        error: standard error of either part of each harmonic by the noise of the output; infinite where the
            band of the latent force ends below [N].
        base_harmonics: the same of a unit of each fitted coefficient.
        power: mean square of each of `PARTS` [N^2].
        noise_power: what the noise of the output makes of that [N^2].
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
    base_harmonics: Complex[np.ndarray, "harmonic coefficient"]
    power: Float[np.ndarray, " part"]
    noise_power: Float[np.ndarray, " part"]
    displacement: Float[np.ndarray, " phase"]
    velocity: Float[np.ndarray, " phase"]

    @property
    def force(self) -> Float[np.ndarray, " phase"]:
        """Latent force over one cycle, as `displacement` [N]."""
        return _waveform(self.harmonics)

    @property
    def energy(self) -> float:
        """Energy that the latent force takes out in a cycle [J]."""
        return float(np.pi * self.amplitude * np.imag(self.harmonics[1]))


def _waveform(harmonics: Complex[np.ndarray, " harmonic"]) -> Float[np.ndarray, " phase"]:
    phase = np.outer(2.0 * np.pi * np.arange(_PHASES) / _PHASES, np.arange(harmonics.size))
    return np.cos(phase) @ np.real(harmonics) - np.sin(phase) @ np.imag(harmonics)


def split_dwells(fit: Fit, latent: tuple[ForceResidual, ...]) -> tuple[DwellRemainder, ...]:
    """Give what is left of every dwell of a campaign.

    Args:
        fit: the fit.
        latent: its latent forces.

    Returns:
        One a dwell whose integrals are to be trusted; none without dwells.
    """
    found = []
    for one, run in zip(latent, fit.restarts.runs, strict=True):
        for dwell in one.record.dwells:
            window = _window(one, dwell)
            orders = min(HARMONICS, int(one.highest / dwell.frequency))
            if window.stop - window.start <= 4 * (2 * orders + 1) or orders < 1:
                continue
            own = slice(dwell.start, dwell.stop)
            counted = max(1.0, float(np.sum(run.counted[own] > 0.0)))
            chi2 = float(np.sum(run.residual[own] ** 2)) / fit.noise.sigma**2 / counted
            found.append(_split(one, dwell.frequency, window, orders, chi2))
    if not found:
        return ()
    # A few draws of the noise say little of one dwell, but all together enough.
    errors = np.array([one.error for one in found])
    there = np.isfinite(errors)
    pooled = np.sqrt(np.sum(np.where(there, errors, 0.0) ** 2, axis=0) / np.maximum(there.sum(axis=0), 1))
    return tuple(one._replace(error=np.where(np.isfinite(one.error), pooled, np.inf)) for one in found)


def _window(one: ForceResidual, dwell: Dwell) -> slice:
    """Give the settled half of a dwell, moved to where the integrals are to be trusted."""
    start, stop = settled_window(dwell, one.record.rate, max(4.0, np.floor(0.5 * dwell.cycles)))
    late = max(0, stop - one.trusted.stop)
    return slice(max(start - late, dwell.start, one.trusted.start), stop - late)


def _split(one: ForceResidual, frequency: float, window: slice, orders: int, chi2: float) -> DwellRemainder:
    time = np.arange(window.stop - window.start) / one.record.rate

    def harmonics(signal: np.ndarray) -> tuple[np.ndarray, float]:
        found, rest = fit_harmonics(signal[window], time, frequency, orders)
        return np.concatenate([found, np.zeros(HARMONICS - orders)]), rest

    x, v = harmonics(one.displacement)[0], harmonics(one.velocity)[0]
    turned = (np.conj(x[1]) / abs(x[1])) ** np.arange(HARMONICS + 1)
    columns = [harmonics(column)[0] * turned for column in one.columns.T]
    force, rest = harmonics(one.force)
    strays = [harmonics(draw) for draw in one.noise]
    noise = np.mean([_power(found, left) for found, left in strays], axis=0)
    error = np.sqrt(0.5 * np.mean([np.abs(found) ** 2 for found, _ in strays], axis=0))
    error[orders + 1 :] = np.inf
    return DwellRemainder(
        one.record.name,
        one.record.role,
        one.record.level,
        frequency,
        float(abs(x[1])),
        chi2,
        force * turned,
        error,
        np.stack(columns, axis=1),
        _power(force * turned, rest),
        noise,
        _waveform(x * turned),
        _waveform(v * turned),
    )


def _power(harmonics: Complex[np.ndarray, " harmonic"], rest: float) -> Float[np.ndarray, " part"]:
    """Give the mean square of each of `PARTS`."""
    first = 0.5 * harmonics[1].real ** 2, 0.5 * harmonics[1].imag ** 2
    return np.array([abs(harmonics[0]) ** 2, *first, *(0.5 * np.abs(harmonics[2:]) ** 2), rest**2])


def share_parts(dwells: tuple[DwellRemainder, ...]) -> dict[str, float]:
    """Give the share of each of `PARTS` in the power of the latent force beyond the noise, over all dwells.

    Args:
        dwells: what is left of them.

    Returns:
        Shares that sum to one; none where nothing stands out of the noise.
    """
    if not dwells:
        return {}
    excess = np.array([one.power - one.noise_power for one in dwells])
    total = excess.sum(axis=0)
    # The scatter of a part over the dwells tells what its sum may be by chance.
    error = np.sqrt(len(dwells)) * np.std([one.noise_power for one in dwells], axis=0) + 1e-300
    total = np.where(total > _OF_NOISE * error, total, 0.0)
    whole = float(total.sum())
    return dict(zip(PARTS, (total / whole).tolist(), strict=True)) if whole > 0.0 else {}
