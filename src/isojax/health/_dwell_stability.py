"""Each measured dwell on its branch: how near its motion is to a fold and how fast disturbances die out."""

import math
from typing import NamedTuple

import jax
import numpy as np
from jaxtyping import Complex, Float

from .._results import RESULTS, is_successful
from .._show import shown
from ..models import Isolator
from ..records import Campaign, Dwell, OutputChannel, Record, dwell_harmonics
from ..stability import find_nearest_folds

REACH = (0.3, 0.1)
"""Share of the force, and of the frequency, up to which folds are sought."""

_ANOTHER = 0.3
"""Difference between measured motion and orbit, over its size, from which on they are not the same motion."""

_DERIVATIVES_OF_DISPLACEMENT = {"displacement": 0, "velocity": 1, "acceleration": 2}


@shown
class DwellStability(NamedTuple):
    """One measured dwell, compared with the periodic orbit that the fitted model has there.

    Attributes:
        record: name of its record.
        level: nominal level of the record, or None.
        dwell: the dwell.
        amplitude: measured amplitude of the drive [N, or m/s^2 for base excitation].
        spectral_radius: largest modulus of the orbit's multipliers; a disturbance shrinks by it each period.
        fold_amplitude: change of the drive's amplitude that leads to the nearest fold of the orbit's branch
            [N, or m/s^2]; infinite where there is none within reach.
        fold_frequency: change of the drive's frequency that does so [Hz].
        reason: why the numbers are NaN, or "".
    """

    record: str
    level: float | None
    dwell: Dwell
    amplitude: float
    spectral_radius: float
    fold_amplitude: float
    fold_frequency: float
    reason: str = ""

    @property
    def nearness(self) -> float:
        """Smallest change to a fold as a share of the drive's amplitude; infinite where there is none."""
        return abs(self.fold_amplitude) / self.amplitude


class _Measured(NamedTuple):
    """The settled motion of a dwell at the instant at which its drive passes zero upwards."""

    record: Record
    dwell: Dwell
    amplitude: float
    displacement: float
    velocity: float
    size: float


def dwell_stability(model: Isolator, campaign: Campaign) -> tuple[DwellStability, ...]:
    """Compare every dwell of every record with a fitted model's periodic orbit next to its measured motion.

    All dwells are worked out side by side, starting from the measured displacement and velocity; internal
    states start from zero and settle over some periods. Where the model has no such motion, or another one,
    it is said so.

    Args:
        model: the fitted isolator.
        campaign: the measurements.

    Returns:
        The dwells in the order of the records, fitted and held out; none where no record dwells.
    """
    pairs = [(record, dwell) for record in campaign.records for dwell in record.dwells]
    measured = [_measured(campaign, record, dwell) for record, dwell in pairs]
    alike: dict[tuple[tuple[str, float], ...], list[_Measured]] = {}
    for one in measured:
        if isinstance(one, _Measured):
            alike.setdefault(_conditions(model, one.record), []).append(one)
    found = {
        stated: iter(_held_against_orbits(model.at(**dict(stated)), known)) for stated, known in alike.items()
    }
    return tuple(
        next(found[_conditions(model, record)])
        if isinstance(one, _Measured)
        else _unknown(record, dwell, math.nan, one)
        for (record, dwell), one in zip(pairs, measured, strict=True)
    )


def _conditions(model: Isolator, record: Record) -> tuple[tuple[str, float], ...]:
    """Give the operating conditions of a record that the model follows."""
    return tuple((name, value) for name, value in record.conditions if name in model.conditions)


