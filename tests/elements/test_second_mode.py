"""A mass carried on a spring, against the receptance of two masses on paper."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from isojax.elements import LinearDamping, LinearStiffness, SecondMode
from isojax.models import Instant, Isolator

M, K, C = 800.0, 1.08e6, 1.0e4
M2, W2, ZETA = 60.0, 34.0, 0.04
OMEGA = np.linspace(10.0, 80.0, 29)


def response(model, quantity):
    """Reading over drive at every angular frequency, by the model's own linearisation."""
    zero = jnp.zeros(())
    rest = jnp.zeros(2 + model.internal_states)

    def moved(state, u):
        state = tuple(state)
        return jnp.stack(
            [*model.rates(state, Instant(u), quantity), model.reading(state, Instant(u), quantity)]
        )

    by_state, by_drive = (np.array(part) for part in jax.jacfwd(moved, (0, 1))(rest, zero))
    own, inward = by_state[:-1], by_drive[:-1]
    return np.array(
        [
            by_state[-1] @ np.linalg.solve(1j * w * np.eye(rest.size) - own, inward) + by_drive[-1]
            for w in OMEGA
        ]
    )


def stiffness_matrix():
    """Dynamic stiffness of the isolated and the attached mass in absolute coordinates, frequency first."""
    iw = 1j * OMEGA[:, None, None]
    masses = np.diag([M, M2])
    springs = np.array([[K + M2 * W2**2, -M2 * W2**2], [-M2 * W2**2, M2 * W2**2]])
    c2 = 2.0 * ZETA * W2 * M2
    dampers = np.array([[C + c2, -c2], [-c2, c2]])
    return iw**2 * masses + iw * dampers + springs


def carrying(**keywords):
    return Isolator(M, (LinearStiffness(K), LinearDamping(C), SecondMode(M2, W2, ZETA)), **keywords)


def test_a_second_mode_has_the_receptance_of_two_masses():
    expected = np.linalg.inv(stiffness_matrix())[:, 0, 0]
    np.testing.assert_allclose(response(carrying(), "displacement"), expected, rtol=1e-10)
    np.testing.assert_allclose(response(carrying(), "acceleration"), -(OMEGA**2) * expected, rtol=1e-9)


@pytest.mark.parametrize("quantity", ["displacement", "acceleration"])
def test_under_base_excitation_the_attached_mass_feels_the_base_too(quantity):
    # Absolute motion X of both masses for a base motion of one: the base pushes through spring and damper.
    base = np.stack([K + 1j * OMEGA * C, 0.0 * OMEGA], axis=1)
    absolute = np.linalg.solve(stiffness_matrix(), base[..., None])[:, 0, 0]
    found = response(carrying(excitation="base_acceleration"), quantity)
    # Drive: the base's acceleration, -w^2 for a base motion of one.
    expected = absolute if quantity == "acceleration" else (absolute - 1.0) / -(OMEGA**2)
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_far_above_the_band_it_is_an_added_mass():
    stiff = Isolator(M, (LinearStiffness(K), LinearDamping(C), SecondMode(M2, 3e4, 0.1)))
    heavier = 1.0 / (K - (M + M2) * OMEGA**2 + 1j * OMEGA * C)
    np.testing.assert_allclose(response(stiff, "displacement"), heavier, rtol=1e-4)


def test_frequency_is_in_hertz():
    np.testing.assert_allclose(SecondMode(M2, W2, ZETA).frequency(), W2 / (2.0 * np.pi))
