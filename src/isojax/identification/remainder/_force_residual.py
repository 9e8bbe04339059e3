"""The latent force: what is missing in the balance of measured forces, sample by sample."""

import dataclasses
from typing import NamedTuple

import diffrax
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.signal import butter, sosfiltfilt

from ..._parameters import list_parameters
from ...elements import Channels
from ...excitations import Hold, tabulate
from ...models import RK4, Isolator, State, share_internal
from ...records import Band, Campaign, Record, measured_state
from ...records.spectrum import shift_order
from ..fitting import Fit, Run
from ..guess import Motion, is_absolute, measured_motion
from ..jacobian import channel_table, follow_motion, scaled_model

_STEPS_A_SAMPLE = 2
"""Integration steps a sample where memories follow the measured motion."""

_STEEP = 6
"""Order of the filter below the band."""

_HIGHEST_ORDER = 8.0
"""Multiples of the drive's frequency that the latent force of a dwell keeps."""

_NOISE_DRAWS = 4
"""Times that the noise is drawn."""

_TURNS = 3
"""Corrections by which the readings of instruments are undone."""


class ForceResidual(NamedTuple):
    """The force that a fitted model would need beside its own to balance one record.

    Attributes:
        record: the record.
        displacement: measured or integrated, of the model's coordinate [m].
        velocity: [m/s].
        quiet: displacement [m] and velocity [m/s] of the fitted model's own motion, segments restarted, on
            which there is no noise of the output.
        force: missing on the left-hand side of the balance, without what lies outside the band [N].
        columns: its derivatives by the free coefficients [N over their units].
        quiet_columns: the same along `quiet`.
        noise: what the noise of the output makes by itself of that force, drawn a few times [N].
        lowest: frequency from which on it is kept [Hz]; None where the mean is.
        highest: frequency up to which it is kept [Hz].
        trusted: samples whose integrals are to be trusted.
    """

    record: Record
    displacement: Float[np.ndarray, " time"]
    velocity: Float[np.ndarray, " time"]
    quiet: Float[np.ndarray, "2 time"]
    force: Float[np.ndarray, " time"]
    columns: Float[np.ndarray, "time coefficient"]
    quiet_columns: Float[np.ndarray, "time coefficient"]
    noise: Float[np.ndarray, "draw time"]
    lowest: float | None
    highest: float
    trusted: slice


@eqx.filter_jit
def follow_memories(
    model: Isolator, x: Array, v: Array, y: Array, u: Array, sample_time: float
) -> tuple[Array, ...]:
    """Let the memories of a model's elements follow a given motion, from rest.

    Args:
        model: the isolator; its force balance takes no part.
        x: displacement [m].
        v: velocity [m/s].
        y: motion at the sensor [its SI unit].
        u: drive [N, or m/s^2 for base excitation].
        sample_time: [s].

    Returns:
        One history an internal state.
    """
    solver, based = RK4(), model.excitation == "base_acceleration"

    def field(t: float, internal: State, ends: tuple[tuple[Array, ...], tuple[Array, ...]]) -> State:
        far, fast, seen, drive = (one + t * (other - one) for one, other in zip(*ends, strict=True))
        rates: list[Array] = []
        for element, own in zip(
            model.elements, share_internal(model.elements, (far, fast, *internal)), strict=True
        ):
            rates.extend(follow_motion(element, far, fast, seen, drive if based else None, own))
        return tuple(sample_time * rate for rate in rates)

    term = diffrax.ODETerm(field)  # pyright: ignore[reportArgumentType]

    def body(internal: State, ends: tuple[tuple[Array, ...], tuple[Array, ...]]) -> tuple[State, State]:
        moved = internal
        for step in range(_STEPS_A_SAMPLE):
            moved, *_ = solver.step(
                term, step / _STEPS_A_SAMPLE, (step + 1) / _STEPS_A_SAMPLE, moved, ends, None, False
            )
        return moved, internal

    signals = (x, v, y, u)
    ahead = tuple(jnp.concatenate([values[1:], values[-1:]]) for values in signals)
    rest = (jnp.zeros(()),) * model.internal_states
    return jax.lax.scan(body, rest, (signals, ahead))[1]


@eqx.filter_jit
def _missing(
    model: Isolator,
    scale: Array,
    places: tuple[int, ...],
    motion: State,
    a: Array,
    u: Array,
    du: Array,
    channels: Channels,
) -> tuple[Array, Array]:
    """Give the missing force, and its derivatives by the free coefficients."""
    values = tuple(entry.value for entry in list_parameters(model))

    def force(chosen: tuple[Array, ...]) -> Array:
        numbers = list(values)
        for place, number in zip(places, chosen, strict=True):
            numbers[place] = number
        current = scaled_model(model, numbers, scale)
        inertia = current.mass
        for element in current.elements:
            inertia = inertia + element.inertia()
        late = current.shift() - jax.lax.stop_gradient(current.shift())
        return inertia * (current.acceleration(motion, u - late * du, du, channels=channels) - a)

    chosen = tuple(values[place] for place in places)
    columns = []
    for index in range(len(places)):
        seeds = tuple(jnp.ones(()) if place == index else jnp.zeros(()) for place in range(len(places)))
        columns.append(jax.jvp(force, (chosen,), (seeds,))[1])
    return force(chosen), jnp.stack(columns, axis=1)


