"""A clock of the response that runs fast or slow, against the closed form of a linear oscillator.

The response to a periodic force is a sum of lines, which can be read at the instants of any clock.
"""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from isojax.elements import ClockSkew, InputDelay, LinearDamping, LinearStiffness
from isojax.identification import diagnose, fit
from isojax.models import Isolator
from isojax.records import Record

RATE, PERIOD, PERIODS = 100.0, 8.0, 6
MASS, STIFFNESS, DAMPING = 800.0, 1.1e6, 9e3
LINES = np.arange(2.0, 12.0, 1.0 / PERIOD)
UNITS = {"displacement": ("m", 0), "velocity": ("m/s", 1), "acceleration": ("m/s^2", 2)}
BASE = Isolator(MASS, (LinearStiffness(1.09e6), LinearDamping(9.5e3)))


def skewed(name: str, quantity: str, skew: float, delay: float = 0.0, start: float = 0.0) -> Record:
    """A record whose output was filed by a clock that gains `skew`, from `start` seconds of its file on."""
    draw = np.random.default_rng(len(name))
    phases = draw.uniform(0.0, 2.0 * np.pi, LINES.size)
    omega = 2.0 * np.pi * LINES
    receptance = 1.0 / (STIFFNESS - MASS * omega**2 + 1j * DAMPING * omega)
    response = 12.0 * receptance * (1j * omega) ** UNITS[quantity][1] * np.exp(1j * phases)
    number = np.arange(round(PERIOD * PERIODS * RATE))
    time = start + number / RATE
    drive = 12.0 * np.cos(np.multiply.outer(time, omega) + phases).sum(axis=1)
    seen = time / (1.0 + skew) - delay
    output = (np.exp(1j * np.multiply.outer(seen, omega)) @ response).real
    output = output + 1e-3 * np.std(output) * draw.standard_normal(output.size)
    channels = drive, output, drive, output
    record = Record(name, Path(f"{name}.npz"), number / RATE, RATE, *channels, start=round(start * RATE))
    # The force that acts first was recorded before a record that is cut from the middle of a file.
    return dataclasses.replace(record, settle=20 if start else 0)


def filed(campaign_of, quantity: str, skew: float, **more):
    records = tuple(skewed(name, quantity, skew, **more) for name in ("one", "three"))
    noise = 1e-3 * float(np.std(records[0].output))
    # The signals are periodic only by the clock of the force, and so neither record is declared to be.
    return campaign_of(records, output={"quantity": quantity, "column": "y", "unit": "SI", "noise": noise})


@pytest.mark.parametrize(
    ("quantity", "skew", "start"),
    [
        ("displacement", 8e-5, 0.0),
        ("velocity", -3e-5, 0.0),
        ("acceleration", 2e-4, 0.0),
        ("velocity", 1e-4, 300.0),
    ],
)
def test_a_skew_is_measured_beside_the_plant_with_any_sensor(campaign_of, quantity, skew, start):
    campaign = filed(campaign_of, quantity, skew, start=start)
    found = fit(Isolator(MASS, (*BASE.elements, ClockSkew(0.0))), campaign)
    names = ("clock_skew.rate", "linear_stiffness.coefficient", "linear_damping.coefficient")
    truth = (1e6 * skew, STIFFNESS, DAMPING)
    for name, value, by_other_clock in zip(names, truth, (0.0, 2.0, 2.0), strict=True):
        off = abs(float(found.model[name]) - value)
        assert off < 4.0 * found.standard_errors[name] + by_other_clock * abs(skew) * value
    assert found.standard_errors["clock_skew.rate"] < 1.0
    assert found.errors["fit"].chi2_per_dof == pytest.approx(1.0, abs=0.05)


def test_a_delay_beside_a_skew_is_measured_too(campaign_of):
    campaign = filed(campaign_of, "acceleration", 6e-5, delay=1.5e-3)
    found = fit(Isolator(MASS, (*BASE.elements, InputDelay(0.0), ClockSkew(0.0))), campaign)
    for name, value in (("clock_skew.rate", 60.0), ("input_delay.delay", 1.5e-3)):
        assert abs(float(found.model[name]) - value) < 4.0 * found.standard_errors[name]


def test_a_skew_is_named_and_a_delay_is_not_called_one(campaign_of):
    for skew, delay, name in ((2e-5, 0.0, "clock_skew"), (0.0, 5e-4, "input_delay")):
        campaign = filed(campaign_of, "acceleration", skew, delay=delay)
        verdict = diagnose(fit(BASE, campaign))
        assert verdict.finding is not None
        assert verdict.finding.effect == name
        assert not verdict.finding.indistinguishable


def test_a_skew_cannot_be_fitted_where_the_drive_jumps(campaign_of):
    campaign = filed(campaign_of, "acceleration", 2e-5)
    held = dataclasses.replace(campaign, input=dataclasses.replace(campaign.input, hold="zero_order"))
    with pytest.raises(ValueError, match=r"clock_skew\.rate cannot be fitted where the drive is held"):
        fit(Isolator(MASS, (*BASE.elements, ClockSkew(0.0))), held)
