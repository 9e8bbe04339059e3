"""Base excitation against the closed-form transmissibility."""

import jax.numpy as jnp
import numpy as np
import pytest

from isojax.elements import LinearDamping, LinearStiffness
from isojax.excitations import Harmonic
from isojax.models import Instant, Isolator, simulate

M, K, C = 800.0, 1.08e6, 1.0e4


def amplitude(values, frequency, rate):
    """Complex amplitude against sin(omega t) over the last four whole cycles."""
    count = round(4.0 * rate / frequency)
    t = np.arange(len(values) - count, len(values)) / rate
    return 2j * np.mean(np.asarray(values)[-count:] * np.exp(-2j * np.pi * frequency * t))


@pytest.mark.parametrize("frequency", [2.5, 5.0, 8.0])
def test_base_excitation_has_the_closed_form_transmissibility(frequency):
    omega, base, rate = 2.0 * np.pi * frequency, 0.3, 1000.0
    model = Isolator(M, (LinearStiffness(K), LinearDamping(C)), "base_acceleration")
    record = simulate(model, Harmonic(base, frequency), duration=6.0, rate=rate)
    dynamic = K + 1j * omega * C
    np.testing.assert_allclose(
        amplitude(record.reading, frequency, rate) / base, dynamic / (dynamic - M * omega**2), rtol=2e-6
    )
    np.testing.assert_allclose(
        amplitude(record.displacement, frequency, rate) / base, -M / (dynamic - M * omega**2), rtol=2e-6
    )
    np.testing.assert_allclose(
        np.asarray(record.reading),
        np.asarray(record.acceleration) + base * np.sin(omega * np.asarray(record.time)),
        atol=1e-12,
    )


def test_displacement_and_velocity_readings_are_relative_to_the_base():
    model = Isolator(M, (LinearStiffness(K), LinearDamping(C)), "base_acceleration")
    state, u = (jnp.asarray(1e-3), jnp.asarray(0.02)), jnp.asarray(0.3)
    assert float(model.reading(state, Instant(u), "displacement")) == 1e-3
    assert float(model.reading(state, Instant(u), "velocity")) == 0.02
    np.testing.assert_allclose(
        model.reading(state, Instant(u), "acceleration"), -(K * 1e-3 + C * 0.02) / M, rtol=1e-13
    )
