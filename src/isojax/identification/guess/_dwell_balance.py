"""The harmonic balance of every dwell at once, as a linear regression."""

import numpy as np
from jaxtyping import Complex, Float

from ...models import Isolator
from ...records import ExcitedBand
from ._force_balance import ForceBalance
from ._measured_receptance import MeasuredResponse
from ._motion import Motion

_PHASES = 128
"""Samples of a cycle over which the force of a law is evaluated."""


def _over_a_cycle(amplitudes: Complex[np.ndarray, "dwell harmonic"]) -> Float[np.ndarray, " time"]:
    """Give the real signals of all dwells over one cycle each, one after the other."""
    harmonic = np.arange(1, amplitudes.shape[1] + 1)
    phase = 2 * np.pi * np.arange(_PHASES) / _PHASES
    return np.ravel(np.real(amplitudes @ np.exp(1j * np.outer(harmonic, phase))))


def dwell_motion(model: Isolator, responses: tuple[MeasuredResponse, ...]) -> Motion:
    """Give the measured motion of all dwells over one cycle each.

    Args:
        model: says how the drive enters, and the mass under base excitation.
        responses: measured harmonics of the records.

    Returns:
        Motion and drive, 128 samples a cycle, dwell after dwell.
    """
    frequency = np.concatenate([response.frequency for response in responses])
    displacement = np.concatenate([response.displacement for response in responses])
    drive = np.concatenate([response.force for response in responses])
    if model.excitation == "base_acceleration":
        drive = -drive / float(model.mass)
    angular = 2j * np.pi * frequency[:, None] * np.arange(1, displacement.shape[1] + 1)
    return Motion(
        _over_a_cycle(displacement),
        _over_a_cycle(angular * displacement),
        _over_a_cycle(angular**2 * displacement),
        _over_a_cycle(drive),
        ExcitedBand(float(np.min(frequency)), float(np.max(frequency)) * displacement.shape[1]),
        np.repeat(1.0 / (_PHASES * frequency), _PHASES),
        cycle=_PHASES,
    )


def dwell_balance(
    model: Isolator, responses: tuple[MeasuredResponse, ...], harmonics: int = 1, mass_free: bool = False
) -> ForceBalance:
    """Give the harmonic balance of every dwell, on and off resonance.

    At each dwell `(K_eq(X) - m omega^2) X = F cos(phi)` and `C_eq(X omega) omega X = F sin(phi)`; both are
    linear in the coefficients. The force of each law is evaluated over the measured motion with its
    harmonics, not over a pure sine.

    Args:
        model: the structure; its present strengths do not matter.
        responses: measured harmonics of the records.
        harmonics: how many harmonics must balance.
        mass_free: whether the mass is unknown too.

    Returns:
        The balance.

    Source: the paper, eqs. (5)-(8), used at every dwell instead of at resonance alone.
    """

    def project(signal: Float[np.ndarray, " time"]) -> Float[np.ndarray, " row"]:
        lines = np.fft.rfft(signal.reshape(-1, _PHASES), axis=1)[:, 1 : harmonics + 1]
        return np.concatenate([lines.real.ravel(), lines.imag.ravel()]) * (2.0 / _PHASES)

    return ForceBalance(model, (dwell_motion(model, responses),), (project,), mass_free)
