"""Too few lines for a circle, too few samples for a noise: NaN, or an error that says what to do."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from isojax import Isolator, LinearDamping, LinearStiffness, fit
from isojax.identification import fit_circle
from isojax.records import Record, estimate_noise

RATIO, NATURAL = 0.05, 5.0
MODEL = Isolator(800.0, (LinearStiffness(1e6), LinearDamping(1e4)))


def receptance(frequency: np.ndarray) -> np.ndarray:
    """Of 800 kg on a linear spring and damper."""
    omega, natural = 2.0 * np.pi * frequency, 2.0 * np.pi * NATURAL
    return 1.0 / (800.0 * (natural**2 - omega**2 + 2j * RATIO * natural * omega))


def test_four_lines_are_enough_for_a_circle():
    frequency = np.array([4.8, 4.95, 5.05, 5.2])
    found = fit_circle(frequency, receptance(frequency))
    assert found.lines == 4
    assert found.damping_ratio == pytest.approx(RATIO, rel=1e-6)
    assert found.natural_frequency == pytest.approx(NATURAL, rel=1e-6)


@pytest.mark.parametrize(
    "frequency",
    [[], [5.0], [4.8, 5.0, 5.2], [1.0, 2.0, 4.9, 5.0, 5.1, 9.0, 20.0]],
    ids=["none", "one", "three", "three near resonance"],
)
def test_fewer_than_four_usable_lines_draw_no_circle(frequency):
    frequency = np.array(frequency, dtype=float)
    found = fit_circle(frequency, receptance(frequency))
    assert found.lines == 0
    numbers = (found.natural_frequency, found.damping_ratio, found.diameter, found.scatter)
    assert np.all(np.isnan(numbers))


def noise_alone(size: int) -> Record:
    """A record of white noise of rms 0.3 at 100 Hz, driven by another."""
    force, output = np.random.default_rng(7).normal(size=(2, size)) * [[1.0], [0.3]]
    time = np.arange(size) / 100.0
    return Record(f"r{size}", Path(f"r{size}.npz"), time, 100.0, force, output, force, output)


@pytest.mark.parametrize("size", [16, 17, 24])
def test_a_very_short_record_shows_no_noise(campaign_of, size):
    assert np.isnan(estimate_noise(campaign_of((noise_alone(size),))).sigma)


def test_a_very_short_record_takes_the_noise_of_a_long_one(campaign_of):
    noise = estimate_noise(campaign_of((noise_alone(16), noise_alone(4000))))
    assert noise.sigma == pytest.approx(0.3, rel=0.1)
    assert noise.per_record == (noise.sigma, noise.sigma)


def test_a_fit_without_a_noise_asks_for_it(campaign_of):
    message = r"bench.campaign\.toml: the noise of the output must be above 0.* show nan; .*\[output\] noise"
    with pytest.raises(ValueError, match=message):
        fit(MODEL, campaign_of((noise_alone(16),)))
    declared = campaign_of((noise_alone(16),), output={"noise": 0.3})
    assert estimate_noise(declared).sigma == 0.3


def test_a_fit_of_a_record_at_rest_says_that_the_output_must_move(campaign_of):
    still = dataclasses.replace(noise_alone(400), output=np.zeros(400))
    with pytest.raises(
        ValueError, match=r"output of .*bench.campaign\.toml must move, but is constant in every"
    ):
        fit(MODEL, campaign_of((still,)))
