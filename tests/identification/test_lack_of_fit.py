"""Lack of fit against pure error: calibrated for noise of any colour, sharp for what the drive repeats."""

from pathlib import Path

import numpy as np
import pytest
from scipy import signal, stats

from isojax.identification.fitting._errors import Run
from isojax.identification.fitting._lack_of_fit import locked_power
from isojax.records import Dwell, Record

RATE = 250.0
AR = {"white": (1.0,), "AR(0.5)": (1.0, -0.5), "AR(0.9)": (1.0, -0.9)}


def coloured(rng, size, poles):
    return 0.01 * signal.lfilter([1.0], poles, rng.standard_normal(size + 200))[200:]


def stepped(noise, wrong):
    """A stepped sine of 12 frequencies whose residual is noise and what the model has wrong."""
    drive, dwells = [], []
    for frequency in np.arange(4.0, 7.0, 0.25):
        start, size = sum(map(len, drive)), round(12 * RATE / frequency)
        drive.append(np.sin(2.0 * np.pi * frequency * np.arange(size) / RATE))
        dwells.append(Dwell(start, start + size, frequency, 12.0))
    drive = np.concatenate(drive)
    return run_of(drive, noise(drive.size) + wrong(drive), dwells=tuple(dwells), kind="stepped_sine")


def swept(noise, wrong):
    """A sweep from 3 to 9 Hz in one minute."""
    time = np.arange(int(60.0 * RATE)) / RATE
    drive = signal.chirp(time, 3.0, 60.0, 9.0)
    return run_of(drive, noise(drive.size) + wrong(drive), kind="swept")


def periodic(noise, wrong):
    """Five periods of a multisine."""
    size = int(4.0 * RATE)
    turns = np.arange(size) / size
    drive = np.tile(sum(np.cos(2 * np.pi * k * turns + k**2) for k in range(12, 28)), 5) / 4.0
    return run_of(drive, noise(drive.size) + wrong(drive), period=size)


def run_of(drive, residual, **fields):
    output = 3.0 * drive + residual
    time = np.arange(drive.size) / RATE
    record = Record("r", Path("r.npz"), time, RATE, drive, output, drive, output, **fields)
    return Run(record, output - residual, np.ones(drive.size))


@pytest.mark.parametrize("excitation", [stepped, swept, periodic])
@pytest.mark.parametrize("poles", AR.values(), ids=AR)
def test_the_chance_is_uniform_where_only_noise_is_left(excitation, poles, unchecked):
    rng = np.random.default_rng(7)
    chances = [
        locked_power(
            [excitation(lambda size: coloured(rng, size, poles), lambda drive: 0.0) for _ in range(2)], 0, 0.0
        ).p_value
        for _ in range(120)
    ]
    assert stats.kstest(chances, "uniform").pvalue > 1e-3
    assert np.mean(np.array(chances) < 0.01) < 0.05


@pytest.mark.parametrize("excitation", [stepped, swept, periodic])
def test_a_cubic_that_the_model_lacks_is_seen_below_the_noise(excitation):
    # The power of the missing cube is a tenth of that of the noise: chi2/dof would be 1.1.
    rng = np.random.default_rng(8)
    size = 0.01 * np.sqrt(0.1)
    run = excitation(
        lambda count: coloured(rng, count, (1.0,)), lambda drive: size * drive**3 / np.std(drive**3)
    )
    assert locked_power([run], 0, 0.0).p_value < 1e-6
    # It is within an error of a tenth of the response.
    assert locked_power([run], 0, 0.1).p_value > 0.5


@pytest.mark.parametrize("excitation", [stepped, periodic])
def test_a_line_of_the_mains_is_no_lack_of_fit(excitation):
    rng = np.random.default_rng(9)
    run = excitation(
        lambda size: (
            coloured(rng, size, (1.0,)) + 0.005 * np.cos(2.0 * np.pi * 50.13 * np.arange(size) / RATE)
        ),
        lambda drive: 0.0,
    )
    assert locked_power([run], 0, 0.0).p_value > 1e-2


def test_a_drive_that_never_repeats_tells_nothing():
    rng = np.random.default_rng(10)
    run = run_of(rng.standard_normal(5000), coloured(rng, 5000, (1.0,)))
    assert np.isnan(locked_power([run], 0, 0.0).p_value)
