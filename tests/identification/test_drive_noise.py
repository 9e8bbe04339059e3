"""Noise of the drive channel, which the output does not show: an oscillator that SciPy solves exactly."""

import dataclasses
import re
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import butter, freqz, lfilter, lsim, welch

from isojax import rig
from isojax._progress import silent
from isojax.elements import CubicStiffness, LinearDamping, LinearStiffness
from isojax.identification import Rules, diagnose, fit
from isojax.identification.fitting import (
    DEFAULT_SOLVER,
    as_fit_of_errors,
    drive_noise,
    search_of,
    weighted_by_output,
)
from isojax.models import Integrator, Isolator
from isojax.records import Dwell, Record, estimate_noise, quieter_noise

RATE, SENSOR, FORCE = 250.0, 0.003, 4.0
STIFFNESS, DAMPING, MASS = 1.0e6, 4.0e3, 800.0
FREQUENCIES = (4.6, 5.0, 5.3, 5.6, 6.0, 6.4)


def response(force):
    """Acceleration of the oscillator under a force that is straight between samples: exact."""
    system = (
        [[0.0, 1.0], [-STIFFNESS / MASS, -DAMPING / MASS]],
        [[0.0], [1.0 / MASS]],
        [[-STIFFNESS / MASS, -DAMPING / MASS]],
        [[1.0 / MASS]],
    )
    return lsim(system, force, np.arange(force.size) / RATE)[1]


def noisy_record(seed, measured, acting, period=None):
    """A stepped sine, or a periodic drive; the force channel reads noise, and real noise acts as well."""
    draw = np.random.default_rng(seed)
    dwells, parts, start = [], [], 0
    for frequency in FREQUENCIES:
        size = round(36 * RATE / frequency)
        parts.append(60.0 * np.sin(2.0 * np.pi * frequency * np.arange(size) / RATE))
        dwells.append(Dwell(start, start + size, frequency, 36.0))
        start += size
    force = np.concatenate(parts)
    if period is not None:
        tones = np.cos(
            2.0 * np.pi * np.outer(np.arange(1, 40) * RATE / period, np.arange(period) / RATE)
            + 2.0 * np.pi * draw.random(39)[:, None]
        )
        force, dwells = np.tile(8.0 * tones.sum(axis=0), 7), []
    force = force + acting * draw.standard_normal(force.size)
    output = response(force) + SENSOR * draw.standard_normal(force.size)
    read = force + measured * draw.standard_normal(force.size)
    return Record(
        f"r{seed}",
        Path(f"r{seed}"),
        np.arange(force.size) / RATE,
        RATE,
        read,
        output,
        read,
        output,
        dwells=tuple(dwells),
        period=period,
        settle=0 if period is None else period,
        kind="stepped_sine" if period is None else "periodic",
    )


def shaken_record(seed):
    """A stepped sine over a floor that shakes up to 30 Hz, which no channel measures."""
    clean, draw = noisy_record(seed, 0.0, 0.0), np.random.default_rng(100 + seed)
    shaking = lfilter(*butter(2, 30.0, fs=RATE), FORCE * draw.standard_normal(clean.input.size))
    output = clean.output + response(shaking)
    return dataclasses.replace(clean, output=output, raw_output=output)


def fitted(campaign_of, records, integrator=None):
    campaign = campaign_of(records, stiffness=("linear",), damping=("linear",), input={"hold": "linear"})
    start = Isolator(MASS, (LinearStiffness(0.97e6), LinearDamping(5e3)))
    return fit(start, campaign, integrator=integrator)


