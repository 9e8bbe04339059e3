"""Curves of isolators with dry friction against Den Hartog's closed form and the force that breaks loose."""

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import isojax as ij
from isojax.stability.orbit import integrator_that_follows, recorded_sine, trajectory
from isojax.stability.orbit._event_path import follow_events

MASS, STIFFNESS, FRICTION, FORCE = 2.0, 800.0, 6.0, 40.0
NATURAL = math.sqrt(STIFFNESS / MASS) / (2.0 * math.pi)
MODEL = ij.Isolator(MASS, (ij.LinearStiffness(STIFFNESS), ij.elements.CoulombFriction(FRICTION, 1e-3)))


def den_hartog(ratio):
    """Give the amplitude of a motion without stops, Den Hartog 1931, Trans. ASME 53:107."""
    response = 1.0 / (1.0 - ratio**2)
    damping = np.sin(np.pi / ratio) / (ratio * (1.0 + np.cos(np.pi / ratio)))
    return np.sqrt((FORCE / STIFFNESS * response) ** 2 - (FRICTION / STIFFNESS * damping) ** 2)


def test_the_response_with_dry_friction_is_whole_and_that_of_den_hartog():
    response = ij.frequency_response(MODEL, FORCE, (1.2 * NATURAL, 2.0 * NATURAL), periods=())
    frequency = np.asarray(response.frequency)
    assert response.result == ij.RESULTS.successful
    assert frequency[-1] == pytest.approx(2.0 * NATURAL, rel=1e-9)
    assert frequency.size < 200
    np.testing.assert_allclose(np.asarray(response.amplitude), den_hartog(frequency / NATURAL), rtol=1e-4)


PRESLIDING, FAST = 2e-4, 1.5 * NATURAL
"""Of bristles two hundred times shorter than the motion [m]; frequency of its drive [Hz]."""


def with_bristles(presliding=PRESLIDING):
    return ij.Isolator(MASS, (ij.LinearStiffness(STIFFNESS), ij.DahlFriction(FRICTION, presliding)))


def after_a_period(force, begin):
    """Give the state a period later by SciPy."""

    def rates(t, y):
        x, v, z = y
        drive = force * np.sin(2.0 * np.pi * FAST * t)
        return v, (drive - STIFFNESS * x - FRICTION * z) / MASS, (v - abs(v) * z) / PRESLIDING

    tight = {"method": "LSODA", "rtol": 1e-10, "atol": 1e-12}
    return solve_ivp(rates, (0.0, 1.0 / FAST), begin, **tight).y[:, -1]


@pytest.mark.slow
def test_an_orbit_with_bristles_far_shorter_than_the_motion_is_that_of_scipy():
    model = with_bristles()
    orbit = ij.find_periodic_orbit(model, ij.Harmonic(FORCE, FAST))
    begin = np.asarray(orbit.y0)
    np.testing.assert_allclose(after_a_period(FORCE, begin), begin, rtol=1e-6, atol=1e-8)
    # The third multiplier is exp(-thousands): the bristles forget where they were.
    columns = []
    for shift in 1e-5 * np.diag([1.0, 20.0, 0.0])[:2]:
        ends = [after_a_period(FORCE, begin + sign * shift) for sign in (1.0, -1.0)]
        columns.append((ends[0] - ends[1])[:2] / (2.0 * shift.max()))
    wanted = np.sort_complex(np.linalg.eigvals(np.array(columns).T))
    np.testing.assert_allclose(np.sort_complex(orbit.floquet.multipliers[:2]), wanted, atol=1e-4)
    with pytest.raises(ValueError, match=r"`integrator` must take at least .* too fast for fewer"):
        ij.stability_map(model, [FORCE], [FAST], integrator=ij.Integrator())


@pytest.mark.parametrize(("presliding", "steps", "stiff"), [(2e-4, 2048, False), (2e-7, 8192, True)])
def test_steps_follow_the_rate_of_bristles_in_closed_form(presliding, steps, stiff):
    # z' = (v - |v| z) / presliding: the rate is at most omega X / presliding, a step half of its inverse.
    size = 0.04
    found = integrator_that_follows(
        with_bristles(presliding), ij.Integrator(), np.array([size]), np.array([FAST])
    )
    needed = 2.0 * math.pi * size / presliding / 0.5
    assert found[0].steps_a_period(with_bristles()) == 2 * steps
    assert found[1] == stiff == (needed > 2 * steps)
    assert stiff or needed > steps


