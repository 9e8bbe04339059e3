"""Errors of the channels as declared: noise of the drive, accuracy, a random force. Motions by SciPy."""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from isojax.elements import LinearDamping, LinearStiffness
from isojax.identification import diagnose, fit
from isojax.models import Isolator
from isojax.records import Record

RATE, MASS, STIFFNESS, DAMPING, SENSOR = 100.0, 20.0, 5e3, 30.0, 2e-6
"""2.5 Hz at a hundred samples a second."""


def record_of(
    seed: int, level: float, cubic: float = 0.0, drive_noise: float = 0.0, role: str = "fit"
) -> Record:
    """Displacement under tones from 0.5 to 6 Hz from rest; the force is measured with noise."""
    draw = np.random.default_rng(seed)
    time, tones = np.arange(3000) / RATE, np.linspace(0.5, 6.0, 56)
    phases = 2.0 * np.pi * draw.random(tones.size)

    def force(at: np.ndarray | float) -> np.ndarray:
        return level * np.sum(np.cos(2.0 * np.pi * np.multiply.outer(at, tones) + phases), axis=-1)

    def rates(at: float, state: np.ndarray) -> list[float]:
        x, v = state
        return [v, (force(at) - STIFFNESS * x - cubic * x**3 - DAMPING * v) / MASS]

    motion = solve_ivp(rates, (0.0, time[-1]), [0.0, 0.0], t_eval=time, rtol=1e-9, atol=1e-12, max_step=0.02)
    output = motion.y[0] + SENSOR * draw.standard_normal(time.size)
    measured = force(time) + drive_noise * draw.standard_normal(time.size)
    return Record(
        f"r{seed}",
        Path(f"r{seed}"),
        time,
        RATE,
        measured,
        output,
        measured,
        output,
        level=level,
        role=role,
        kind="broadband",
    )


def start() -> Isolator:
    return Isolator(MASS, (LinearStiffness(0.9 * STIFFNESS), LinearDamping(1.5 * DAMPING)))


def changes_of(**channels) -> dict:
    output = {"quantity": "displacement", "noise": SENSOR, **channels.pop("output", {})}
    return {"mass": MASS, "output": output, **channels}


@pytest.fixture(scope="module")
def noisy():
    """Noise of a hundredth of the drive's rms, some thirty times the sensor's once it reaches the output."""
    return tuple(record_of(seed, 1.0 + seed, drive_noise=0.5) for seed in range(3))


def test_declared_noise_of_the_drive_is_no_missing_effect(campaign_of, noisy):
    campaign = campaign_of(noisy, **changes_of(input={"noise": 0.5}))
    found = fit(start(), campaign)
    for name, value in (("linear_stiffness", STIFFNESS), ("linear_damping", DAMPING)):
        error = found.standard_errors[f"{name}.coefficient"]
        assert abs(float(found.model[f"{name}.coefficient"]) - value) < 4.0 * error < 0.05 * value
    assert found.innovations is not None
    assert found.innovations.sizes.variance == pytest.approx(0.25, rel=0.2)
    verdict = diagnose(found)
    assert verdict.verdict == "none"
    assert "noise of the drive, 0.5 N rms" in verdict.reason


def test_a_declared_random_force_is_not_estimated(campaign_of, noisy):
    for own in (1.0, 3.0):
        campaign = campaign_of(noisy, **changes_of(random_force=own))
        found = fit(start(), campaign).innovations
        assert found is not None
        assert found.sizes.variance == pytest.approx(own**2, rel=0.02)


def test_both_declared_add_up(campaign_of, noisy):
    campaign = campaign_of(noisy, **changes_of(random_force=0.8, input={"noise": 0.6}))
    found = fit(start(), campaign).innovations
    assert found is not None
    assert found.sizes.variance == pytest.approx(1.0, rel=0.02)


@pytest.mark.parametrize("channel", ["input", "output"])
def test_what_takes_off_less_than_the_accuracy_is_no_finding(campaign_of, channel):
    records = tuple(record_of(10 + seed, 1.0 + seed, cubic=2e6) for seed in range(3))
    # With noise of the drive a filter follows the records; without any they are simulated.
    beside = {"input": {"noise": 1e-4}} if channel == "input" else {}
    plain = diagnose(fit(start(), campaign_of(records, **changes_of(**beside))))
    assert plain.finding is not None
    assert plain.finding.effect == "cubic_stiffness"
    declared = {**beside, channel: {**beside.get(channel, {}), "accuracy": 0.3}}
    assert diagnose(fit(start(), campaign_of(records, **changes_of(**declared)))).finding is None
