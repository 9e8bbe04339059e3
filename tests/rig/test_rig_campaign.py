"""Campaigns on disk: their form, their truth, and the one in the package."""

import csv
import json
import tomllib
from pathlib import Path

import numpy as np
import pytest

from isojax import rig
from isojax.demo import campaign_folder
from isojax.rig.demo_campaign import write_demo_campaign

PLANT = rig.y_plant().plus(rig.CoulombFriction(4.0))
PLAN = rig.SteppedSine((60.0, 90.0), (5.0, 6.0), 5, holdout_levels=(75.0,))


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_campaign_has_the_documented_form(tmp_path):
    path = rig.write_campaign(tmp_path / "new" / "folder", PLANT, PLAN, 3, 'a "quoted" title')
    campaign = tomllib.loads(path.read_text())
    assert path.name == "campaign.toml"
    assert campaign["campaign"] == {"title": 'a "quoted" title', "mass": 800.0}
    assert campaign["input"] == {"quantity": "force", "column": "force", "unit": "N"}
    assert campaign["output"] == {"quantity": "acceleration", "column": "acceleration", "unit": "m/s^2"}
    assert campaign["sampling"] == {"rate": 1000.0}
    laws = ["linear", "abs_quadratic", "cubic"]
    assert campaign["model"] == {"stiffness": laws, "damping": laws}
    assert len(campaign["record"]) == 6
    assert campaign["record"][1] == {
        "file": "fit_60N_backward_0.npz",
        "schedule": "fit_60N_backward_0_schedule.csv",
        "level": 60.0,
        "direction": "backward",
        "repeat": 0,
        "role": "fit",
    }
    assert [record["role"] for record in campaign["record"]] == ["fit"] * 4 + ["holdout"] * 2
    for record in campaign["record"]:
        with np.load(path.parent / record["file"]) as columns:
            assert set(columns) == {"force", "acceleration"}
            assert columns["force"].dtype == columns["acceleration"].dtype == np.float32
            assert columns["force"].shape == columns["acceleration"].shape == (1833,)
    with open(path.parent / "fit_60N_backward_0_schedule.csv", newline="") as file:
        assert list(csv.reader(file)) == [
            ["start_s", "frequency_hz", "cycles"],
            ["0.000000", "6.000000", "5.000000"],
            ["0.833333", "5.000000", "5.000000"],
        ]
    assert not list(path.parent.glob("*.part"))


def test_truth_names_what_is_hidden(tmp_path):
    rig.write_campaign(tmp_path, PLANT, rig.Impulse((100.0,), seconds=0.2), 3, "truth")
    assert json.loads((tmp_path / "truth.json").read_text()) == {
        "effect": "coulomb_friction",
        "spec": {"kind": "coulomb_friction", "q": [4.0]},
        "base": [1.0805e6, -6.974e8, 2.51667e11, 1.027e4, -3.6880e5, 5.3753e6],
        "noise": 0.01,
        "drift": 0.0005,
    }
    bench = rig.Bench()
    assert rig.truth(rig.z_plant(), bench)["effect"] == "none"
    assert rig.truth(rig.z_plant(), bench)["spec"] == {}
    two = rig.truth(PLANT.plus(rig.InputDelay(1e-3)), bench)
    assert two["effect"] == "coulomb_friction+input_delay"
    assert two["spec"]["parts"][1] == {"kind": "input_delay", "q": [1e-3]}


def test_same_seed_writes_the_same_bytes(tmp_path):
    for folder in ("one", "two"):
        rig.write_campaign(tmp_path / folder, PLANT, PLAN, 3, "twice")
    assert contents(tmp_path / "one") == contents(tmp_path / "two")


def test_csv_holds_what_npz_holds(tmp_path):
    bench = rig.Bench(output="displacement", noise=1e-6, rate=200.0)
    plan = (rig.Multisine((30.0,), 2.0, 8.0, 2.0, 2), rig.FreeDecay((1e-3,), 1.0))
    for file_format in ("npz", "csv"):
        rig.write_campaign(tmp_path / file_format, PLANT, plan, 3, "forms", bench, file_format)
    campaign = tomllib.loads((tmp_path / "csv" / "campaign.toml").read_text())
    multisine, decay = campaign["record"]
    assert (multisine["period"], multisine["settle"]) == (400, 400)
    assert (decay["file"], decay["direction"]) == ("fit_1mm_decay_0.csv", "none")
    assert campaign["output"]["unit"] == "m"
    table = np.genfromtxt(tmp_path / "csv" / multisine["file"], delimiter=",", names=True)
    with np.load(tmp_path / "npz" / "fit_30N_multisine_0.npz") as columns:
        for name in ("force", "displacement"):
            np.testing.assert_array_equal(table[name].astype(np.float32), columns[name])


@pytest.mark.slow
def test_demo_in_the_package_is_the_one_that_its_script_writes(tmp_path):
    write_demo_campaign(tmp_path)
    packaged = campaign_folder()
    assert {path.name for path in packaged.iterdir()} == {path.name for path in tmp_path.iterdir()}
    assert sum(path.stat().st_size for path in packaged.iterdir()) < 2_000_000
    for path in tmp_path.iterdir():
        if path.suffix != ".npz":
            assert path.read_text() == (packaged / path.name).read_text()
            continue
        with np.load(path) as new, np.load(packaged / path.name) as old:
            for name, tolerance in (("force", 1e-3), ("acceleration", 1e-5)):
                np.testing.assert_allclose(new[name], old[name], rtol=0, atol=tolerance)


EFFECTS = {
    "friction": rig.CoulombFriction,
    "relaxation": rig.MaxwellBranch,
    "asymmetry": rig.QuadraticStiffness,
}


@pytest.mark.parametrize("name", EFFECTS)
def test_another_simulator_saw_the_same_motion(shared_data, name):
    """Lowest level of the example campaigns: only their noise remains (and, in two, a little drift)."""
    folder = shared_data / "examples" / name
    true = json.loads((folder / "truth.json").read_text())
    plant = rig.Plant(rig.base_laws(*true["base"])).plus(EFFECTS[name](*true["spec"]["q"]))
    plan = rig.SteppedSine((60.0,), tuple((np.arange(40, 71, 2) / 10).tolist()), directions=("forward",))
    (record,) = rig.run(plant, plan, 1, rig.Bench(noise=0.0, force_noise=0.0, drift=0.0))
    with np.load(folder / f"{record.name}.npz") as columns:
        measured = columns["acceleration"].astype(float)
        force = columns["force"].astype(float)
    count = measured.size
    assert abs(np.std(measured - record.output[:count]) / true["noise"] - 1) < 0.02
    assert np.std(force - record.force[:count]) < 0.03
