"""What each record has of its own: motion of the floor, drift, hum, harmonics and holds of the drive."""

import tomllib

import numpy as np
import pytest
from scipy import signal
from scipy.integrate import solve_ivp

from isojax import read_campaign, rig

MASS, K, C = 800.0, 1.0805e6, 1.027e4
LINEAR = rig.Plant((rig.LinearStiffness(K), rig.LinearDamping(C)), MASS)
CUBIC = rig.Plant((rig.LinearStiffness(K), rig.CubicStiffness(2.5e11), rig.LinearDamping(C)), MASS)
SECONDS = 2.0
TIMES = np.arange(0.0, SECONDS, 2e-3)
SINE = rig.Tones(0.0, SECONDS, 0.0, (150.0,), (29.0,), (0.3,))
EXACT = rig.Bench(rate=250.0, noise=0.0, force_noise=0.0, drift=0.0, anti_alias=False)


def sine(t):
    return 150.0 * np.sin(29.0 * t + 0.3)


def placed(effect, begin=0.0, end=1.0, seed=4):
    return effect.placed(rig.Stretch(begin, end, SECONDS), np.random.default_rng(seed))


def solve(field, start):
    return solve_ivp(field, (0.0, SECONDS), start, "DOP853", TIMES, rtol=1e-11, atol=1e-14).y


def floor_path(floor):
    """Displacement and velocity of the floor: the integrals of its tones, written out."""
    tones = [(floor.transmission * a, w, p) for a, w, p in floor.tones()]

    def displacement(t):
        return sum(-a / w**2 * np.cos(w * t + p) for a, w, p in tones)

    def velocity(t):
        return sum(a / w * np.sin(w * t + p) for a, w, p in tones)

    return displacement, velocity


def test_a_plant_on_a_moving_floor_is_one_whose_spring_and_damper_end_at_the_floor():
    floor = placed(rig.FloorMotion(0.8, 0.3))
    xb, vb = floor_path(floor)

    def spring(t, x, v):
        stretch = x - xb(t)
        return K * stretch + 2.5e11 * stretch**3 + C * (v - vb(t))

    def field(t, y):
        return y[1], (sine(t) - spring(t, *y)) / MASS

    x, v = solve(field, [xb(0.0), vb(0.0)])
    motion = rig.response(CUBIC.plus(floor), [SINE], TIMES)
    stretch, acceleration = x - xb(TIMES), (sine(TIMES) - spring(TIMES, x, v)) / MASS
    assert np.std(motion["displacement"] - stretch) < 1e-7 * np.std(stretch)
    assert np.std(motion["velocity"] - v + vb(TIMES)) < 1e-7 * np.std(v)
    assert np.std(motion["acceleration"] - acceleration) < 1e-7 * np.std(acceleration)


def test_a_mass_that_the_plant_carries_feels_the_floor():
    floor = placed(rig.FloorMotion(1.0, 0.3))
    xb, vb = floor_path(floor)
    small, k2 = 40.0, 40.0 * (2 * np.pi * 9.0) ** 2
    c2 = 2 * 0.05 * np.sqrt(k2 * small)

    def field(t, y):
        x, v, other, speed = y
        hung = k2 * (x - other) + c2 * (v - speed)
        return v, (sine(t) - K * (x - xb(t)) - C * (v - vb(t)) - hung) / MASS, speed, hung / small

    start = [xb(0.0), vb(0.0), xb(0.0), vb(0.0)]
    y = solve(field, start)
    acceleration = np.array([field(t, state)[1] for t, state in zip(TIMES, y.T, strict=True)])
    motion = rig.response(LINEAR.plus(rig.SecondMode(small, 9.0, 0.05), floor), [SINE], TIMES)
    assert np.std(motion["acceleration"] - acceleration) < 1e-7 * np.std(acceleration)


def test_friction_that_holds_carries_the_plant_with_the_floor():
    floor = placed(rig.FloorMotion(1.0, 0.01))
    motion = rig.response(LINEAR.plus(rig.CoulombFriction(100.0), floor), [rig.Tones(0.0, SECONDS)], TIMES)
    np.testing.assert_array_equal(motion["displacement"], 0.0)
    np.testing.assert_array_equal(motion["acceleration"], floor.floor(TIMES))


def test_the_level_of_the_floor_is_its_rms_and_lies_in_its_band():
    floor = rig.FloorMotion(0.5, 0.3, 2.0, 15.0).placed(rig.Stretch(0.0, 1.0, 60.0), np.random.default_rng(2))
    shown = floor.floor_sensor(np.arange(0, 60.0, 0.005))
    assert np.std(shown) == pytest.approx(0.3, rel=0.02)
    frequency, power = signal.periodogram(shown, 200.0, "blackmanharris")
    assert np.sum(power[(frequency > 1.8) & (frequency < 15.2)]) > 0.9999 * np.sum(power)
    np.testing.assert_allclose(floor.floor(TIMES), 0.5 * floor.floor_sensor(TIMES))


