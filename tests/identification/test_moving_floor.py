"""A floor that moves under the simulated bench, with and without a sensor on it."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from isojax import rig
from isojax.elements import CATALOGUE, FloorMotion, LinearDamping, LinearStiffness
from isojax.identification import diagnose, fit
from isojax.identification.jacobian._channels import carries, channel_table, effects_without_signal
from isojax.models import Isolator
from isojax.records import Record

BASE = Isolator(800.0, (LinearStiffness(1.05e6), LinearDamping(1e4)))
PLANT = rig.Plant((rig.LinearStiffness(1.08e6), rig.LinearDamping(1.03e4)), 800.0)
PLAN = rig.SteppedSine((80.0,), (4.5, 5.5, 6.5), 12)


@pytest.mark.slow
def test_a_measured_floor_is_named_with_its_share(simulated):
    campaign = simulated(PLANT.plus(rig.FloorMotion(0.7, 0.02)), PLAN, seed=3)
    verdict = diagnose(fit(BASE, campaign))
    assert verdict.finding is not None
    assert verdict.finding.effect == "floor_motion"
    assert verdict.finding.indistinguishable in ((), ("floor_motion",))
    place = verdict.refit.names.index("floor_motion.transmission")
    error = float(verdict.refit.uncertainty.standard_error[place])
    assert abs(float(verdict.refit.model["floor_motion.transmission"]) - 0.7) < 4.0 * error
    assert error < 0.02


def test_a_floor_that_moves_nothing_is_not_named(simulated):
    campaign = simulated(PLANT.plus(rig.FloorMotion(0.0, 0.02)), PLAN, seed=4)
    verdict = diagnose(fit(BASE, campaign))
    assert verdict.verdict == "none"
    assert verdict.bounds["floor_motion"][0] < 0.05


def test_effects_are_meaningless_where_a_signal_is_missing_that_they_follow(simulated):
    campaign = simulated(PLANT.plus(rig.FloorMotion(0.7, 0.02)), PLAN)
    records = campaign.records
    unstated = {name for name, kind in CATALOGUE.items() if {"pressure", "temperature"} & {*kind.channels}}

    def lacking(*records):
        return set(effects_without_signal(records)) - unstated

    assert set(effects_without_signal(records)) == unstated
    bare = dataclasses.replace(records[0], floor=None)
    slow = dataclasses.replace(records[0], rate=110.0)
    random = dataclasses.replace(records[0], kind="broadband")
    assert lacking(records[0], bare) == {"floor_motion"}
    assert lacking(slow) == {"mains_hum"}
    assert lacking(records[1], random) == {"drive_harmonics"}
    assert carries(slow, "hum_50")
    assert not carries(slow, "hum_60")
    with pytest.raises(ValueError, match="must hold the motion of the floor"):
        channel_table("floor", bare, "band_limited", 1, 0.0)


def test_the_floor_is_followed_between_its_samples_and_is_not_delayed_with_the_drive():
    rate = 250.0
    time = np.arange(1000) / rate
    wave = np.sin(2 * np.pi * 13.0 * time)
    (record,) = rig.run(PLANT, rig.FreeDecay((1e-3,), 4.0), 1, rig.Bench(rate=rate))
    held = Record(
        "one",
        Path("one.npz"),
        time,
        rate,
        record.force,
        record.output,
        record.force,
        record.output,
        floor=wave,
    )
    table = channel_table("floor", held, "zero_order", 2, 0.01)
    stages = time[:, None] + np.arange(5) / (4 * rate)
    inside = slice(100, -100)
    np.testing.assert_allclose(table[inside], np.sin(2 * np.pi * 13.0 * stages)[inside], atol=1e-3)


def test_at_zero_share_the_floor_changes_nothing(simulated):
    campaign = simulated(PLANT.plus(rig.FloorMotion(0.5, 0.02)), PLAN)
    with_floor = fit(BASE.with_elements(FloorMotion(0.4)), campaign)
    assert float(with_floor.model["floor_motion.transmission"]) == pytest.approx(0.5, abs=0.02)
    assert with_floor.errors["fit"].chi2_per_dof < 1.05
