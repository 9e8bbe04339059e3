"""Noise of the drive channel, which the output does not show: an oscillator that SciPy solves exactly."""

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lsim

from isojax.elements import LinearDamping, LinearStiffness
from isojax.identification import fit
from isojax.models import Isolator
from isojax.records import Dwell, Record, estimate_noise

RATE, SENSOR, FORCE, CAMPAIGNS = 250.0, 0.003, 4.0, 8
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


def fitted(campaign_of, records):
    campaign = campaign_of(records, stiffness=("linear",), damping=("linear",), input={"hold": "linear"})
    return fit(Isolator(MASS, (LinearStiffness(0.97e6), LinearDamping(5e3))), campaign), campaign


@pytest.mark.parametrize("period", [None, 1250])
def test_noise_of_the_force_channel_is_seen_in_the_residual_and_intervals_cover(campaign_of, period):
    off, ratios = [], []
    for seed in range(CAMPAIGNS):
        records = tuple(noisy_record(10 * seed + place, FORCE, 0.0, period) for place in range(2))
        found, campaign = fitted(campaign_of, records)
        truth = {"linear_stiffness.coefficient": STIFFNESS, "linear_damping.coefficient": DAMPING}
        off += [
            (float(found.model[name]) - truth[name]) / error for name, error in found.standard_errors.items()
        ]
        ratios.append(found.stats.chi2 / found.stats.dof)
        assert found.noise.sigma > 1.2 * estimate_noise(campaign).sigma
    # 95 % of 16: fewer than 13 have a chance of 0.7 %.
    assert np.sum(np.abs(off) < 1.96) >= 13
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.03)


def test_noise_that_acts_and_is_measured_is_none(campaign_of):
    found, campaign = fitted(campaign_of, tuple(noisy_record(place, 0.0, FORCE) for place in range(2)))
    assert estimate_noise(campaign).sigma > 1.2 * SENSOR
    assert found.noise.sigma == pytest.approx(SENSOR, rel=0.05)
    assert found.stats.chi2 / found.stats.dof == pytest.approx(1.0, abs=0.05)