def test_a_campaign_holds_the_floor_where_it_is_measured(tmp_path):
    plan = rig.SteppedSine((60.0,), (5.0, 6.0), 8)
    bench = rig.Bench(rate=250.0)
    for name, measured in (("with", True), ("without", False)):
        plant = LINEAR.plus(rig.FloorMotion(1.0, 0.05, measured=measured))
        path = rig.write_campaign(tmp_path / name, plant, plan, 3, name, bench)
        assert ("floor" in tomllib.loads(path.read_text())) is measured
    seen, unseen = (read_campaign(tmp_path / name) for name in ("with", "without"))
    assert [record.floor is None for record in seen.records] == [False, False]
    assert all(np.std(record.floor) == pytest.approx(0.05, rel=0.3) for record in seen.records)
    assert not np.allclose(seen.records[0].floor, seen.records[1].floor)
    assert [record.floor for record in unseen.records] == [None, None]
    np.testing.assert_array_equal(seen.records[0].output, unseen.records[0].output)


def test_a_spring_that_drifts_is_a_spring_that_depends_on_time():
    drift = placed(rig.StiffnessDrift(4e5), 0.25, 0.75)

    def field(t, y):
        stiffness = K + 4e5 * (0.25 + 0.5 * t / SECONDS)
        return y[1], (sine(t) - stiffness * y[0] - C * y[1]) / MASS

    x = solve(field, [0.0, 0.0])[0]
    motion = rig.response(LINEAR.plus(drift), [SINE], TIMES)
    assert np.std(motion["displacement"] - x) < 1e-7 * np.std(x)


def test_the_records_of_a_test_share_its_time_out_among_them():
    plan = (rig.SteppedSine((60.0,), (5.0,), 10), rig.FreeDecay((1e-3,), 4.0))
    seen = []

    class Watch(rig.Law):
        name = "watch"

        def placed(self, stretch, draw):
            seen.append(stretch)
            return self

        def force(self, t, x, v, z, s):
            return 0.0

    rig.run(LINEAR.plus(Watch()), plan, 1, EXACT)
    assert [(one.begin, one.end, one.seconds) for one in seen] == [
        (0.0, 0.25, 2.0),
        (0.25, 0.5, 2.0),
        (0.5, 1.0, 4.0),
    ]


@pytest.mark.parametrize("effect", [rig.StiffnessDrift(1.0), rig.FloorMotion(1.0, 1.0)])
def test_what_needs_a_record_says_so_without_one(effect):
    with pytest.raises(ValueError, match="must be placed in a"):
        rig.response(LINEAR.plus(effect), [SINE], TIMES)


def test_hum_is_a_line_of_its_own_phase_in_each_record():
    plan = rig.SteppedSine((60.0,), (5.0,), 50)
    bench = rig.Bench(rate=250.0, noise=0.0, force_noise=0.0, drift=0.0)
    clean = rig.run(LINEAR, plan, 1, bench)
    noisy = rig.run(LINEAR.plus(rig.MainsHum(0.03, 60.0)), plan, 1, bench)
    lines = []
    for one, other in zip(clean, noisy, strict=True):
        hum = other.output - one.output
        line = 2.0 * np.mean(hum * np.exp(-2j * np.pi * 60.0 * one.time))
        np.testing.assert_allclose(
            hum, (line * np.exp(2j * np.pi * 60.0 * one.time)).real, rtol=0, atol=1e-5 * abs(line)
        )
        np.testing.assert_array_equal(other.force, one.force)
        lines.append(line)
    assert np.abs(lines) == pytest.approx([0.03, 0.03], rel=1e-4)
    assert abs(np.angle(lines[0] / lines[1])) > 0.1


