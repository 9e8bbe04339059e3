"""Dry friction: loop height, equivalent damping, and the width that stands for the jump."""

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import quad

from isojax.elements import CoulombFriction, LinearDamping, LinearStiffness, Scales
from isojax.excitations import Harmonic
from isojax.models import Isolator, simulate


def equivalent_damping(element: CoulombFriction, size: float, omega: float) -> float:
    """Part of the force in phase with the velocity over its amplitude, under x = size sin(omega t)."""

    def integrand(phi):
        velocity = jnp.asarray(size * omega * np.cos(phi))
        return float(element.force(jnp.asarray(0.0), velocity, ())) * np.cos(phi)

    edges = np.array([0.0, 0.5 * np.pi, np.pi])
    near = float(element.width) / (size * omega) * 20.0
    points = [0.5 * np.pi - near, 0.5 * np.pi + near]
    value = quad(integrand, edges[0], edges[-1], points=[points[0], edges[1], points[1]], limit=400)[0]
    return 2.0 * value / (np.pi * size * omega)


def scales(**changed) -> Scales:
    values = {
        "mass": 800.0,
        "force": 150.0,
        "displacement": 3e-3,
        "velocity": 0.08,
        "acceleration": 2.2,
        "angular_frequency": 27.0,
        "sample_time": 1e-3,
        "slowest_velocity": 0.02,
        "reading": 2.2,
    }
    return Scales(**(values | changed))


@pytest.mark.parametrize("speed", [0.01, 0.1, 1.0])
def test_loop_height_is_twice_the_force_at_every_speed(speed):
    element = CoulombFriction(20.0, 1e-4)
    zero = jnp.asarray(0.0)
    height = element.force(zero, jnp.asarray(speed), ()) - element.force(zero, jnp.asarray(-speed), ())
    np.testing.assert_allclose(height, 40.0, rtol=1e-12)


@pytest.mark.parametrize(("size", "omega"), [(1e-3, 27.0), (4e-3, 27.0), (1e-3, 44.0)])
def test_equivalent_damping_is_den_hartogs(size, omega):
    found = equivalent_damping(CoulombFriction(20.0, 1e-5), size, omega)
    np.testing.assert_allclose(found, 4.0 * 20.0 / (np.pi * omega * size), rtol=1e-6)


def test_the_width_loses_the_documented_share_of_the_dissipation():
    size, omega = 1e-3, 27.0
    share = 0.02
    found = equivalent_damping(CoulombFriction(20.0, share * size * omega), size, omega)
    lost = 1.0 - found / (4.0 * 20.0 / (np.pi * omega * size))
    np.testing.assert_allclose(lost, np.pi**2 / 24.0 * share**2, rtol=2e-3)


def test_the_guessed_width_is_a_fiftieth_of_the_slowest_motion():
    assert float(CoulombFriction.guess(scales()).width) == 0.02 * 0.02
    # Where the velocity changes by more than that in half a step, the step decides.
    step = 1e-3 / CoulombFriction.substeps
    fast = scales(slowest_velocity=1e-3)
    np.testing.assert_allclose(float(CoulombFriction.guess(fast).width), 0.5 * 2.2 * step, rtol=1e-12)


def test_the_guessed_width_stays_integrable_where_a_record_comes_to_rest():
    quiet = scales(slowest_velocity=0.0, acceleration=0.0)
    width = float(CoulombFriction.guess(quiet).width)
    np.testing.assert_allclose(width, 0.5 * 150.0 * 1e-3 / CoulombFriction.substeps / 800.0, rtol=1e-12)
    # Friction equal to the whole drive: the mass must creep within the width, not chatter from step to step.
    spring, damper = LinearStiffness(1e6), LinearDamping(1e4)
    held = Isolator(800.0, (spring, damper, CoulombFriction(150.0, width)))
    record = simulate(held, Harmonic(140.0, 4.3), duration=1.0)
    velocity = np.asarray(record.velocity)
    assert np.max(np.abs(velocity)) < 3.0 * width
    reversals = np.sum(np.diff(np.sign(velocity[10:])) != 0)
    assert reversals <= 2 * 4.3 + 1
