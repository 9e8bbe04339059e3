"""Noise of the drive channel, which the output does not show: an oscillator that SciPy solves exactly."""

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lsim

from isojax.elements import LinearDamping, LinearStiffness
from isojax.identification import Rules, fit
from isojax.identification.diagnosis._diagnose import _words_of_noise
from isojax.identification.fitting import drive_noise
from isojax.models import Isolator
from isojax.records import Dwell, Record

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


def fitted(campaign_of, records):
    campaign = campaign_of(records, stiffness=("linear",), damping=("linear",), input={"hold": "linear"})
    return fit(Isolator(MASS, (LinearStiffness(0.97e6), LinearDamping(5e3))), campaign)


@pytest.mark.parametrize("period", [None, 1250])
def test_noise_of_the_force_channel_explains_the_misfit(campaign_of, period):
    found = fitted(campaign_of, tuple(noisy_record(place, FORCE, 0.0, period) for place in range(2)))
    assert found.stats.chi2 / found.stats.dof > 1.2
    seen = drive_noise(found)
    assert seen is not None
    assert seen.drive == pytest.approx(FORCE, rel=0.05)
    assert seen.output == pytest.approx(SENSOR, rel=0.05)
    # What the oscillator makes of white noise that is straight between samples.
    heard = np.std(response(FORCE * np.random.default_rng(99).standard_normal(200_000)))
    assert seen.residual == pytest.approx(np.hypot(SENSOR, heard), rel=0.1)
    assert "The drive channel carries noise of" in _words_of_noise(found, Rules())


def test_noise_that_acts_and_is_measured_explains_nothing(campaign_of):
    found = fitted(campaign_of, tuple(noisy_record(place, 0.0, FORCE) for place in range(2)))
    assert drive_noise(found) is None
    assert drive_noise(found, Rules(good=1e-3)) is None
