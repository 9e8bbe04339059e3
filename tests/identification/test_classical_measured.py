"""The start of a fit is near the truth on simulated examples and on measured benchmarks."""

import dataclasses
import functools
import json

import numpy as np
import pytest

from isojax import read_campaign
from isojax.excitations import Sampled
from isojax.identification.guess._classical_guess import classical_guess
from isojax.identification.guess._paper_table import paper_table
from isojax.models import simulate
from isojax.records import dwell_harmonics

NAMES = [
    "linear_stiffness.coefficient",
    "abs_quadratic_stiffness.coefficient",
    "cubic_stiffness.coefficient",
    "linear_damping.coefficient",
    "abs_quadratic_damping.coefficient",
    "cubic_damping.coefficient",
]


@functools.cache
def _example(folder):
    """Campaign, start and true coefficients of an example; measured once, used by several tests."""
    campaign = read_campaign(folder)
    return (
        campaign,
        classical_guess(campaign),
        np.array(json.loads((folder / "truth.json").read_text())["base"]),
    )


@pytest.mark.parametrize("example", ["quiet", "friction", "relaxation", "asymmetry"])
def test_the_start_is_near_the_truth_of_each_example(shared_data, example):
    _, guess, truth = _example(shared_data / "examples" / example)
    found = np.array([float(guess.model[name]) for name in NAMES])
    # What hides in the data adds its own stiffness and damping: 6 N of friction are 15 % of c1.
    np.testing.assert_allclose(found[:3], truth[:3], rtol=0.03)
    assert found[3] == pytest.approx(truth[3], rel=0.2)
    assert guess.unexplained < 0.05


@pytest.mark.parametrize("example", ["quiet", "friction", "relaxation", "asymmetry"])
def test_the_papers_own_route_is_kept_beside_it_with_its_bias(shared_data, example):
    _, guess, truth = _example(shared_data / "examples" / example)
    paper = guess.paper_model
    assert paper is not None
    assert float(paper[NAMES[0]]) == pytest.approx(truth[0], rel=0.1)
    assert float(paper[NAMES[3]]) == pytest.approx(truth[3], rel=0.25)
    for name in NAMES:
        assert guess.bias[name] == pytest.approx(float(paper[name]) / float(guess.model[name]) - 1)
    assert any("exactly" in note for note in guess.notes)


def test_phase_resonance_and_circle_fit_take_the_bias_out_of_the_papers_stiffness(shared_data):
    _, guess, truth = _example(shared_data / "examples" / "quiet")
    errors = {}
    for resonance, damping in (("peak", "half_power"), ("phase", "circle")):
        model = paper_table(guess.responses, 800.0, damping, resonance).model
        assert model is not None
        errors[resonance] = np.abs(np.array([float(model[name]) for name in NAMES]) / truth - 1)
    assert np.all(errors["phase"][:3] < 0.03)
    assert np.all(errors["phase"][:3] < errors["peak"][:3])
    assert errors["phase"][4] < errors["peak"][4]


def test_a_jump_inside_the_half_power_interval_is_said(shared_data):
    _, guess, _ = _example(shared_data / "examples" / "quiet")
    (said,) = (note for note in guess.notes if "jump" in note)
    assert "180N" in said
    assert "60N" not in said


def test_two_levels_allow_a_straight_line_and_say_so(shared_data):
    _, guess, _ = _example(shared_data / "examples" / "quiet")
    table = paper_table(tuple(one for one in guess.responses if one.level in (60.0, 120.0)), 800.0)
    assert table.stiffness is not None
    assert table.stiffness.law[2] == 0.0
    assert any("straight line" in note for note in table.notes)


def test_the_start_reproduces_the_measured_harmonics(shared_data):
    campaign, guess, _ = _example(shared_data / "examples" / "quiet")
    record = next(one for one in campaign.holdout_records if one.direction == "forward")
    found = simulate(
        guess.model,
        Sampled(record.input, record.rate),
        duration=(record.time.size - 1) / record.rate,
        rate=record.rate,
    )
    predicted = dataclasses.replace(record, output=np.asarray(found.reading))
    for dwell in record.dwells:
        measured = dwell_harmonics(record, dwell).output[1]
        assert abs(dwell_harmonics(predicted, dwell).output[1] - measured) < 0.05 * abs(measured)