def _measured(campaign: Campaign, record: Record, dwell: Dwell) -> _Measured | str:
    """Give the motion of a dwell by its harmonics, or why there is none."""
    try:
        harmonics = dwell_harmonics(record, dwell)
    except ValueError:
        return "the dwell has too few samples"
    amplitude = abs(harmonics.input[1])
    if not amplitude > 0.0:
        return "the dwell is not driven"
    motion = _coordinate(
        campaign.output,
        campaign.input.quantity == "base_acceleration",
        harmonics.output,
        harmonics.input,
        dwell.frequency,
    )
    # Re c exp(i theta) is amplitude sin(theta + arg c + pi/2).
    phase = -(np.angle(harmonics.input[1]) + 0.5 * np.pi)
    orders = np.arange(motion.size)
    turned = motion * np.exp(1j * orders * phase)
    rates = 2j * np.pi * dwell.frequency * orders * turned
    return _Measured(
        record,
        dwell,
        float(amplitude),
        float(np.sum(turned.real)),
        float(np.sum(rates.real)),
        float(abs(motion[1])),
    )


def _coordinate(
    channel: OutputChannel,
    based: bool,
    output: Complex[np.ndarray, " harmonic"],
    drive: Complex[np.ndarray, " harmonic"],
    frequency: float,
) -> Complex[np.ndarray, " harmonic"]:
    """Give the harmonics of the model's coordinate: displacement, relative to a base that moves [m]."""
    # The coordinate is relative to the base, an accelerometer is not.
    signal = output - drive if based and channel.quantity == "acceleration" else output
    order = _DERIVATIVES_OF_DISPLACEMENT[channel.quantity]
    if order == 0:
        return signal
    motion = np.zeros_like(signal)
    motion[1:] = signal[1:] / (2j * np.pi * frequency * np.arange(1, signal.size)) ** order
    return motion


def _held_against_orbits(model: Isolator, measured: list[_Measured]) -> list[DwellStability]:
    """Find the orbits next to measured motions, and their folds."""
    amplitude = np.array([one.amplitude for one in measured])
    frequency = np.array([one.dwell.frequency for one in measured])
    starts = np.zeros((len(measured), 2 + model.internal_states))
    starts[:, 0] = [one.displacement for one in measured]
    starts[:, 1] = [one.velocity for one in measured]
    found = find_nearest_folds(model, amplitude, frequency, starts, reach=REACH)
    size = np.array([[one.size, 2.0 * np.pi * one.dwell.frequency * one.size] for one in measured])
    apart = np.max(np.abs(np.asarray(found.y0)[:, :2] - starts[:, :2]) / size, axis=1)
    radius = np.asarray(found.spectral_radius)
    changes = [
        _change_to_fold(np.asarray(folds), own)
        for folds, own in ((found.fold_amplitude, amplitude), (found.fold_frequency, frequency))
    ]
    held = []
    for place, one in enumerate(measured):
        result = jax.tree.map(lambda values, at=place: values[at], found.result)
        if not is_successful(result):
            reason = f"no orbit next to the measured motion: {RESULTS[result]}"
        elif not apart[place] < _ANOTHER:
            reason = f"the model's motion next to the measured one is {100.0 * apart[place]:.0f} % off"
        else:
            numbers = (float(radius[place]), float(changes[0][place]), float(changes[1][place]))
            held.append(DwellStability(one.record.name, one.record.level, one.dwell, one.amplitude, *numbers))
            continue
        held.append(_unknown(one.record, one.dwell, one.amplitude, reason))
    return held


def _change_to_fold(
    folds: Float[np.ndarray, "dwell side"], own: Float[np.ndarray, " dwell"]
) -> Float[np.ndarray, " dwell"]:
    """Give the change to the nearer of two folds; infinite where there is neither."""
    changes = folds - own[:, None]
    sizes = np.where(np.isnan(changes), np.inf, np.abs(changes))
    nearer = np.take_along_axis(changes, np.argmin(sizes, axis=1)[:, None], axis=1)[:, 0]
    # Where one side was lost and the other has no fold, nothing is known.
    lost = np.isnan(changes).any(axis=1) & ~np.isfinite(nearer)
    return np.where(lost, np.nan, np.where(np.isinf(nearer), np.inf, nearer))


def _unknown(record: Record, dwell: Dwell, amplitude: float, reason: str) -> DwellStability:
    return DwellStability(record.name, record.level, dwell, amplitude, math.nan, math.nan, math.nan, reason)
