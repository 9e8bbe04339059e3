"""The moving floor against the closed form of the transmissibility."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from isojax.elements import FloorMotion, LinearDamping, LinearStiffness, SecondMode
from isojax.models import Instant, Isolator

MASS, K, C = 800.0, 1.08e6, 1.03e4


def steady(model: Isolator, frequency: float, quantity: str) -> complex:
    """Reading over the measured acceleration of the floor: the linear equations at one frequency."""
    zero, size = jnp.zeros(()), 2 + model.internal_states

    def both(state, floor):
        channels = {"floor": floor}
        states = tuple(state)
        rates = model.rates(states, Instant(zero, zero, channels))
        return jnp.stack([*rates, model.reading(states, Instant(zero, zero, channels), quantity)])

    by_state, by_floor = jax.jacfwd(both, argnums=(0, 1))(jnp.zeros(size), zero)
    turning = 2j * np.pi * frequency * np.eye(size)
    answer = np.linalg.solve(turning - np.asarray(by_state)[:size], np.asarray(by_floor)[:size])
    return complex(np.asarray(by_state)[size] @ answer + by_floor[size])


@pytest.mark.parametrize("transmission", [1.0, 0.7, -0.4])
@pytest.mark.parametrize("frequency", [1.0, 5.5, 5.85, 12.0])
def test_an_acceleration_passes_by_the_transmissibility(transmission, frequency):
    model = Isolator(MASS, (LinearStiffness(K), LinearDamping(C), FloorMotion(transmission)))
    s = 2j * np.pi * frequency
    transmissibility = (K + C * s) / (K + C * s + MASS * s**2)
    assert steady(model, frequency, "acceleration") == pytest.approx(transmission * transmissibility)
    # Displacements are relative to the floor, whose own is a / s^2.
    assert steady(model, frequency, "displacement") == pytest.approx(
        transmission * (transmissibility - 1.0) / s**2
    )


def test_a_mass_that_the_isolator_carries_feels_the_floor_too():
    small, angular, zeta = 40.0, 2 * np.pi * 9.0, 0.05
    carried = SecondMode(small, angular, zeta)
    model = Isolator(MASS, (LinearStiffness(K), LinearDamping(C), carried, FloorMotion(1.0)))
    for frequency in (2.0, 6.0, 9.0):
        s = 2j * np.pi * frequency
        link = small * (angular**2 + 2 * zeta * angular * s)
        # Absolute motions: the large mass, and the small one that hangs on it alone.
        matrix = np.array([[MASS * s**2 + C * s + K + link, -link], [-link, small * s**2 + link]])
        large, _ = np.linalg.solve(matrix, np.array([K + C * s, 0.0]))
        assert steady(model, frequency, "acceleration") == pytest.approx(large)


def test_without_a_record_the_floor_stands_still():
    model = Isolator(MASS, (LinearStiffness(K), FloorMotion(1.0)))
    state = (jnp.asarray(1e-3), jnp.asarray(0.0))
    at = Instant(jnp.asarray(5.0))
    assert model.base(at) is None
    assert float(model.acceleration(state, at)) == pytest.approx((5.0 - K * 1e-3) / MASS)