def test_a_harmonic_of_the_drive_acts_and_is_not_recorded():
    # In the steady state each harmonic passes the receptance of the linear plant by itself.
    plan = rig.SteppedSine((60.0,), (5.0,), 60, directions=("forward",))
    bench = rig.Bench(
        rate=250.0, noise=0.0, force_noise=0.0, drift=0.0, anti_alias=False, shaker=rig.IDEAL_SHAKER
    )
    (clean,) = rig.run(LINEAR, plan, 1, bench)
    (bent,) = rig.run(LINEAR.plus(rig.DriveHarmonics(0.05, 0.6, 2.0)), plan, 1, bench)
    np.testing.assert_array_equal(clean.force, bent.force)
    late = clean.time >= 6.0
    theta = 2 * np.pi * 5.0 * clean.time[late] - np.pi / 2
    np.testing.assert_allclose(clean.force[late], 60.0 * np.cos(theta), atol=1e-9)
    omega = 2 * np.pi * 10.0
    inertance = -(omega**2) / (K - MASS * omega**2 + 1j * C * omega)
    expected = 0.05 * 60.0 * (inertance * np.exp(1j * (2 * theta + 0.6))).real
    np.testing.assert_allclose(
        (bent.output - clean.output)[late], expected, rtol=0, atol=1e-6 * np.max(expected)
    )


def test_a_harmonic_of_a_sweep_is_a_cosine_of_a_multiple_of_its_phase():
    sweep = rig.Chirp(0.0, 10.0, 1.0, 4.0, 0.3, 70.0, ((2, 0.1, 0.4),), (0.2, 5.0, 0.5))
    since = TIMES - 1.0
    theta = 2 * np.pi * (4.0 + 0.15 * since) * since - np.pi / 2
    size = 70.0 * (1 - 0.2 * np.exp(-(((4.0 + 0.3 * since - 5.0) / 0.5) ** 2)))
    added = sweep.with_harmonic(3, 0.02, 0.9).forces(TIMES) - sweep.forces(TIMES)
    np.testing.assert_allclose(added, 0.02 * size * np.cos(3 * theta + 0.9), atol=1e-12)


def test_harmonics_of_a_multisine_are_refused():
    tones = rig.Tones(0.0, 1.0, 0.0, (1.0, 1.0), (6.0, 7.0), (0.0, 0.0))
    with pytest.raises(ValueError, match="Harmonics belong to a sine or a sweep"):
        tones.with_harmonic(3, 0.1, 0.0)


@pytest.mark.parametrize(("order", "method"), [(0.0, "zoh"), (1.0, "foh")])
def test_a_held_drive_is_the_discrete_system_of_its_samples(order, method):
    plan = rig.Multisine((60.0,), 2.0, 12.0, 2.0, 2)
    (record,) = rig.run(LINEAR.plus(rig.InputHold(order)), plan, 5, EXACT)
    matrix, push = np.array([[0.0, 1.0], [-K / MASS, -C / MASS]]), np.array([[0.0], [1.0 / MASS]])
    continuous = (matrix, push, matrix[1:], push[1:])
    system = signal.cont2discrete(continuous, 1.0 / record.rate, method=method)
    # What came before the record has died out in its second half.
    _, expected, _ = signal.dlsim(system, record.force[:, None])
    late = record.time >= 2.5
    np.testing.assert_allclose(
        record.output[late], expected[late, 0], rtol=0, atol=1e-5 * np.max(np.abs(expected))
    )
    (smooth,) = rig.run(LINEAR, plan, 5, EXACT)
    np.testing.assert_allclose(smooth.force, record.force, rtol=1e-12)


def test_a_plant_at_a_pressure_is_one_with_coefficients_of_that_pressure():
    laws = (
        rig.PressureStiffness(6e5, 2e5),
        rig.PressureDamping(4e3, 2e5),
        rig.PressureCubicStiffness(9e10, 2e5),
    )
    stretch = rig.Stretch(0.0, 1.0, SECONDS, 2.5e5)
    held = tuple(law.placed(stretch, np.random.default_rng(0)) for law in laws)

    def field(t, y):
        x, v = y
        spring = (K + 0.25 * 6e5) * x + (2.5e11 + 0.25 * 9e10) * x**3
        return v, (sine(t) - spring - (C + 0.25 * 4e3) * v) / MASS

    x, _ = solve(field, [0.0, 0.0])
    motion = rig.response(CUBIC.plus(*held), [SINE], TIMES)
    assert np.std(motion["displacement"] - x) < 1e-7 * np.std(x)


def test_a_campaign_at_pressures_is_filed_with_them(tmp_path):
    sweep = rig.Multisine((50.0,), 2.0, 12.0, 1.0, 2)
    plans = tuple(rig.AtPressure(sweep, pressure) for pressure in (1.8e5, 2.4e5))
    plant = LINEAR.plus(rig.PressureStiffness(6e5, 2e5))
    campaign = read_campaign(rig.write_campaign(tmp_path, plant, plans, 1, "pressures", EXACT))
    assert [record.pressure for record in campaign.records] == [1.8e5, 2.4e5]
    assert campaign.records[0].name.startswith("180kPa_")
    with pytest.raises(ValueError, match="must be `AtPressure`"):
        rig.run(plant, sweep, 1, EXACT)
