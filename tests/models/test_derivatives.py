"""Forward-mode derivatives of a simulated record against central differences."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from isojax import paper
from isojax._parameters import list_parameters, replace_parameters
from isojax.elements import (
    BoucWen,
    InputDelay,
    InputGain,
    InputOffset,
    MaxwellBranch,
    SensorGain,
    SensorOffset,
)
from isojax.excitations import Harmonic
from isojax.models import simulate

MODEL = paper.y_direction().with_elements(
    MaxwellBranch(2e4, 0.03),
    BoucWen(2e4, 300.0, -150.0, 1.3),
    InputDelay(1e-3),
    InputGain(0.02),
    InputOffset(1.5),
    SensorGain(-0.03),
    SensorOffset(0.01),
)
ENTRIES = list_parameters(MODEL)


@pytest.fixture(scope="module")
def record():
    @jax.jit
    def reading(values):
        return simulate(replace_parameters(MODEL, values), Harmonic(150.0, 4.3), duration=0.6).reading

    return reading


@pytest.fixture(scope="module")
def jacobian(record):
    return jax.jit(jax.jacfwd(record))(jnp.asarray([entry.value for entry in ENTRIES]))


def test_reverse_mode_gives_the_derivatives_that_forward_mode_gives(record, jacobian):
    values = jnp.asarray([entry.value for entry in ENTRIES])
    weights = jnp.sin(jnp.arange(jacobian.shape[0]))
    backwards = jax.grad(lambda numbers: jnp.vdot(weights, record(numbers)))(values)
    expected = weights @ jacobian
    size = np.abs(np.asarray(values))
    top = np.abs(size * expected).max()
    np.testing.assert_allclose(size * backwards, size * expected, atol=1e-12 * top, rtol=1e-10)


@pytest.mark.parametrize("place", range(len(ENTRIES)), ids=[entry.name for entry in ENTRIES])
def test_the_derivative_in_each_coefficient_is_the_central_difference(place, record, jacobian):
    values = np.array([float(entry.value) for entry in ENTRIES])
    step = 2e-5 * abs(values[place])
    moved = np.eye(len(values))[place] * step
    difference = (record(jnp.asarray(values + moved)) - record(jnp.asarray(values - moved))) / (2.0 * step)
    size = float(jnp.max(jnp.abs(difference)))
    assert size > 0.0
    np.testing.assert_allclose(jacobian[:, place], difference, atol=1e-6 * size)
