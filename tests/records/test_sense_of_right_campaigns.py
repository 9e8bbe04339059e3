"""Right campaigns are never stopped: measured ones, and random ones with everything that they may hide."""

import dataclasses
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
import measured
from _trial_campaign import generator, sketch
from _trial_effects import EFFECTS, Motion
from isojax import read_campaign, rig
from isojax.demo import campaign_folder
from isojax.records import find_suspicions

COUPLED = """
[campaign]
mass = 800.0
[input]
quantity = "force"
column = "force_{axis}"
unit = "N"
[output]
quantity = "acceleration"
column = "acceleration_{axis}"
unit = "m/s^2"
[sampling]
rate = 500.0
[[record]]
file = "{data}/examples/coupled/{name}.npz"
schedule = "{data}/examples/coupled/{name}_schedule.csv"
role = "fit"
"""


@pytest.mark.parametrize(
    "text",
    [
        measured.EMPS.replace("{settle}", "0"),
        measured.EMPS.replace("{settle}", "0").replace("mass_free = true", ""),
        measured.SILVERBOX,
        measured.BOUC_WEN,
        COUPLED.replace("{axis}", "y").replace("{name}", "y100"),
        COUPLED.replace("{axis}", "z").replace("{name}", "z240"),
    ],
    ids=["emps", "emps mass declared", "silverbox", "boucwen", "coupled y", "coupled z"],
)
def test_what_others_measured_passes(shared_data, tmp_path, text):
    (tmp_path / "campaign.toml").write_text(text.format(data=shared_data.as_posix()), encoding="utf-8")
    assert find_suspicions(read_campaign(tmp_path)) == ()


@pytest.mark.parametrize("name", ["quiet", "friction", "relaxation", "asymmetry"])
def test_the_example_campaigns_pass(shared_data, name):
    assert find_suspicions(read_campaign(shared_data / "examples" / name)) == ()


def test_the_demo_passes():
    assert find_suspicions(read_campaign(campaign_folder())) == ()


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "name"), list(enumerate([None, *sorted(EFFECTS)], start=100)))
def test_no_hidden_effect_is_taken_for_a_mistake(tmp_path, seed, name):
    drawn = sketch(seed, "one", ())
    bench = dataclasses.replace(drawn.bench, tolerance=1e-6, anti_alias=False)
    plant = drawn.plant
    if name is not None:
        motion = Motion(min(drawn.levels), 2.5e-4, 0.25, 32.0, drawn.base[0], drawn.base[3])
        effect = EFFECTS[name]
        size = effect.most(motion) if effect.fixed is None else effect.fixed
        plant = plant.plus(effect.law(size, effect.shape(generator(seed, "shape", name), motion)))
    # Two of its records: friction with memory takes the rig long.
    rig.write_campaign(tmp_path, plant, drawn.fitted_plans[:2], seed, "right", bench)
    found = find_suspicions(read_campaign(tmp_path))
    assert not any(one.contradicts for one in found)
    assert {one.check for one in found} <= ({"flat tops"} if name == "clipping" else set())


def test_light_damping_that_gives_power_back_at_the_ends_of_short_dwells_is_a_doubt(tmp_path):
    """The dwells ring on: at their ends the drive may take out what it fed in before."""
    frequencies = (4.23, 4.85, 5.44, 6.3, 6.44, 6.48, 7.05, 7.07, 7.55, 8.99)
    plant = rig.Plant((rig.LinearStiffness(1e6), rig.CubicStiffness(1.8e10), rig.LinearDamping(640.0)))
    plan = rig.SteppedSine((44.9, 50.2), frequencies, 8, ("forward",))
    bench = rig.Bench(noise=1e-4, drift=0.0, rate=250.0)
    plans = tuple(rig.AtPressure(plan, pressure) for pressure in (2e5, 2.3e5, 1.75e5))
    path = rig.write_campaign(tmp_path / "short", plant, plans, 113, "short dwells", bench)
    found = find_suspicions(read_campaign(path))
    assert [one.check for one in found] == ["power"]
    assert not found[0].contradicts
    assert "No single mistake explains it" in str(found[0])
