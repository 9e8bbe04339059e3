"""Orbits of friction, stops and gaps against Den Hartog's closed form and the event-exact rig."""

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from rig_orbits import multiplier_error, rig_orbit
from scipy.optimize import brentq
from scipy_orbits import Y_DIRECTION, polynomial, shoot

from isojax import Harmonic, Integrator, Isolator, elements, find_periodic_orbit, paper, rig, stability_map
from isojax._results import RESULTS, is_successful
from isojax.stability.orbit._event_path import follow_events
from isojax.stability.orbit._period_map import period_map
from isojax.stability.orbit._sine import recorded_sine

MASS, STIFFNESS, FRICTION, FORCE = 2.0, 800.0, 6.0, 40.0


@pytest.mark.parametrize("ratio", [0.6, 1.4])
def test_friction_that_never_sticks_has_the_orbit_of_den_hartog_and_his_reversals(ratio):
    # Den Hartog 1931, Trans. ASME 53:107, without a viscous damper.
    model = Isolator(MASS, (elements.LinearStiffness(STIFFNESS), elements.CoulombFriction(FRICTION, 1e-3)))
    frequency = ratio * math.sqrt(STIFFNESS / MASS) / (2.0 * math.pi)
    orbit = find_periodic_orbit(model, Harmonic(FORCE, frequency))
    response = 1.0 / (1.0 - ratio**2)
    damping = math.sin(math.pi / ratio) / (ratio * (1.0 + math.cos(math.pi / ratio)))
    static, slip = FORCE / STIFFNESS, FRICTION / STIFFNESS
    amplitude = math.sqrt((static * response) ** 2 - (slip * damping) ** 2)
    assert is_successful(orbit.result)
    assert abs(float(orbit.amplitude) / amplitude - 1.0) < 1e-8
    # Between reversals the motion turns in its phase plane; at one the velocity jumps by what acts after it
    # over what acted before it.
    push = STIFFNESS * amplitude / response
    before, after = push - STIFFNESS * amplitude - FRICTION, push - STIFFNESS * amplitude + FRICTION
    product = np.prod(np.asarray(orbit.floquet.multipliers))
    np.testing.assert_allclose(product, (after / before) ** 2, rtol=1e-8)


