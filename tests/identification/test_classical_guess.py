"""The start of a fit is exact on exact data, and what cannot be known is said."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from isojax.identification.guess._classical_guess import classical_guess
from isojax.identification.guess._declared_model import base_model
from isojax.identification.guess._scales import scales
from isojax.records import (
    Campaign,
    Dwell,
    InputChannel,
    OutputChannel,
    Record,
)

RATE = 1000.0
LAW = {"k1": 1.1e6, "k2": -7e8, "k3": 2.5e11, "c1": 1.05e4, "c2": -3.7e5, "c3": 5.2e6}
NAMES = [
    "linear_stiffness.coefficient",
    "abs_quadratic_stiffness.coefficient",
    "cubic_stiffness.coefficient",
    "linear_damping.coefficient",
    "abs_quadratic_damping.coefficient",
    "cubic_damping.coefficient",
]


def _force(x, v):
    springs = LAW["k1"] * x + LAW["k2"] * np.abs(x) * x + LAW["k3"] * x**3
    return springs + LAW["c1"] * v + LAW["c2"] * np.abs(v) * v + LAW["c3"] * v**3


def _campaign(records, **changes):
    """A campaign of the paper's form around given records; a change names a field of it or of a channel."""
    drive = InputChannel("force", "F", "N")
    output = OutputChannel("acceleration", "a", "m/s^2")
    fields = {
        "title": "exact",
        "file": Path("exact/campaign.toml"),
        "mass": 800.0,
        "mass_free": False,
        "input": dataclasses.replace(drive, **changes.pop("input", {})),
        "output": dataclasses.replace(output, **changes.pop("output", {})),
        "filter": None,
        "rate": RATE,
        "stiffness": ("linear", "abs_quadratic", "cubic"),
        "damping": ("linear", "abs_quadratic", "cubic"),
        "elements": (),
        "records": tuple(records),
    }
    return Campaign(**{**fields, **changes})


def _record(name, drive, output, **changes):
    time = np.arange(drive.size) / RATE
    return Record(name, Path(f"{name}.npz"), time, RATE, drive, output, drive, output, **changes)


def _dwelt(amplitudes, based=False, law=_force):
    """Exact stepped sine: the motion is given, the force is what the law needs for it."""
    records, size = [], 2000
    for level, amplitude in enumerate(amplitudes):
        time = np.arange(size) / RATE
        parts, dwells = [], []
        for place, frequency in enumerate(np.arange(4.0, 7.01, 0.5)):
            omega = 2 * np.pi * frequency
            x, v, a = (amplitude * omega**n * np.sin(omega * time + n * np.pi / 2) for n in range(3))
            needed = 800.0 * a + law(x, v)
            parts.append(np.stack([-needed / 800.0, a - needed / 800.0] if based else [needed, a]))
            dwells.append(Dwell(place * size, (place + 1) * size, float(frequency), 2.0 * frequency))
        drive, output = np.concatenate(parts, axis=1)
        records.append(
            _record(
                f"level{level}",
                drive,
                output,
                level=float(level),
                direction=("forward", "backward")[level % 2],
                dwells=tuple(dwells),
                kind="stepped_sine",
            )
        )
    return records


def _multisine(size=20000):
    """Exact motion in many lines, 2-12 Hz: displacement, velocity, acceleration."""
    rng = np.random.default_rng(7)
    time = np.arange(size) / RATE
    state = np.zeros((3, size))
    for frequency in np.arange(2.0, 12.0, 0.25):
        omega, phase = 2 * np.pi * frequency, rng.uniform(0, 2 * np.pi)
        for n in range(3):
            state[n] += 1.2e-4 * omega**n * np.sin(omega * time + phase + n * np.pi / 2)
    return state


def test_all_dwells_recover_the_law_from_exact_data():
    guess = classical_guess(_campaign(_dwelt([2e-4, 5e-4, 9e-4, 1.3e-3])))
    assert guess.route == "all_dwells"
    found = [float(guess.model[name]) for name in NAMES]
    np.testing.assert_allclose(found, list(LAW.values()), rtol=1e-5)
    assert guess.unexplained < 1e-3


def test_base_excitation_recovers_the_same_law():
    campaign = _campaign(
        _dwelt([2e-4, 5e-4, 9e-4, 1.3e-3], based=True),
        input={"quantity": "base_acceleration", "column": "ab", "unit": "m/s^2"},
    )
    guess = classical_guess(campaign)
    assert guess.model.excitation == "base_acceleration"
    found = [float(guess.model[name]) for name in NAMES]
    np.testing.assert_allclose(found, list(LAW.values()), rtol=1e-5)


def test_a_free_mass_and_a_free_gain_are_found():
    records = _dwelt([2e-4, 5e-4, 9e-4, 1.3e-3])
    heavy = classical_guess(_campaign(records, mass=500.0, mass_free=True))
    assert float(heavy.model.mass) == pytest.approx(800.0, rel=1e-5)
    loud = [dataclasses.replace(record, input=record.input / 1.3) for record in records]
    gained = classical_guess(_campaign(loud, input={"gain_free": True}))
    assert float(gained.model["input_gain.deviation"]) == pytest.approx(0.3, rel=1e-4)
    assert float(gained.model["linear_stiffness.coefficient"]) == pytest.approx(LAW["k1"], rel=1e-5)


def test_a_free_mass_beside_a_free_gain_stays_and_is_said():
    guess = classical_guess(_campaign(_dwelt([2e-4, 9e-4]), mass_free=True, input={"gain_free": True}))
    assert float(guess.model.mass) == 800.0
    assert any("gain" in note for note in guess.notes)


