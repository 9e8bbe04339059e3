"""Whether the true force, or the true reading, lies in the range of the models that a closed loop reports."""

import dataclasses
from pathlib import Path
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from isojax import read_campaign, rig
from isojax._parameters import list_parameters, replace_parameters
from isojax.identification import Loop
from isojax.identification.fitting import Spread
from isojax.identification.fitting._errors import restart_records
from isojax.identification.fitting._fit import simulator_for
from isojax.models import Instant, Isolator
from isojax.records import estimate_noise
from isojax.rig import Tones, response

CYCLES, SAMPLES = 16, 400
"""Cycles of a dwell from rest, of which the last is looked at, and instants a cycle."""


class Motion(NamedTuple):
    """A dwell from rest: two instants a step, and one more at the end.

    Attributes:
        step: time of a step [s].
        x: displacement [m].
        v: velocity [m/s].
        drive: force [N].
        a: acceleration [m/s^2].
    """

    step: float
    x: Float[np.ndarray, " time"]
    v: Float[np.ndarray, " time"]
    drive: Float[np.ndarray, " time"]
    a: Float[np.ndarray, " time"]


def miss(loop: Loop, plant: rig.Plant, levels: tuple[float, ...], frequencies: tuple[float, ...]) -> float:
    """Give how far the true force lies outside of the reported range, in standard errors.

    The plant moves steadily at each level and frequency. Its force, drive less inertia, is compared with that
    of the final model and of each alternative along the same motion; the range goes from the least of them to
    the largest. The mean over a cycle is left out: it is zero in truth, and no accelerometer shows it.

    Args:
        loop: a closed loop with findings.
        plant: what its records are of.
        levels: amplitudes of the force [N].
        frequencies: of the force [Hz].

    Returns:
        rms over the visited states of the distance to the range, over the rms standard error of the final
        model's force there.
    """
    fit = loop.after
    models = [fit.model, *(law.model for one in loop.alternatives[-1:] for law in one.laws)]
    places = [place for place, entry in enumerate(list_parameters(fit.model)) if entry.name in fit.free]
    covariance = np.nan_to_num(np.asarray(fit.covariance))
    outside, errors = [], []
    for level in levels:
        for frequency in frequencies:
            motion = _steady(plant, level, frequency)
            true = (motion.drive - loop.campaign.mass * motion.a)[-SAMPLES - 1 : -1 : 2]
            held = np.stack([np.asarray(_cycle(model, motion)) for model in models])
            beyond = np.maximum(held.min(axis=0) - (true - true.mean()), 0.0)
            outside.append(beyond + np.maximum(true - true.mean() - held.max(axis=0), 0.0))
            slope = np.asarray(_slope(fit.model, tuple(places), motion))
            errors.append(np.sqrt(np.maximum(np.sum(slope @ covariance * slope, axis=1), 0.0)))
    return float(np.sqrt(np.mean(np.square(outside)) / np.mean(np.square(errors))))


