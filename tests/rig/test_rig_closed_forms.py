"""The simulated plant against solutions on paper."""

import numpy as np
import pytest

from isojax import rig

MASS, STIFFNESS, DAMPING = 800.0, 1.08e6, 1.0e4
LINEAR = rig.Plant((rig.LinearStiffness(STIFFNESS), rig.LinearDamping(DAMPING)), MASS)


def rms(values):
    return np.sqrt(np.mean(values**2))


def test_linear_response_to_a_sine_from_rest_is_exact():
    force, frequency = 100.0, 5.3
    times = np.arange(0, 6, 1e-3)
    w = 2 * np.pi * frequency
    motion = rig.response(LINEAR, [rig.Tones(0.0, 6.0, 0.0, (force,), (w,), (0.0,))], times)

    steady = force / (STIFFNESS - MASS * w**2 + 1j * w * DAMPING)
    decay = DAMPING / (2 * MASS)
    damped = np.sqrt(STIFFNESS / MASS - decay**2)
    x0, v0 = -steady.imag, -(1j * w * steady).imag
    free = (-decay + 1j * damped) * times
    amplitude = x0 - 1j * (v0 + decay * x0) / damped
    x = (steady * np.exp(1j * w * times)).imag + (amplitude * np.exp(free)).real
    a = (-(w**2) * steady * np.exp(1j * w * times)).imag + (
        (-decay + 1j * damped) ** 2 * amplitude * np.exp(free)
    ).real
    assert rms(motion["displacement"] - x) < 1e-8 * rms(x)
    assert rms(motion["acceleration"] - a) < 1e-8 * rms(a)


def test_linear_free_decay_is_exact():
    times = np.arange(0, 3, 1e-3)
    motion = rig.response(LINEAR, [rig.Tones(0.0, 3.0)], times, displacement=2e-3)
    decay = DAMPING / (2 * MASS)
    damped = np.sqrt(STIFFNESS / MASS - decay**2)
    x = 2e-3 * np.exp(-decay * times) * (np.cos(damped * times) + decay / damped * np.sin(damped * times))
    assert rms(motion["displacement"] - x) < 1e-8 * rms(x)


def test_free_decay_with_coulomb_friction_loses_4_fc_over_k_a_cycle_and_then_sticks():
    friction, start = 12.0, 1e-4
    plant = rig.Plant((rig.LinearStiffness(STIFFNESS), rig.CoulombFriction(friction)), MASS)
    w = np.sqrt(STIFFNESS / MASS)
    times = np.arange(0, 1, 1e-4)
    motion = rig.response(plant, [rig.Tones(0.0, 1.0)], times, displacement=start)

    loss = friction / STIFFNESS
    expected = np.empty_like(times)
    amplitude, side, begin = start, 1.0, 0.0
    while amplitude > loss:
        now = times >= begin
        expected[now] = side * (loss + (amplitude - loss) * np.cos(w * (times[now] - begin)))
        amplitude, side, begin = amplitude - 2 * loss, -side, begin + np.pi / w
    expected[times >= begin] = side * amplitude
    assert begin < 0.9
    assert np.abs(motion["displacement"] - expected).max() < 1e-8 * start
    rest = times > begin + 1e-9
    assert np.all(motion["velocity"][rest] == 0)
    assert np.all(motion["acceleration"][rest] == 0)


def test_friction_holds_the_plant_under_any_smaller_force():
    plant = LINEAR.plus(rig.CoulombFriction(10.0))
    times = np.arange(0, 3, 1e-3)
    motion = rig.response(plant, [rig.Tones(0.0, 3.0, 0.0, (9.99,), (20.0,), (0.3,))], times)
    assert np.all(motion["displacement"] == 0)
    assert np.all(motion["acceleration"] == 0)


def test_plant_breaks_away_where_the_force_passes_the_friction():
    plant = LINEAR.plus(rig.CoulombFriction(10.0))
    w = 20.0
    away = np.arcsin(10 / 15) / w
    times = np.array([away - 1e-6, away + 1e-4, away + 2e-4])
    motion = rig.response(plant, [rig.Tones(0.0, 1.0, 0.0, (15.0,), (w,), (0.0,))], times)
    assert motion["velocity"][0] == 0
    jerk = 15 * w * np.cos(w * away) / MASS
    np.testing.assert_allclose(motion["velocity"][1:], jerk * (times[1:] - away) ** 2 / 2, rtol=5e-3)


@pytest.mark.parametrize("ratio", [0.6, 1.4])
def test_forced_coulomb_oscillator_reaches_den_hartogs_amplitude(ratio):
    """Den Hartog, Trans. ASME 53 (1931): forced vibration with Coulomb friction that never stops."""
    force, friction = 100.0, 30.0
    natural = np.sqrt(STIFFNESS / MASS)
    w = ratio * natural
    plant = rig.Plant((rig.LinearStiffness(STIFFNESS), rig.CoulombFriction(friction)), MASS)
    seconds = 200 * 2 * np.pi / w
    times = np.linspace(0.98 * seconds, seconds, 20_000)
    motion = rig.response(plant, [rig.Tones(0.0, seconds + 1, 0.0, (force,), (w,), (0.0,))], times)
    response = 1 / (1 - ratio**2)
    offset = np.sin(np.pi / ratio) / (ratio * (1 + np.cos(np.pi / ratio)))
    amplitude = force / STIFFNESS * np.sqrt(response**2 - (friction / force * offset) ** 2)
    np.testing.assert_allclose(np.abs(motion["displacement"]).max(), amplitude, rtol=2e-6)


def test_maxwell_branch_adds_its_complex_stiffness():
    branch, tau, w, force = 2e5, 0.03, 2 * np.pi * 4.7, 50.0
    plant = LINEAR.plus(rig.MaxwellBranch(branch, tau))
    times = np.arange(8, 10, 1e-3)
    motion = rig.response(plant, [rig.Tones(0.0, 10.0, 0.0, (force,), (w,), (0.0,))], times)
    dynamic = STIFFNESS - MASS * w**2 + 1j * w * DAMPING + branch * 1j * w * tau / (1 + 1j * w * tau)
    x = (force / dynamic * np.exp(1j * w * times)).imag
    assert rms(motion["displacement"] - x) < 1e-7 * rms(x)


def test_added_mass_moves_along():
    times = np.arange(0, 2, 1e-3)
    pieces = [rig.Tones(0.0, 2.0, 0.0, (100.0,), (30.0,), (0.0,))]
    one = rig.response(rig.Plant(LINEAR.laws, MASS + 40), pieces, times)
    other = rig.response(LINEAR.plus(rig.AddedMass(40.0)), pieces, times)
    np.testing.assert_array_equal(one["acceleration"], other["acceleration"])


def test_plant_without_mass_is_refused():
    with pytest.raises(ValueError, match="positive moving mass"):
        LINEAR.plus(rig.AddedMass(-800.0))