def _toml(tmp_path, data, **sections):
    """Write a campaign around one measured file."""
    lines = []
    for name, entries in sections.items():
        lines.append(f"[[{name}]]" if name == "record" else f"[{name}]")
        lines.extend(f"{key} = {json.dumps(value)}" for key, value in entries.items())
    lines.append(f"file = {json.dumps(str(data))}")
    (tmp_path / "campaign.toml").write_text("\n".join(lines))
    return read_campaign(tmp_path)


def test_emps_starts_near_its_published_mass_and_viscous_friction(shared_data, tmp_path):
    def start(damping):
        campaign = _toml(
            tmp_path,
            shared_data / "emps" / "DATA_EMPS.mat",
            campaign={"title": "EMPS", "mass": 50.0, "mass_free": True},
            input={"quantity": "force", "column": "vir", "unit": "V", "gain": 35.15065, "offset_free": True},
            output={"quantity": "displacement", "column": "qm", "unit": "m"},
            sampling={"rate": 1000.0},
            model={"stiffness": [], "damping": damping},
            record={"role": "fit"},
        )
        return classical_guess(campaign).model

    # Janot, Gautier & Brunot 2019: M 95.11 kg, Fv 203.5, Fc 20.39, offset -3.16 on the other side.
    dry = start(["linear", "coulomb_friction"])
    assert float(dry.mass) == pytest.approx(95.11, rel=0.03)
    assert float(dry["linear_damping.coefficient"]) == pytest.approx(203.5, rel=0.1)
    assert float(dry["coulomb_friction.force_level"]) == pytest.approx(20.39, rel=0.1)
    assert float(dry["input_offset.offset"]) == pytest.approx(3.16, rel=0.1)
    # Without the dry friction the viscous one stands for both; the mass is what it was.
    viscous = start(["linear"])
    assert float(viscous.mass) == pytest.approx(95.11, rel=0.03)
    assert float(viscous["linear_damping.coefficient"]) > 203.5


@pytest.mark.parametrize("gain", [1.86e5, 1.3 * 1.86e5])
def test_silverbox_starts_near_its_known_coefficients_whatever_the_gain(shared_data, tmp_path, gain):
    campaign = _toml(
        tmp_path,
        shared_data / "silverbox" / "SNLS80mV_multisine.mat",
        campaign={"title": "Silverbox", "mass": 1.0},
        input={
            "quantity": "command",
            "column": "V1",
            "unit": "V",
            "gain": gain,
            "gain_free": True,
            "offset_free": True,
        },
        output={"quantity": "displacement", "column": "V2", "unit": "V", "offset_free": True},
        sampling={"rate": 610.3515625},
        model={"stiffness": ["linear", "cubic"], "damping": ["linear"]},
        record={"role": "fit", "stop": 65062},
    )
    model = classical_guess(campaign).model
    assert gain * (1 + float(model["input_gain.deviation"])) == pytest.approx(1.86e5, rel=0.01)
    assert float(model["linear_stiffness.coefficient"]) == pytest.approx(1.843e5, rel=0.01)
    assert float(model["linear_damping.coefficient"]) == pytest.approx(41.9, rel=0.02)
    assert float(model["cubic_stiffness.coefficient"]) == pytest.approx(7.28e5, rel=0.05)


def test_bouc_wen_starts_near_its_best_linear_stiffness(shared_data, tmp_path):
    campaign = _toml(
        tmp_path,
        shared_data / "boucwen" / "boucwen_train.npz",
        campaign={"title": "Bouc-Wen", "mass": 2.0},
        input={"quantity": "force", "column": "u", "unit": "N"},
        output={"quantity": "displacement", "column": "y", "unit": "m"},
        sampling={"rate": 750.0},
        model={"stiffness": ["linear", "cubic"], "damping": ["linear"]},
        record={"role": "fit", "period": 8192},
    )
    guess = classical_guess(campaign)
    # The linear model of least output error, found in the frequency domain: 1.24e5 N/m, 88 N s/m.
    assert float(guess.model["linear_stiffness.coefficient"]) == pytest.approx(1.24e5, rel=0.15)
    assert float(guess.model["linear_damping.coefficient"]) == pytest.approx(88.0, rel=0.15)
    (linear,) = guess.linear
    assert linear.circle.natural_frequency == pytest.approx(np.sqrt(1.24e5 / 2) / (2 * np.pi), rel=0.05)
