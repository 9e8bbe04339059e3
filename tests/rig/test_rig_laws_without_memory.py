"""Springs with gaps, gas and friction of the simulated plant against solutions on paper and SciPy."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import gamma

from isojax import rig

MASS, STIFFNESS = 800.0, 1.08e6
RATE = np.sqrt(STIFFNESS / MASS)
AMPLITUDE, GAP = 3e-3, 1.2e-3


def released(*laws, seconds, displacement=AMPLITUDE, steps=20_001):
    """Undamped motion after a release, and its times."""
    times = np.linspace(0.0, seconds, steps)
    plant = rig.Plant(laws, MASS)
    return times, rig.response(plant, [rig.Tones(0.0, 1.01 * seconds)], times, displacement, tolerance=1e-12)


def constant(force, seconds):
    """A cosine so slow that it has not fallen by 1e-11 at the end."""
    return rig.Tones(0.0, seconds, 0.0, (force,), (1e-6,), (0.5 * np.pi,))


def assert_closes(period, *laws):
    times, motion = released(*laws, seconds=period)
    assert abs(motion["displacement"][-1] - AMPLITUDE) < 1e-8 * AMPLITUDE
    assert abs(motion["velocity"][-1]) < 1e-6 * RATE * AMPLITUDE
    # Not a fraction of the period: it starts to come back once only.
    assert np.argmin(motion["displacement"]) == pytest.approx(0.5 * times.size, rel=0.2)


def stop_quarter(stop):
    """Times from the peak to the corner and from there to the centre, and the speed in the centre."""
    rate = np.sqrt((STIFFNESS + stop) / MASS)
    middle = stop * GAP / (STIFFNESS + stop)
    outside = np.arccos((GAP - middle) / (AMPLITUDE - middle)) / rate
    corner = rate * np.sqrt((AMPLITUDE - middle) ** 2 - (GAP - middle) ** 2)
    speed = np.hypot(corner, RATE * GAP)
    return outside, np.arcsin(RATE * GAP / speed) / RATE, speed


@pytest.mark.parametrize("stop", [2e5, 5e6])
def test_period_of_an_oscillator_between_two_stops_is_exact(stop):
    outside, inside, _ = stop_quarter(stop)
    assert_closes(4 * (outside + inside), rig.LinearStiffness(STIFFNESS), rig.EndStop(stop, GAP))


def test_period_of_an_oscillator_with_one_stop_is_exact():
    outside, inside, speed = stop_quarter(5e6)
    period = 2 * (outside + inside) + np.pi / RATE
    laws = rig.LinearStiffness(STIFFNESS), rig.EndStop(5e6, GAP, 1.0)
    assert_closes(period, *laws)
    _, motion = released(*laws, seconds=period)
    assert motion["displacement"].min() == pytest.approx(-speed / RATE, rel=1e-6)


def test_stops_of_either_side_are_mirror_images():
    spring = rig.LinearStiffness(STIFFNESS)
    _, up = released(spring, rig.EndStop(5e6, GAP, 1.0), seconds=0.5)
    _, down = released(spring, rig.EndStop(5e6, GAP, -1.0), seconds=0.5, displacement=-AMPLITUDE)
    np.testing.assert_array_equal(up["displacement"], -down["displacement"])


def test_period_of_a_mass_that_is_free_within_its_gap_is_exact():
    period = 4 * (0.5 * np.pi / RATE + GAP / (RATE * (AMPLITUDE - GAP)))
    assert_closes(period, rig.LinearStiffness(STIFFNESS), rig.Freeplay(STIFFNESS, GAP))


def test_play_and_a_stop_on_a_softer_spring_are_one_plant():
    lost = 3e5
    _, play = released(rig.LinearStiffness(STIFFNESS), rig.Freeplay(lost, GAP), seconds=1.0)
    _, stop = released(rig.LinearStiffness(STIFFNESS - lost), rig.EndStop(lost, GAP), seconds=1.0)
    assert np.abs(play["displacement"] - stop["displacement"]).max() < 1e-8 * AMPLITUDE


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("exponent", [1.0, 1.4])
def test_gas_gives_back_the_work_of_compression(exponent, side):
    preload, length = 9e3, 0.012
    _, motion = released(rig.PolytropicGas(preload, length, exponent, side), seconds=0.4)
    left = 1.0 - side * AMPLITUDE / length
    gas = -np.log(left) if exponent == 1.0 else (left ** (1.0 - exponent) - 1.0) / (exponent - 1.0)
    work = preload * (length * gas - side * AMPLITUDE)
    fastest = np.abs(motion["velocity"]).max()
    assert fastest == pytest.approx(np.sqrt(2.0 * work / MASS), rel=1e-6)


def test_gas_that_is_compressed_neither_way_is_refused():
    with pytest.raises(ValueError, match="`side` must be 1 or -1"):
        rig.PolytropicGas(9e3, 0.012, 1.4, 0.0)
    with pytest.raises(ValueError, match="`side` must be -1, 0 or 1"):
        rig.EndStop(1e6, 1e-3, 2.0)


def test_period_of_a_quintic_oscillator_is_exact():
    """The quarter period is sqrt(3 m / k5) / A^2 times the integral of (1 - u^6)^(-1/2) over 0 to 1."""
    coefficient = 5e16
    quarter = np.sqrt(3.0 * MASS / coefficient) / AMPLITUDE**2
    quarter *= np.sqrt(np.pi) * gamma(1 / 6) / (6.0 * gamma(2 / 3))
    assert_closes(4 * quarter, rig.QuinticStiffness(coefficient))


def test_friction_that_differs_by_direction_moves_the_centres_of_the_half_cycles():
    friction, difference = 12.0, 5.0
    laws = rig.LinearStiffness(STIFFNESS), rig.CoulombFriction(friction), rig.AsymmetricFriction(difference)
    half = np.pi / RATE
    times, motion = released(*laws, seconds=2 * half, displacement=1e-4)
    down, up = (friction - difference) / STIFFNESS, (friction + difference) / STIFFNESS
    lowest = 2 * down - 1e-4
    expected = np.where(
        times < half,
        down + (1e-4 - down) * np.cos(RATE * times),
        -up - (lowest + up) * np.cos(RATE * times),
    )
    assert np.abs(motion["displacement"] - expected).max() < 1e-8 * 1e-4


@pytest.mark.parametrize(("force", "moves"), [(16.9, False), (17.1, True), (-6.9, False), (-7.1, True)])
def test_friction_that_differs_by_direction_holds_more_one_way(force, moves):
    plant = rig.Plant((rig.CoulombFriction(12.0), rig.AsymmetricFriction(5.0)), MASS)
    times = np.linspace(0.0, 1.0, 11)
    motion = rig.response(plant, [constant(force, 1.1)], times)
    slides = force - (17.0 if force > 0 else -7.0) if moves else 0.0
    np.testing.assert_allclose(motion["displacement"], 0.5 * slides / MASS * times**2, rtol=1e-6, atol=1e-14)


def test_falling_friction_holds_up_to_its_breakaway_force():
    plant = rig.Plant((rig.StribeckFriction(10.0, 0.6, 0.01),), MASS)
    times = np.linspace(0.0, 1.0, 11)
    assert np.all(rig.response(plant, [constant(15.99, 1.1)], times)["displacement"] == 0.0)


def test_falling_friction_slides_as_scipy_says():
    friction, excess, speed, push = 10.0, 0.6, 0.01, 17.0
    times = np.linspace(0.0, 3.0, 301)

    def slide(_, y):
        return [y[1], (push - friction * (1 + excess * np.exp(-((y[1] / speed) ** 2)))) / MASS]

    run = solve_ivp(slide, (0.0, 3.0), [0.0, 0.0], "DOP853", times, rtol=1e-12, atol=1e-15)
    plant = rig.Plant((rig.StribeckFriction(friction, excess, speed),), MASS)
    motion = rig.response(plant, [constant(push, 3.1)], times)
    assert np.std(motion["displacement"] - run.y[0]) < 1e-7 * np.std(run.y[0])


def test_falling_friction_without_excess_is_coulombs():
    tones = rig.Tones(0.0, 2.0, 0.0, (100.0,), (25.0,), (0.3,))
    times = np.linspace(0.0, 2.0, 2001)
    spring = rig.LinearStiffness(STIFFNESS)
    one, other = (
        rig.response(rig.Plant((spring, law), MASS), [tones], times)["displacement"]
        for law in (rig.StribeckFriction(30.0, 0.0, 0.01), rig.CoulombFriction(30.0))
    )
    assert np.abs(one - other).max() < 1e-7 * np.abs(other).max()
