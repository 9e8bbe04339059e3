"""The force residual: what is missing in the balance of measured forces, sample by sample."""

import dataclasses
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.signal import butter, lfilter, sosfiltfilt

from ..._parameters import list_parameters
from ..._quick_jit import quick_jit
from ...elements import Channels
from ...excitations import Hold
from ...models import Instant, Isolator, State
from ...records import Campaign, ExcitedBand, Record, measured_state
from ...records.spectrum import shift_order
from ..fitting import Fit, Run
from ..guess import Motion, internal_states_along, is_absolute, measured_motion
from ..jacobian import channel_table, drive_table, scaled_model

_STEEP = 6
"""Order of the filter below the band."""

_HIGHEST_ORDER = 8.0
"""Multiples of the drive's frequency that the force residual of a dwell keeps."""

_HIGHEST_SHARE = 0.39
"""Highest frequency of a force residual, over the sampling rate: a filter still fits in above."""

_NOISE_DRAWS = 4
"""Draws of the noise."""

_TURNS = 3
"""Corrections by which the readings of instruments are undone."""


class ForceResidual(NamedTuple):
    """The force that a fitted model would need beside its own to balance one record.

    Attributes:
        record: the record.
        displacement: measured or integrated, of the model's coordinate [m].
        velocity: [m/s].
        force: missing on the left-hand side of the balance, inside the band [N].
        noise: what the noise of the output alone contributes to it, drawn a few times [N].
        highest: upper end of the band [Hz].
        trusted: samples whose integrals are reliable.
    """

    record: Record
    displacement: Float[np.ndarray, " time"]
    velocity: Float[np.ndarray, " time"]
    force: Float[np.ndarray, " time"]
    noise: Float[np.ndarray, "draw time"]
    highest: float
    trusted: slice


@quick_jit
def _missing_force(
    model: Isolator, motion: State, a: Array, u: Array, du: Array, channels: Channels
) -> Array:
    """Give the force missing in the balance."""
    inertia = model.mass
    for element in model.elements:
        inertia = inertia + element.inertia()
    return inertia * (model.acceleration(motion, Instant(u, du, channels)) - a)


def _undo_instruments(model: Isolator, record: Record, channels: Channels) -> Record:
    """Give the record without the effect of the model's instruments, their internal states at rest."""
    measured = jnp.asarray(record.output)

    def reading(y: Array) -> Array:
        for element in model.elements:
            y = element.reading(y, (0.0 * y,) * element.internal_states)
        for element in model.elements:
            if element.channels:
                y = y + element.channel_reading(channels)
        return y

    motion = measured
    for _ in range(_TURNS):
        motion = motion + measured - reading(motion)
    return (
        record
        if np.array_equal(motion, record.output)
        else dataclasses.replace(record, output=np.asarray(motion))
    )


def force_residuals(fit: Fit) -> tuple[ForceResidual, ...]:
    """Give the force that a fitted model would need beside its own, for every record of its campaign.

    `g = F - m a - f(x, v, s)` along the measured motion; the measured quantity is integrated or
    differentiated to the others. An integrated displacement has no mean, so the mean of a force that is not
    odd is wrong.

    Args:
        fit: the fit; it gives the deviation of the linear stiffness of each record and segment, too.

    Returns:
        One per record, held-out ones included.

    Source: Masri & Caughey 1979; Hooker 2009 (forcing functions as diagnostics).
    """
    restarts = fit.restarts
    # One band for all records, so that they show the same harmonics of a law.
    common = max(measured_motion(fit.campaign, record).band.highest for record in fit.campaign.records)
    return tuple(
        _force_residual(fit, run, 1.0 + deviation, place, common)
        for place, (run, deviation) in enumerate(zip(restarts.runs, restarts.deviations, strict=True))
    )