CASES = {
    "sticking": (elements.CoulombFriction(4.0, 1e-4), rig.CoulombFriction(4.0), (5.5, 4.4)),
    "breaking loose": (
        elements.StribeckFriction(3.0, 0.5, 1e-3, 1e-4),
        rig.StribeckFriction(3.0, 0.5, 1e-3),
        (8.0, 5.9),
    ),
    "gap": (elements.Freeplay(5e5, 4e-5, 1e-6), rig.Freeplay(5e5, 4e-5), (30.0, 5.5)),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_orbits_of_sharp_laws_are_those_of_the_rig(name):
    element, law, at = CASES[name]
    orbit = find_periodic_orbit(paper.y_direction().with_elements(element), Harmonic(*at))
    exact = rig_orbit(rig.y_plant().plus(law), *at, np.asarray(orbit.y0))
    assert is_successful(orbit.result)
    assert exact.closed
    size = np.array([1.0, 2.0 * math.pi * at[1]]) * float(orbit.amplitude)
    np.testing.assert_allclose(np.asarray(orbit.y0) / size, exact.y0 / size, atol=1e-8)
    assert multiplier_error(np.asarray(orbit.floquet.multipliers), exact.multipliers) < 1e-8


GAP, STOP = 1e-4, 4e6


def test_a_stop_that_is_barely_met_is_met_and_one_that_is_not_is_not():
    model = paper.y_direction().with_elements(elements.EndStop(0.5 * STOP, GAP, 1.0, 1e-6))
    plant, grazing = rig.y_plant().plus(rig.EndStop(STOP, GAP, 1.0)), _grazing_force()
    for share in (1.0 - 1e-4, 1.0 + 1e-4, 1.01):
        orbit = find_periodic_orbit(model, Harmonic(share * grazing, 5.0))
        # SciPy's events would miss a contact within one of its steps; the rig looks for it.
        exact = rig_orbit(plant, share * grazing, 5.0, np.asarray(orbit.y0), shift=1e-6)
        assert is_successful(orbit.result)
        assert exact.closed
        # So small differences leave 1e-7 of the rig's rounding.
        assert multiplier_error(np.asarray(orbit.floquet.multipliers), exact.multipliers) < 1e-6


def _grazing_force():
    """The drive under which the y model alone just reaches the stop."""
    law = polynomial(**Y_DIRECTION)
    return brentq(lambda force: shoot(law, force, 5.0, [GAP, 0.0]).amplitude / GAP - 1.0, 1.0, 60.0)


def test_a_contact_within_one_step_is_not_stepped_over():
    # Half an oscillation: the stop is met and left in the middle of the eighth of fifteen steps.
    spring, omega, depth = 100.0, 10.0, 1e-3
    model = Isolator(1.0, (elements.LinearStiffness(spring), elements.EndStop(5e3, 1.0 - depth, 1.0, 1e-9)))
    drive = recorded_sine(model, 0.0, omega / (2.0 * math.pi))
    events = follow_events(model, drive, (jnp.asarray(0.0), jnp.asarray(omega)), math.pi, 15, 4).crossings
    met = math.acos(1.0 - depth)
    np.testing.assert_array_equal(events.kinks[:2], [0, 0])
    np.testing.assert_allclose(events.phases[0], 0.5 * math.pi - met, atol=2e-3)
    assert events.phases[1] < 8.0 / 15.0 * math.pi


def test_the_period_map_of_friction_has_the_derivative_of_differences():
    model = paper.y_direction().with_elements(elements.CoulombFriction(4.0, 1e-4))
    drive = recorded_sine(model, 8.0, 5.0)

    @jax.jit
    def moved(state):
        return jnp.stack(period_map(model, Integrator(), drive, tuple(state)))

    start, sizes = jnp.array([1e-5, 4e-4]), np.array([1e-5, 4e-4])
    slopes = np.asarray(jax.jacfwd(moved)(start)) * sizes
    for place in range(2):
        shift = 1e-5 * sizes * np.eye(2)[place]
        wanted = (moved(start + shift) - moved(start - shift)) / 2e-5
        np.testing.assert_allclose(slopes[:, place], wanted, atol=1e-5 * np.abs(slopes).max())


def test_a_mass_that_friction_never_lets_go_has_no_orbit_of_its_own():
    # From rest it is freed by a drive above its friction, and by no other.
    model = Isolator(MASS, (elements.LinearStiffness(STIFFNESS), elements.CoulombFriction(40.0, 1e-3)))
    for force in (20.0, 39.9):
        orbit = find_periodic_orbit(model, Harmonic(force, 5.0))
        assert orbit.result == RESULTS.sticks
        assert not np.any(np.isfinite(orbit.floquet.multipliers))
    assert not find_periodic_orbit(model, Harmonic(40.1, 5.0)).result == RESULTS.sticks


def test_steps_that_are_too_few_for_the_accuracy_say_so():
    model = Isolator(MASS, (elements.LinearStiffness(STIFFNESS), elements.LinearDamping(8.0)))

    class Coarse(Integrator):
        @property
        def orbit_error(self) -> float:
            return 1e-18

    orbit = find_periodic_orbit(model, Harmonic(20.0, 5.0), integrator=Coarse())
    assert orbit.result == RESULTS.not_accurate
    assert float(orbit.error) > 1e-18


@pytest.mark.slow
def test_a_map_with_friction_holds_the_orbits_of_the_rig(monkeypatch):
    # Orbits are found so many at once; there are but six.
    monkeypatch.setattr("isojax.stability.map._single_orbits._ORBITS_TOGETHER", 6)
    laws = elements.LinearStiffness(1e6), elements.LinearDamping(1e4), elements.CoulombFriction(4.0, 1e-4)
    model = Isolator(800.0, laws)
    forces, band = np.array([2.0, 5.5, 20.0]), np.array([4.4, 5.9])
    smap = stability_map(model, forces, band)
    plant = rig.Plant((rig.LinearStiffness(1e6), rig.LinearDamping(1e4), rig.CoulombFriction(4.0)), 800.0)
    y0 = np.asarray(smap.y0)
    np.testing.assert_array_equal(smap.count, [[0, 0], [1, 1], [1, 1]])
    np.testing.assert_array_equal(
        smap.result == RESULTS.sticks, [[True, True], [False, False], [False, False]]
    )
    assert "2 in which dry friction holds the mass, 0 without any" in " ".join(repr(smap).split())
    assert "|hh" in repr(smap)
    for row, column in [(1, 0), (1, 1), (2, 0), (2, 1)]:
        exact = rig_orbit(plant, forces[row], band[column], y0[row, column])
        error = multiplier_error(np.asarray(smap.multipliers)[row, column], exact.multipliers)
        assert exact.closed
        assert error < smap.error < 5e-6


@pytest.mark.slow
def test_a_map_with_friction_holds_all_orbits_between_the_folds(monkeypatch):
    # Next to rest friction is stiff without bound: how far orbits are sought must not follow from that.
    monkeypatch.setattr("isojax.stability.map._single_orbits._ORBITS_TOGETHER", 6)
    laws = elements.LinearStiffness(3e5), elements.CubicStiffness(4e10), elements.LinearDamping(360.0)
    model = Isolator(120.0, (*laws, elements.CoulombFriction(6.0, 1e-4)))
    smap = stability_map(model, [3.0, 60.0, 80.0], [8.0, 10.0], coexisting=True)
    np.testing.assert_array_equal(smap.count, [[0, 0], [1, 1], [1, 3]])
    held = [RESULTS.sticks, RESULTS.no_further_orbit, RESULTS.no_further_orbit]
    for place, expected in enumerate(held):
        assert bool((smap.result[place, 0] == expected).all())
    own = rig.LinearStiffness(3e5), rig.CubicStiffness(4e10), rig.LinearDamping(360.0)
    plant = rig.Plant((*own, rig.CoulombFriction(6.0)), 120.0)
    for place in range(3):
        exact = rig_orbit(plant, 80.0, 10.0, np.asarray(smap.y0)[place, 2, 1])
        assert exact.closed
        error = multiplier_error(np.asarray(smap.multipliers)[place, 2, 1], exact.multipliers)
        assert error < smap.error < 5e-6