def test_laws_that_are_not_declared_stay_out_and_further_elements_start_absent():
    campaign = _campaign(
        _dwelt([2e-4, 9e-4]),
        stiffness=("linear",),
        damping=("linear",),
        elements=("coulomb_friction", "maxwell_branch"),
    )
    model = classical_guess(campaign).model
    names = [element.name for element in model.elements]
    assert names == ["linear_stiffness", "linear_damping", "coulomb_friction", "maxwell_branch"]
    assert float(model["coulomb_friction.force_level"]) == 0.0
    assert float(model["maxwell_branch.stiffness"]) == 0.0


def test_a_start_that_is_no_spring_loses_its_steepest_term():
    def softening(x, v):
        return LAW["k1"] * x - 4e11 * x**3 + LAW["c1"] * v

    campaign = _campaign(
        _dwelt([4e-4, 1.3e-3], law=softening), stiffness=("linear", "cubic"), damping=("linear",)
    )
    guess = classical_guess(campaign)
    assert float(guess.model["cubic_stiffness.coefficient"]) == 0.0
    assert float(guess.model["linear_stiffness.coefficient"]) > 0.0
    assert any("cubic_stiffness" in note for note in guess.notes)


def test_the_force_balance_in_time_recovers_the_law_from_exact_data():
    x, v, a = _multisine()
    force = 800.0 * a + _force(x, v)
    displaced = _campaign([_record("r", force, x)], output={"quantity": "displacement", "unit": "m"})
    accelerated = _campaign([_record("r", force, a)])
    for campaign, tolerance in ((displaced, 0.002), (accelerated, 0.02)):
        guess = classical_guess(campaign)
        assert guess.route == "restoring_force"
        assert guess.table is None
        found = [float(guess.model[name]) for name in NAMES]
        np.testing.assert_allclose(found, list(LAW.values()), rtol=tolerance)


def test_offsets_of_both_channels_start_near_the_truth():
    x, v, a = _multisine()
    force = 800.0 * a + _force(x, v)
    sensed = _campaign([_record("r", force, a + 0.05)], output={"offset_free": True})
    assert float(classical_guess(sensed).model["sensor_offset.offset"]) == pytest.approx(0.05, abs=2e-3)
    driven = _campaign(
        [_record("r", force - 20.0, x)],
        input={"offset_free": True},
        output={"quantity": "displacement", "unit": "m"},
    )
    assert float(classical_guess(driven).model["input_offset.offset"]) == pytest.approx(20.0, rel=0.02)


@pytest.mark.parametrize(("quantity", "order"), [("displacement", 0), ("velocity", 1), ("acceleration", 2)])
def test_a_free_decay_gives_the_law_and_its_decrement(quantity, order):
    time = np.arange(20000) / RATE
    ratio, omega = 0.02, 2 * np.pi * 5.5
    pole = complex(-ratio, np.sqrt(1 - ratio**2)) * omega
    measured = (1e-3 * pole**order * np.exp(pole * time)).real
    campaign = _campaign(
        [_record("decay", np.zeros_like(measured), measured, kind="free_decay")],
        output={"quantity": quantity},
        stiffness=("linear",),
        damping=("linear",),
    )
    guess = classical_guess(campaign)
    assert guess.decrements["decay"].damping_ratio == pytest.approx(ratio, rel=0.01)
    assert float(guess.model["linear_stiffness.coefficient"]) == pytest.approx(800 * omega**2, rel=0.01)
    assert float(guess.model["linear_damping.coefficient"]) == pytest.approx(1600 * ratio * omega, rel=0.05)


def test_the_base_model_is_the_declared_structure_without_any_effect():
    campaign = _campaign(
        _dwelt([2e-4]), input={"gain_free": True, "offset_free": True}, output={"offset_free": True}
    )
    model = base_model(campaign)
    assert float(model.mass) == 800.0
    assert [element.name for element in model.elements][-3:] == [
        "input_gain",
        "input_offset",
        "sensor_offset",
    ]
    assert all(float(getattr(element, element.strength)) == 0.0 for element in model.elements)


@pytest.mark.parametrize(
    ("field", "found", "nearest"),
    [
        ("stiffness", "cubik", "cubic"),
        ("damping", "liner", "linear"),
        ("elements", "coulom", "coulomb_friction"),
    ],
)
def test_an_unknown_name_is_refused_with_the_nearest_right_one(field, found, nearest):
    campaign = _campaign(_dwelt([2e-4]), **{field: (found,)})
    with pytest.raises(ValueError, match=rf"model\.{field}.*campaign\.toml.*{found}.*nearest: '{nearest}'"):
        base_model(campaign)


def test_scales_are_amplitudes_of_the_strongest_record():
    found = scales(_campaign(_dwelt([2e-4, 1e-3])))
    assert found.displacement == pytest.approx(1e-3, rel=0.05)
    assert found.angular_frequency == pytest.approx(2 * np.pi * 5.5, rel=0.01)
    assert found.slowest_velocity == pytest.approx(2e-4 * 2 * np.pi * 4.0, rel=0.02)
    assert found.sample_time == 1 / RATE


def test_a_campaign_without_a_record_to_fit_is_refused():
    held = [dataclasses.replace(record, role="holdout") for record in _dwelt([2e-4])]
    with pytest.raises(ValueError, match='role "fit"'):
        classical_guess(_campaign(held))
