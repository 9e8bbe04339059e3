"""Dwells of the simulated bench against the paper's table of folds and the linear closed form."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

import isojax as ij
from isojax import rig
from isojax.health import dwell_stability
from isojax.records import Campaign, Dwell, InputChannel, OutputChannel, Record

MASS, STIFFNESS, DAMPING = 800.0, 1e6, 1e4
LINEAR = ij.Isolator(MASS, (ij.LinearStiffness(STIFFNESS), ij.LinearDamping(DAMPING)))
PLANT = rig.Plant((rig.LinearStiffness(STIFFNESS), rig.LinearDamping(DAMPING)))
BENCH = rig.Bench(
    rate=500.0,
    drift=0.0,
    noise=1e-3,
    force_noise=0.0,
    shaker=rig.IDEAL_SHAKER,
    anti_alias=False,
    tolerance=1e-7,
)
UPPER = {4.2: 178.12, 4.4: 150.66}
"""Frequency [Hz] to upper fold [N] of the paper's y-direction, found by others to 0.01 N."""


def as_record(one):
    edges = [round(start * one.rate) for start, _, _ in one.schedule] + [one.time.size]
    dwells = tuple(
        Dwell(edges[place], edges[place + 1], frequency, cycles)
        for place, (_, frequency, cycles) in enumerate(one.schedule)
    )
    signals = (one.time, one.rate, one.force, one.output, one.force, one.output)
    return Record(
        one.name,
        Path(one.name),
        *signals,
        level=one.level,
        direction=one.direction,
        dwells=dwells,
        kind="stepped_sine",
    )


def held(model, records, drive="force", output="acceleration"):
    channels = (InputChannel(drive, "u", "N"), OutputChannel(output, "y", "1"))
    parts = (None, records[0].rate, (), (), (), tuple(records))
    return dwell_stability(model, Campaign("bench", Path("bench"), MASS, False, *channels, *parts))


def measured(plant, level, frequencies, bench=BENCH, cycles=30):
    plan = rig.SteppedSine((level,), frequencies, cycles, directions=("forward",))
    return [as_record(one) for one in rig.run(plant, plan, 3, bench)]


@pytest.fixture(scope="module")
def linear():
    return measured(PLANT, 50.0, (3.0, 5.0, 7.0))


def test_radius_of_a_linear_isolator_is_the_closed_form_and_there_is_no_fold(linear):
    found = held(LINEAR, linear)
    assert [one.reason for one in found] == ["", "", ""]
    frequencies = np.array([one.dwell.frequency for one in found])
    expected = np.exp(-DAMPING / (2.0 * MASS * frequencies))
    np.testing.assert_allclose([one.spectral_radius for one in found], expected, atol=1e-5)
    np.testing.assert_allclose([one.amplitude for one in found], 50.0, rtol=1e-3)
    assert all(np.isinf(one.fold_amplitude) and np.isinf(one.fold_frequency) for one in found)


def test_what_the_sensor_measures_makes_no_difference(linear):
    for output in ("velocity", "displacement"):
        bench = dataclasses.replace(BENCH, output=output, noise=1e-7)
        found = held(LINEAR, measured(PLANT, 50.0, (5.0,), bench), output=output)
        assert found[0].spectral_radius == pytest.approx(np.exp(-DAMPING / (10.0 * MASS)), abs=1e-5)


def test_another_motion_than_the_measured_one_is_named_and_not_numbered(linear):
    stiff = ij.Isolator(MASS, (ij.LinearStiffness(1.5 * STIFFNESS), ij.LinearDamping(DAMPING)))
    found = held(stiff, linear)
    assert all("off" in one.reason for one in found)
    assert all(np.isnan([one.spectral_radius, one.fold_amplitude, one.fold_frequency]).all() for one in found)


def test_a_dwell_of_too_few_samples_is_named_beside_its_neighbours(linear):
    brief = dataclasses.replace(linear[0].dwells[1], stop=linear[0].dwells[1].start + 4)
    record = dataclasses.replace(linear[0], dwells=(linear[0].dwells[0], brief, linear[0].dwells[2]))
    found = held(LINEAR, [record])
    assert [bool(one.reason) for one in found] == [False, True, False]
    assert "few samples" in found[1].reason
    assert found[2].dwell.frequency == 7.0


def test_the_coordinate_of_a_driven_base_is_relative_to_it():
    frequency, rate, size = 5.0, 500.0, 2.0
    omega = 2.0 * np.pi * frequency
    time = np.arange(int(20 * rate / frequency)) / rate
    # m x'' + c x' + k x = -m a of the base; the accelerometer on the mass shows x'' + a.
    relative = -MASS * size / (STIFFNESS - MASS * omega**2 + 1j * omega * DAMPING)
    absolute = size - omega**2 * relative
    base, output = (np.real(c * np.exp(1j * (omega * time + 0.7))) for c in (size + 0j, absolute))
    dwells = (Dwell(0, time.size, frequency, 20.0),)
    record = Record(
        "base", Path("base"), time, rate, base, output, base, output, dwells=dwells, kind="stepped_sine"
    )
    based = ij.Isolator(MASS, LINEAR.elements, "base_acceleration")
    found = held(based, [record], drive="base_acceleration")
    assert found[0].reason == ""
    assert found[0].amplitude == pytest.approx(size)
    assert found[0].spectral_radius == pytest.approx(np.exp(-DAMPING / (10.0 * MASS)), abs=1e-5)


@pytest.mark.parametrize("below", [4.0, 12.0])
def test_small_motions_of_the_paper_are_as_far_from_their_fold_as_the_table_says(below):
    for frequency, upper in UPPER.items():
        records = measured(rig.y_plant(), upper - below, (3.6, frequency))
        found = held(ij.paper.y_direction(), records)[-1]
        assert found.reason == ""
        assert found.amplitude == pytest.approx(upper - below, rel=1e-3)
        assert found.fold_amplitude == pytest.approx(upper - found.amplitude, abs=0.03)
        assert found.nearness == pytest.approx(found.fold_amplitude / found.amplitude)


def test_records_without_dwells_have_none(linear):
    assert held(LINEAR, [dataclasses.replace(linear[0], dwells=())]) == ()