@pytest.mark.parametrize(
    ("damping", "cubic", "levels", "frequencies", "noise"),
    [
        (600.0, 6e10, (41.0, 57.0), (4.7, 5.3, 5.6, 6.1, 6.9), 1e-3),
        (935.0, 6e10, (41.0, 57.0), (4.7, 5.3, 5.6, 6.1, 6.9), 1e-3),
    ],
)
def test_starts_that_ring_through_short_dwells_are_no_noise(
    simulated, damping, cubic, levels, frequencies, noise
):
    """On the rig, lightly damped: the ends of dwells scatter by many times the noise of the sensor."""
    plant = rig.Plant((rig.LinearStiffness(1e6), rig.CubicStiffness(cubic), rig.LinearDamping(damping)))
    bench = rig.Bench(rate=250.0, noise=noise, drift=1e-3, force_noise=0.0, anti_alias=False, tolerance=1e-8)
    plan = rig.SteppedSine(levels, frequencies, 8, ("forward",))
    laws = {"stiffness": ("linear", "cubic"), "damping": ("linear",)}
    campaign = simulated(plant, plan, 1, bench, output={"noise": None}, **laws)
    start = (LinearStiffness(0.98e6), CubicStiffness(0.9 * cubic), LinearDamping(1.1 * damping))
    found = fit(Isolator(MASS, start), campaign)
    assert found.noise.levels == pytest.approx([noise, noise], rel=0.03)
    assert found.stats.chi2 / found.stats.dof == pytest.approx(1.0, abs=0.04)
    error = found.standard_errors["linear_damping.coefficient"]
    assert float(found.model["linear_damping.coefficient"]) == pytest.approx(damping, abs=3.0 * error)


@pytest.mark.parametrize("true", [(SENSOR, SENSOR), (SENSOR, 2.0 * SENSOR)])
def test_each_record_weighs_with_the_noise_that_its_own_residual_shows(campaign_of, true):
    """Dwells whose start rings on scatter more than the sensor does, and not all records alike."""
    records = tuple(noisy_record(place, 0.0, 0.0) for place in range(2))
    campaign, draw = campaign_of(records), np.random.default_rng(5)
    seen = dataclasses.replace(estimate_noise(campaign), sigma=1.02 * SENSOR, levels=(SENSOR, 3.0 * SENSOR))
    windows = [[level * draw.standard_normal(records[0].output.size)] for level in true]
    found = quieter_noise(campaign, seen, seen, windows)
    assert quieter_noise(campaign, seen, found, windows) is None
    assert found.method == "residual"
    assert found.levels == pytest.approx(true, rel=0.03)


@pytest.mark.parametrize("period", [None, 1250])
def test_noise_of_the_force_channel_is_a_random_force(campaign_of, period):
    found = fitted(campaign_of, tuple(noisy_record(place, FORCE, 0.0, period) for place in range(2)))
    assert found.innovations is not None
    assert np.sqrt(found.innovations.sizes.variance) == pytest.approx(FORCE, rel=0.1)
    assert np.exp(0.5 * found.innovations.sizes.noise) == pytest.approx(SENSOR, rel=0.1)
    assert found.stats.chi2 / found.stats.dof == pytest.approx(1.0, abs=0.03)


@pytest.mark.parametrize("period", [None, 1250])
def test_noise_of_the_force_channel_weighs_the_residual_where_steps_are_given(campaign_of, period):
    records = tuple(noisy_record(place, FORCE, 0.0, period) for place in range(2))
    found = fitted(campaign_of, records, Integrator(substeps=2))
    # What the oscillator makes of white noise that is straight between samples.
    heard = response(FORCE * np.random.default_rng(99).standard_normal(200_000))
    assert found.noise.method == "residual"
    assert found.noise.sigma == pytest.approx(np.hypot(SENSOR, np.std(heard)), rel=0.1)
    assert found.stats.chi2 / found.stats.dof == pytest.approx(1.0, abs=0.03)
    assert re.search(r"drive channel, whose own noise is (3\.[89]|4\.[01])", found.noise.note)
    # Its density is that of both noises together, as Welch sees it.
    frequencies, density = welch(heard, RATE, nperseg=1024)
    density += 2.0 * SENSOR**2 / RATE
    own = found.noise.colour
    seen = (
        2.0 / RATE * own.innovation**2 / np.abs(freqz([1.0], [1.0, *own.law], frequencies, fs=RATE)[1]) ** -2
    )
    near = (frequencies > 4.0) & (frequencies < 7.0)
    assert np.mean(density[near]) > 3.0 * np.median(density)
    assert np.mean(seen[near]) == pytest.approx(np.mean(density[near]), rel=0.2)
    assert np.median(seen) == pytest.approx(np.median(density), rel=0.1)