def reading_miss(
    loop: Loop,
    plant: rig.Plant,
    bench: rig.Bench,
    levels: tuple[float, ...],
    frequencies: tuple[float, ...],
    folder: Path,
) -> float:
    """Give how far what the bench reads lies outside of what the reported models read, in standard errors.

    The bench, without its noise, records dwells at each level and frequency. Each model follows the recorded
    drive, every dwell from its best start; the range goes from the least of their readings to the largest.
    It is what `miss` is for effects that are no forces: of a channel, of the drive.

    Args:
        loop: a closed loop with findings.
        plant: what its records are of.
        bench: what recorded them.
        levels: amplitudes of the force [N].
        frequencies: of the force [Hz].
        folder: for the records.

    Returns:
        rms of the distance to the range, over the rms standard error of the final model's readings.
    """
    quiet = dataclasses.replace(bench, noise=0.0, force_noise=0.0, drift=0.0)
    plan = rig.SteppedSine(levels, frequencies, CYCLES, ("forward",))
    told = read_campaign(rig.write_campaign(folder, plant, (plan,), 0, "true", quiet))
    told = dataclasses.replace(told, output=dataclasses.replace(told.output, noise=bench.noise))
    fit = loop.after
    places = tuple(place for place, entry in enumerate(list_parameters(fit.model)) if entry.name in fit.free)

    def run(model: Isolator, places: tuple[int, ...] = ()):
        simulator = simulator_for(model, told, estimate_noise(told), None)
        return restart_records(simulator, model, Spread(1e-9), None, places)

    final = run(fit.model, places)
    held = [final, *(run(law.model) for one in loop.alternatives[-1:] for law in one.laws)]
    squares, count = 0.0, 0
    for record, runs in enumerate(zip(*(one.runs for one in held), strict=True)):
        simulated = np.stack([one.simulated for one in runs])
        true = told.records[record].output
        beyond = np.maximum(simulated.min(axis=0) - true, 0.0) + np.maximum(true - simulated.max(axis=0), 0.0)
        squares += float(np.sum(beyond[runs[0].counted > 0.0] ** 2))
        count += int(np.sum(runs[0].counted > 0.0))
    information = final.point.reduced.matrix[:-1, :-1]
    error = bench.noise**2 * np.trace(np.nan_to_num(np.asarray(fit.covariance)) @ information) / count
    return float(np.sqrt(squares / count / error))


def _steady(plant: rig.Plant, level: float, frequency: float) -> Motion:
    times = np.arange(CYCLES * SAMPLES + 1) / (SAMPLES * frequency)
    tone = Tones(0.0, 1.001 * times[-1], 0.0, (level,), (2.0 * np.pi * frequency,), (0.0,))
    found = response(plant, [tone], times)
    names = ("displacement", "velocity", "force", "acceleration")
    return Motion(2.0 / (SAMPLES * frequency), *(found[name] for name in names))


@eqx.filter_jit
def _cycle(model: Isolator, motion: Motion) -> Float[Array, " time"]:
    """Give a model's force, drive less inertia, over the last cycle of a motion; less its mean."""
    here = tuple(jnp.asarray(one) for one in (motion.x, motion.v, motion.drive))

    def rates(internal: tuple[Array, ...], at: tuple[Array, ...]) -> tuple[Array, ...]:
        x, v, drive = at
        return model.rates((x, v, *internal), Instant(drive))[2:]

    def ahead(internal: tuple[Array, ...], by: tuple[Array, ...], share: float) -> tuple[Array, ...]:
        return tuple(z + share * motion.step * dz for z, dz in zip(internal, by, strict=True))

    def runge_kutta(internal: tuple[Array, ...], now: tuple) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
        first, middle, last = now
        k1 = rates(internal, first)
        k2 = rates(ahead(internal, k1, 0.5), middle)
        k3 = rates(ahead(internal, k2, 0.5), middle)
        k4 = rates(ahead(internal, k3, 1.0), last)
        mean = tuple((a + 2.0 * b + 2.0 * c + d) / 6.0 for a, b, c, d in zip(k1, k2, k3, k4, strict=True))
        return ahead(internal, mean, 1.0), internal

    rest = tuple(jnp.zeros(()) for _ in range(model.internal_states))
    steps = tuple(tuple(one[start : one.size - 2 + start : 2] for one in here) for start in range(3))
    _, internal = jax.lax.scan(runge_kutta, rest, steps)
    state = (*steps[0][:2], *internal)
    force = steps[0][2] - model.mass * model.acceleration(state, Instant(steps[0][2]))
    last = force[-SAMPLES // 2 :]
    return last - last.mean()


@eqx.filter_jit
def _slope(model: Isolator, places: tuple[int, ...], motion: Motion) -> Float[Array, "time coefficient"]:
    numbers = jnp.asarray([entry.value for entry in list_parameters(model)])

    def force(values: Array) -> Array:
        return _cycle(replace_parameters(model, list(numbers.at[jnp.array(places)].set(values))), motion)

    return jax.jacfwd(force)(numbers[jnp.array(places)])