def _force_residual(
    fit: Fit, run: Run, scale: Float[np.ndarray, " time"], place: int, common: float
) -> ForceResidual:
    model, campaign, record = fit.model, fit.campaign, run.record
    hold: Hold = campaign.input.hold
    shift, skew = float(model.shift()), float(model.skew())
    table, slopes = drive_table(record, record.input, hold, 1, shift, skew)
    u, du = jnp.asarray(table[:, 0]), jnp.asarray(slopes[:, 0])
    channels = {
        name: jnp.asarray(channel_table(name, record, hold, 1, shift, skew)[:, 0]) for name in model.channels
    }
    seen = _undo_instruments(model, record, channels)
    motion = measured_motion(campaign, seen)
    motion = dataclasses.replace(motion, band=ExcitedBand(motion.band.lowest, common))
    if campaign.output.quantity != "acceleration":
        x, v, a = _motion_in_band(campaign, seen, motion.band)
        motion = dataclasses.replace(motion, displacement=x, velocity=v, acceleration=a)
    x, v, a = (jnp.asarray(s) for s in (motion.displacement, motion.velocity, motion.acceleration))
    internal = ()
    if model.internal_states:
        step = jnp.full_like(x, 1.0 / record.rate)
        internal = internal_states_along(model, x, v, jnp.asarray(seen.output), u, step)
    values = tuple(entry.value for entry in list_parameters(model))
    scaled = scaled_model(model, values, jnp.asarray(scale))

    def missing(x: Array, v: Array, a: Array) -> Array:
        return _missing_force(scaled, (x, v, *internal), a, u, du, channels)

    # An integrated displacement holds nothing below the band but noise, which a spring turns into a force.
    lowest = None if campaign.output.quantity == "displacement" else motion.band.lowest
    # A differentiated signal ends with the band, and a balance needs all of its terms.
    integrated = campaign.output.quantity == "acceleration"
    highest = _highest(record, motion) if integrated else motion.band.highest
    force = missing(x, v, a)

    # The share of the noise: the same computation with noise of the same density added to the motion.
    noise = []
    for draw in range(_NOISE_DRAWS):
        stray = _noise_motion(fit, record, motion, place, draw)
        shaken = missing(x + stray[0], v + stray[1], a + stray[2]) - force
        noise.append(_filter_to_band(np.asarray(shaken), record.rate, lowest, highest))
    return ForceResidual(
        record,
        motion.displacement,
        motion.velocity,
        _filter_to_band(np.asarray(force), record.rate, lowest, highest),
        np.stack(noise),
        highest,
        motion.trusted,
    )


def _motion_in_band(
    campaign: Campaign, record: Record, band: ExcitedBand
) -> tuple[Float[np.ndarray, " time"], ...]:
    """Give displacement, velocity and acceleration of a record, integrated or differentiated in a band."""
    if is_absolute(campaign):
        record = dataclasses.replace(record, output=record.output - record.input)
    return measured_state(record, campaign.output.quantity, band.lowest, band.highest)


def _highest(record: Record, motion: Motion) -> float:
    """Give the frequency up to which the force residual is kept."""
    orders = _HIGHEST_ORDER * max((dwell.frequency for dwell in record.dwells), default=0.0)
    return float(min(max(motion.band.highest, orders), _HIGHEST_SHARE * record.rate))


def _filter_to_band(
    signal: Float[np.ndarray, " time"], rate: float, lowest: float | None, highest: float
) -> Float[np.ndarray, " time"]:
    """Filter a signal to a band with zero phase; without a lower end the mean stays."""
    mean = float(np.mean(signal))
    low = mean + shift_order(signal - mean, rate, 0, None, highest)
    if lowest is None:
        return low
    return sosfiltfilt(butter(_STEEP, lowest, "highpass", fs=rate, output="sos"), low)


def _noise_motion(fit: Fit, record: Record, motion: Motion, place: int, draw: int) -> tuple[Array, ...]:
    """Give displacement, velocity and acceleration of simulated noise of the output alone.

    Its density is that by which the fit weighs the samples.
    """
    white = np.random.default_rng((place, draw)).standard_normal(record.output.size)
    values = np.asarray(lfilter([1.0], [1.0, *fit.noise.whitening], fit.noise.whites[place] * white))
    alone = dataclasses.replace(record, output=values)
    band = motion.band
    stray = measured_state(alone, fit.campaign.output.quantity, band.lowest, band.highest)
    return tuple(jnp.asarray(values) for values in stray)
