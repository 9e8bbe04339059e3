"""Predictions over windows: an oscillator that SciPy solves exactly, and a mass without a spring."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lsim

from isojax.elements import LinearDamping, LinearStiffness
from isojax.identification import fit, prediction_errors
from isojax.models import Isolator
from isojax.records import Record, cut_into_windows

RATE, SENSOR, MASS, DAMPING = 100.0, 1e-4, 50.0, 300.0


def record_of(seed: int, stiffness: float, role: str = "fit") -> Record:
    """Displacement under a force of slow tones that is straight between samples."""
    draw = np.random.default_rng(seed)
    time = np.arange(2000) / RATE
    tones = np.arange(1, 40)[:, None] / 20.0
    force = np.sum(20.0 * np.cos(2.0 * np.pi * tones * time + 6.28 * draw.random((39, 1))), axis=0)
    system = (
        [[0.0, 1.0], [-stiffness / MASS, -DAMPING / MASS]],
        [[0.0], [1.0 / MASS]],
        [[1.0, 0.0]],
        [[0.0]],
    )
    output = lsim(system, force, time)[1] + SENSOR * draw.standard_normal(time.size)
    return Record(f"r{seed}", Path(f"r{seed}"), time, RATE, force, output, force, output, role=role)


@pytest.fixture(scope="module")
def campaigns(campaign_of):
    changes = {
        "mass": MASS,
        "input": {"hold": "linear"},
        "output": {"quantity": "displacement", "noise": SENSOR},
    }
    return [
        campaign_of((record_of(1, stiffness), record_of(2, stiffness, "holdout")), **changes)
        for stiffness in (4e3, 0.0)
    ]


def test_a_right_model_predicts_to_the_noise_over_every_time(campaigns):
    found = fit(Isolator(MASS, (LinearStiffness(3.8e3), LinearDamping(280.0))), campaigns[0])
    errors = prediction_errors(found, (0.5, 2.0, 30.0))
    np.testing.assert_allclose(errors.holdout[:2], SENSOR, rtol=0.1)
    np.testing.assert_allclose(errors.fit[:2], SENSOR, rtol=0.1)
    assert np.isnan(errors.fit[2])
    with pytest.raises(ValueError, match=r"two samples and more, 0\.02 s, but is 0\.01"):
        prediction_errors(found, (0.01,))


def test_the_error_of_a_mass_without_a_spring_grows_with_the_time_of_its_run(campaigns):
    wrong = fit(
        Isolator(MASS, (LinearDamping(280.0),)),
        campaigns[1],
        fixed=("linear_damping.coefficient",),
        free=("mass",),
    )
    errors = prediction_errors(wrong, (0.5, 2.0, 8.0)).holdout
    assert errors[0] < 0.5 * errors[1] < 0.5 * errors[2]


def test_windows_hold_the_samples_of_the_record_and_do_not_overlap(campaigns):
    cut = cut_into_windows(campaigns[1], 2.0)
    *windows, held = cut.records
    assert held is campaigns[1].records[1]
    assert len(windows) == 9
    assert {window.settle for window in windows} == {100}
    joined = np.concatenate([window.output[window.settle :] for window in windows])
    np.testing.assert_array_equal(joined, campaigns[1].records[0].output[100:1900])
    found = fit(Isolator(MASS, (LinearDamping(200.0),)), cut)
    name = "linear_damping.coefficient"
    assert abs(float(found.model[name]) - DAMPING) < 4.0 * found.standard_errors[name]
    with pytest.raises(ValueError, match="the longest has 20 s"):
        cut_into_windows(campaigns[1], 20.0)
    settled = dataclasses.replace(campaigns[1].records[0], settle=250)
    first = cut_into_windows(dataclasses.replace(campaigns[1], records=(settled,)), 2.0).records[0]
    assert first.start + first.settle == 250
