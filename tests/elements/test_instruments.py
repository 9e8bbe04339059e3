"""Effects of mass and instruments, seen through a simulated record."""

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from isojax.elements import (
    AddedMass,
    CubicStiffness,
    InputDelay,
    InputGain,
    InputOffset,
    LinearDamping,
    LinearStiffness,
    SensorGain,
    SensorOffset,
)
from isojax.excitations import Harmonic
from isojax.models import Instant, Isolator, simulate

M, K, C = 800.0, 1.08e6, 1.0e4
DRIVE = Harmonic(150.0, 4.3)


def linear(*elements, mass=M, **keywords) -> Isolator:
    return Isolator(mass, (LinearStiffness(K), LinearDamping(C), *elements), **keywords)


@pytest.mark.parametrize("excitation", ["force", "base_acceleration"])
def test_added_mass_is_mass(excitation):
    state, u = (jnp.asarray(1e-3), jnp.asarray(-0.03)), jnp.asarray(0.7)
    added, heavier = (
        linear(AddedMass(35.0), excitation=excitation),
        linear(mass=M + 35.0, excitation=excitation),
    )
    np.testing.assert_allclose(
        added.acceleration(state, Instant(u)), heavier.acceleration(state, Instant(u)), rtol=1e-14
    )
    reading = heavier.reading(state, Instant(u), "acceleration")
    np.testing.assert_allclose(added.reading(state, Instant(u), "acceleration"), reading, rtol=1e-14)


@pytest.mark.parametrize("delay", [2.3e-3, -1.7e-3])
def test_a_delayed_force_acts_later(delay):
    record = simulate(linear(CubicStiffness(2e11), InputDelay(delay)), DRIVE, duration=1.0)
    expected = solve_ivp(
        lambda t, y: [
            y[1],
            (150.0 * np.sin(2 * np.pi * 4.3 * (t - delay)) - K * y[0] - C * y[1] - 2e11 * y[0] ** 3) / M,
        ],
        (0.0, 1.0),
        [0.0, 0.0],
        "DOP853",
        np.arange(1001) / 1000.0,
        rtol=1e-12,
        atol=1e-15,
    )
    np.testing.assert_allclose(record.displacement, expected.y[0], atol=1e-7 * np.max(np.abs(expected.y[0])))
    np.testing.assert_allclose(
        record.drive, 150.0 * np.sin(2 * np.pi * 4.3 * (record.time - delay)), atol=1e-9
    )


def test_a_gain_of_the_drive_scales_a_linear_response():
    plain = simulate(linear(), DRIVE, duration=1.0)
    scaled = simulate(linear(InputGain(0.07)), DRIVE, duration=1.0)
    np.testing.assert_allclose(scaled.displacement, 1.07 * plain.displacement, rtol=1e-11, atol=1e-16)
    np.testing.assert_allclose(scaled.drive, 1.07 * plain.drive, rtol=1e-13)


def test_an_offset_of_the_drive_moves_the_static_equilibrium():
    record = simulate(linear(InputOffset(5.0)), Harmonic(0.0, 4.3), duration=6.0)
    np.testing.assert_allclose(record.displacement[-1], 5.0 / K, rtol=1e-9)
    np.testing.assert_allclose(record.drive, 5.0)


@pytest.mark.parametrize("excitation", ["force", "base_acceleration"])
def test_a_tilt_of_the_bench_is_an_offset_of_the_drive(excitation):
    along = 9.81 * np.sin(np.radians(0.3))
    based = excitation == "base_acceleration"
    drive, offset = (Harmonic(0.2, 4.3), -along) if based else (DRIVE, M * along)
    plant = linear(CubicStiffness(2e11), InputOffset(offset), excitation=excitation)
    record = simulate(plant, drive, duration=1.0)

    def tilted(t, y):
        push = drive.amplitude * np.sin(2 * np.pi * 4.3 * t)
        force = -M * push if based else push
        return [y[1], (force - K * y[0] - C * y[1] - 2e11 * y[0] ** 3) / M + along]

    times = np.arange(1001) / 1000.0
    expected = solve_ivp(tilted, (0.0, 1.0), [0.0, 0.0], "DOP853", times, rtol=1e-12, atol=1e-15).y[0]
    np.testing.assert_allclose(record.displacement, expected, atol=1e-7 * np.max(np.abs(expected)))


def test_gain_and_offset_of_the_sensor_change_the_reading_only():
    record = simulate(linear(SensorGain(-0.04), SensorOffset(0.3)), DRIVE, duration=1.0, quantity="velocity")
    plain = simulate(linear(), DRIVE, duration=1.0)
    np.testing.assert_allclose(record.displacement, plain.displacement, rtol=1e-12, atol=1e-18)
    np.testing.assert_allclose(record.reading, 0.96 * plain.velocity + 0.3, rtol=1e-12)


def test_instruments_act_in_the_order_given():
    state, zero, u = (jnp.asarray(1e-3), jnp.asarray(0.02)), jnp.asarray(0.0), jnp.asarray(40.0)

    def reading(*elements):
        return linear(*elements).reading(state, Instant(u, zero), "velocity")

    np.testing.assert_allclose(reading(SensorOffset(0.3), SensorGain(1.0)), 2.0 * (0.02 + 0.3), rtol=1e-14)
    np.testing.assert_allclose(reading(SensorGain(1.0), SensorOffset(0.3)), 2.0 * 0.02 + 0.3, rtol=1e-14)
    np.testing.assert_allclose(
        linear(InputOffset(3.0), InputGain(1.0)).drive(Instant(u, zero))[0], 86.0, rtol=1e-14
    )
    np.testing.assert_allclose(
        linear(InputGain(1.0), InputOffset(3.0)).drive(Instant(u, zero))[0], 83.0, rtol=1e-14
    )


def test_an_input_gain_of_a_linear_system_is_a_mass_stiffness_and_damping_error():
    gained = simulate(linear(InputGain(0.25)), DRIVE, duration=1.0)
    lighter = Isolator(M / 1.25, (LinearStiffness(K / 1.25), LinearDamping(C / 1.25)))
    np.testing.assert_allclose(
        gained.reading, simulate(lighter, DRIVE, duration=1.0).reading, rtol=1e-9, atol=1e-12
    )