@pytest.mark.slow
def test_a_branch_with_bristles_far_shorter_than_the_motion_is_whole_and_returns_under_scipy():
    ends = {"start": FORCE, "stop": 35.0}
    branch = ij.continue_branch(
        with_bristles(), parameter="amplitude", frequency=FAST, **ends, other_periods=(), step=0.2
    )
    assert branch.result == ij.RESULTS.successful
    for place in (0, -1):
        begin = np.asarray(branch.points.y0[place])
        end = after_a_period(float(branch.points.amplitude[place]), begin)
        np.testing.assert_allclose(end, begin, atol=1e-4 * np.max(np.abs(begin)), rtol=1e-4)


@pytest.fixture(scope="module")
def branches():
    ends = {"down": (FORCE, 1.0), "up": (1.0, FORCE), "held": (1.0, 5.0)}
    model = MODEL.with_elements(ij.LinearDamping(10.0))
    return {
        name: ij.continue_branch(
            model, parameter="amplitude", frequency=0.8 * NATURAL, start=start, stop=stop, other_periods=()
        )
        for name, (start, stop) in ends.items()
    }


@pytest.mark.parametrize("way", ["down", "up"])
def test_a_branch_ends_or_begins_where_friction_lets_the_mass_go(branches, way):
    branch = branches[way]
    values = np.sort(np.asarray(branch.points.value))
    assert branch.result == ij.RESULTS.sticks
    # The mass is free as soon as the force exceeds the friction.
    assert FRICTION < values[0] < FRICTION * (1.0 + 2e-3)
    assert values[-1] == pytest.approx(FORCE, rel=1e-9)
    assert branch.special_points == ()
    assert np.all(np.asarray(branch.points.stable))


def test_a_branch_says_where_friction_holds_the_mass(branches):
    assert "dry friction holds the mass beyond" in repr(branches["up"])
    assert branches["held"].points.value.size == 0
    assert branches["held"].result == ij.RESULTS.sticks
    assert "dry friction holds the mass over the whole range" in repr(branches["held"])


def test_a_reversal_that_falls_on_a_sample_is_in_the_path():
    # Half a free oscillation from rest at x0, about Fc / k: it reverses at 2 Fc / k - x0, here all but on
    # the middle sample, a little before it and a little after.
    frequency = NATURAL * (1.0 + jnp.linspace(-5e-9, 5e-9, 9))
    still, start = recorded_sine(MODEL, 0.0 * frequency, frequency), jnp.full(9, 0.03)
    path = trajectory(MODEL, ij.Integrator(steps_per_period=256), still, (start, 0.0 * start))
    np.testing.assert_allclose(path[0][128], 2.0 * FRICTION / STIFFNESS - start, rtol=1e-6)


def test_a_reversal_at_the_very_end_passes_on_the_derivative_of_its_instant():
    # Half a free oscillation later the mass is about to turn: the velocity changes as the force before it
    # says, or as that after it.
    start, rates = 0.05, []
    begin = jnp.asarray(start), jnp.zeros(())

    @jax.jit
    def reversal(frequency):
        still = recorded_sine(MODEL, 0.0 * frequency, frequency)
        motion = follow_events(MODEL, still, begin, math.pi * 129 / 128, 129, 4)
        return motion.crossings.phases[0]

    @jax.jit
    def velocity(frequency):
        still = recorded_sine(MODEL, 0.0 * frequency, frequency)
        return follow_events(MODEL, still, begin, math.pi, 128, 4).end[1]

    frequency = jnp.asarray(NATURAL)
    for _ in range(4):
        frequency = frequency * math.pi / reversal(frequency)
    for shift in np.linspace(-5e-13, 5e-13, 7):
        rates.append(float(jax.jacfwd(velocity)(frequency * (1.0 + shift))) * -2.0 * NATURAL**2)
    turn = 2.0 * FRICTION / STIFFNESS - start
    sides = np.array([-STIFFNESS * turn + sign * FRICTION for sign in (1.0, -1.0)]) / MASS
    assert np.min(np.abs(np.array(rates)[:, None] - sides), axis=1) == pytest.approx(0.0, abs=1e-3)