@pytest.mark.parametrize("period", [None, 1250])
def test_noise_of_the_force_channel_is_named_as_the_cause(campaign_of, period):
    records = tuple(noisy_record(place, FORCE, 0.0, period) for place in range(2))
    weighted = fitted(campaign_of, records)
    found = weighted_by_output(weighted, search_of(weighted.campaign, Rules(), DEFAULT_SOLVER, silent))
    assert found.stats.chi2 / found.stats.dof > 1.2
    seen = drive_noise(found)
    assert seen is not None
    assert seen.drive == pytest.approx(FORCE, rel=0.05)
    assert seen.output == pytest.approx(SENSOR, rel=0.05)
    if period is None:
        verdict = diagnose(weighted)
        assert verdict.verdict == "none"
        assert "The drive channel carries noise of" in verdict.reason


def test_error_bars_under_noise_of_the_force_channel_hold_the_truth(campaign_of):
    truth, off = (STIFFNESS, DAMPING), []
    for seed in range(6):
        found = fitted(campaign_of, tuple(noisy_record(100 + 2 * seed + one, FORCE, 0.0) for one in range(2)))
        errors = found.standard_errors
        off += [
            (float(found.model[name]) - true) / error
            for true, (name, error) in zip(truth, errors.items(), strict=True)
        ]
    # 12 normal numbers have an rms below 1.5 with a chance of 0.996; white weights gave 2 and more.
    assert np.sqrt(np.mean(np.square(off))) < 1.5


def test_noise_that_acts_and_is_measured_is_no_noise_of_the_residual(campaign_of):
    found = fitted(campaign_of, tuple(noisy_record(place, 0.0, FORCE) for place in range(2)))
    # The response scatters by twice as much, and the model follows it.
    assert found.noise.sigma == pytest.approx(SENSOR, rel=0.05)
    assert found.noise.colour is None
    assert found.stats.chi2 / found.stats.dof == pytest.approx(1.0, abs=0.03)
    assert "most of which the model explains" in found.noise.note


def test_a_floor_that_shakes_is_a_random_force_on_the_mass(campaign_of):
    """Its noise has the colour of the isolator's own answer, and its size is found by the likelihood."""
    found = fitted(campaign_of, tuple(shaken_record(place) for place in range(2)))
    errors = found.innovations
    assert errors is not None
    assert errors.is_noise
    assert errors.has_force
    for name, true in (("linear_stiffness.coefficient", STIFFNESS), ("linear_damping.coefficient", DAMPING)):
        assert abs(float(found.model[name]) - true) < 4.0 * found.standard_errors[name]
    near = errors.way.deviance.sum(axis=1)
    assert near[0] < near.min() + 0.1  # no size a little larger or smaller makes the records more probable
    wider = as_fit_of_errors(dataclasses.replace(errors, unkept=9.0), found.start, found.campaign)
    for name, error in wider.standard_errors.items():
        assert error == pytest.approx(3.0 * found.standard_errors[name])


@pytest.mark.parametrize("scatter", [0.0, 0.003])
def test_under_noise_of_the_force_channel_each_record_has_its_stiffness(simulated, scatter):
    """On the rig, whose stiffness differs from record to record: one for all would be known too well."""
    plant = rig.Plant((rig.LinearStiffness(1e6), rig.LinearDamping(4e3)))
    bench = rig.Bench(rate=250.0, noise=3e-3, drift=scatter, force_noise=3.0, tolerance=1e-8)
    plan = rig.SteppedSine((40.0, 60.0), (4.7, 5.3, 5.6, 6.1), 30, ("forward", "backward"))
    laws = {"stiffness": ("linear",), "damping": ("linear",)}
    found = fit(
        Isolator(MASS, (LinearStiffness(0.98e6), LinearDamping(5e3))),
        simulated(plant, plan, 2, bench, output={"noise": None}, **laws),
    )
    assert found.innovations is not None
    assert np.sqrt(found.innovations.sizes.variance) == pytest.approx(3.0, rel=0.1)
    assert found.stats.next_stiffness_scatter > found.stats.stiffness_scatter
    assert found.stats.stiffness_scatter == pytest.approx(scatter, rel=0.6, abs=5e-4)
    stiffness, error = (
        float(one["linear_stiffness.coefficient"]) for one in (found.model, found.standard_errors)
    )
    assert abs(stiffness - 1e6) < 3.0 * error
    # Four records tell a mean no better than their scatter allows.
    assert error > 0.3e6 * scatter / 2.0