def _undo_instruments(model: Isolator, record: Record, channels: Channels) -> Record:
    """Give the record as the sensor would have shown it without the model's instruments; memories at rest."""
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

    `g = F - m a - f(x, v, s)` along the measured motion; what was measured is integrated or differentiated
    to the rest. An integrated displacement lacks its mean, so that a force that is not odd shows with an
    error in its own mean.

    Args:
        fit: the fit; how far the linear stiffness of each record and segment deviates is taken over from it.

    Returns:
        One a record, held-out ones included.

    Source: Masri & Caughey 1979; Hooker 2009 (forcing functions as diagnostics).
    """
    restarts = fit.restarts
    # One band for all: what one record lacks of a law and another has would look like another law.
    common = max(measured_motion(fit.campaign, record).band.highest for record in fit.campaign.records)
    return tuple(
        _force_residual(fit, run, 1.0 + deviation, place, common)
        for place, (run, deviation) in enumerate(zip(restarts.runs, restarts.deviations, strict=True))
    )


def _force_residual(
    fit: Fit, run: Run, scale: Float[np.ndarray, " time"], seed: int, common: float
) -> ForceResidual:
    model, campaign, record = fit.model, fit.campaign, run.record
    hold: Hold = campaign.input.hold
    shift = float(model.shift())
    table, slopes = tabulate(record.input, record.rate, hold, 1, shift)
    u, du = jnp.asarray(table[:, 0]), jnp.asarray(slopes[:, 0])
    channels = {
        name: jnp.asarray(channel_table(name, record, hold, 1, shift)[:, 0]) for name in model.channels
    }
    seen = _undo_instruments(model, record, channels)
    motion = measured_motion(campaign, seen)
    motion = dataclasses.replace(motion, band=Band(motion.band.lowest, common))
    if campaign.output.quantity != "acceleration":
        x, v, a = _moved(campaign, seen, motion)
        motion = dataclasses.replace(motion, displacement=x, velocity=v, acceleration=a)
    x, v, a = (jnp.asarray(s) for s in (motion.displacement, motion.velocity, motion.acceleration))
    internal = ()
    if model.internal_states:
        internal = follow_memories(model, x, v, jnp.asarray(seen.output), u, 1.0 / record.rate)
    factor, places = jnp.asarray(scale), fit.estimate.places

    def missing(x: Array, v: Array, a: Array) -> tuple[Array, Array]:
        return _missing(model, factor, places, (x, v, *internal), a, u, du, channels)

    # An integrated displacement holds nothing below the band but noise, which a spring makes a force.
    lowest = None if campaign.output.quantity == "displacement" else motion.band.lowest
    # What was differentiated ends with the band, and a balance needs all of its parts.
    integrated = campaign.output.quantity == "acceleration"
    band = lowest, _highest(record, motion) if integrated else motion.band.highest
    force, columns = missing(x, v, a)
    quiet = _moved(campaign, _undo_instruments(model, _simulated(run), channels), motion)

    def kept(values: Array) -> np.ndarray:
        return np.stack([_inside(column, record.rate, *band) for column in np.asarray(values).T], axis=1)

    # What the noise of the output alone makes of it: the same road with noise of the same density on top.
    noise = []
    for draw in range(_NOISE_DRAWS):
        stray = _stray_motion(campaign, record, motion, fit.noise.white, (seed, draw))
        shaken = missing(x + stray[0], v + stray[1], a + stray[2])[0] - force
        noise.append(_inside(np.asarray(shaken), record.rate, *band))
    return ForceResidual(
        record,
        motion.displacement,
        motion.velocity,
        np.stack(quiet[:2]),
        _inside(np.asarray(force), record.rate, *band),
        kept(columns),
        kept(missing(*(jnp.asarray(values) for values in quiet))[1]),
        np.stack(noise),
        *band,
        motion.trusted,
    )


def _simulated(run: Run) -> Record:
    """Give a record as the fitted model would have made it, measured where it was not simulated."""
    known = np.isfinite(run.simulated)
    return dataclasses.replace(run.record, output=np.where(known, run.simulated, run.record.output))


def _moved(campaign: Campaign, record: Record, motion: Motion) -> tuple[Float[np.ndarray, " time"], ...]:
    """Give displacement, velocity and acceleration of a record, integrated in the band of another."""
    if is_absolute(campaign):
        record = dataclasses.replace(record, output=record.output - record.input)
    return measured_state(record, campaign.output.quantity, motion.band.lowest, motion.band.highest)


def _highest(record: Record, motion: Motion) -> float:
    """Give the frequency up to which the latent force is kept."""
    orders = _HIGHEST_ORDER * max((dwell.frequency for dwell in record.dwells), default=0.0)
    return float(min(max(motion.band.highest, orders), 0.39 * record.rate))


def _inside(
    signal: Float[np.ndarray, " time"], rate: float, lowest: float | None, highest: float
) -> Float[np.ndarray, " time"]:
    """Take off what lies outside a band, without a phase; the mean stays where the band has no lower end."""
    mean = float(np.mean(signal))
    low = mean + shift_order(signal - mean, rate, 0, None, highest)
    if lowest is None:
        return low
    return sosfiltfilt(butter(_STEEP, lowest, "highpass", fs=rate, output="sos"), low)


def _stray_motion(
    campaign: Campaign, record: Record, motion: Motion, noise: float, seed: tuple[int, int]
) -> tuple[Array, ...]:
    """Give displacement, velocity and acceleration that noise of the output passes for."""
    values = noise * np.random.default_rng(seed).standard_normal(record.output.size)
    alone = dataclasses.replace(record, output=values)
    band = motion.band
    stray = measured_state(alone, campaign.output.quantity, band.lowest, band.highest)
    return tuple(jnp.asarray(values) for values in stray)
