"""A recorded drive at any time."""

from typing import get_args

import jax.numpy as jnp
import numpy as np
import pytest

from isojax.excitations import Hold, Sampled, tabulate
from isojax.records._campaign import Hold as DeclaredHold

RATE, COUNT = 1000.0, 2000
OMEGA = 2 * np.pi * 11.0


@pytest.fixture(scope="module")
def samples():
    return 3.0 * np.sin(OMEGA * np.arange(COUNT) / RATE + 0.4)


@pytest.fixture(scope="module")
def times():
    return np.random.default_rng(5).uniform(0.3, 1.7, 300)


def test_a_campaign_declares_the_holds_that_a_drive_knows():
    assert get_args(DeclaredHold) == get_args(Hold)


def test_band_limited_is_the_sine_that_was_sampled(samples, times):
    drive = Sampled(samples, RATE)
    np.testing.assert_allclose(drive(jnp.asarray(times)), 3.0 * np.sin(OMEGA * times + 0.4), atol=1e-7)
    np.testing.assert_allclose(
        drive.rate(jnp.asarray(times)), 3.0 * OMEGA * np.cos(OMEGA * times + 0.4), atol=1e-5 * OMEGA
    )


def test_linear_is_numpys_interpolation(samples, times):
    drive = Sampled(samples, RATE, "linear")
    np.testing.assert_allclose(
        drive(jnp.asarray(times)), np.interp(times, np.arange(COUNT) / RATE, samples), atol=1e-12
    )


def test_zero_order_is_the_sample_before(samples, times):
    drive = Sampled(samples, RATE, "zero_order")
    np.testing.assert_array_equal(drive(jnp.asarray(times)), samples[np.floor(times * RATE).astype(int)])
    np.testing.assert_array_equal(drive.rate(jnp.asarray(times)), 0.0)


@pytest.mark.parametrize("rate", [1000.0, 609.976, 37.0 / 3.0])
@pytest.mark.parametrize("hold", ["band_limited", "linear", "zero_order"])
def test_at_the_sampling_times_it_is_the_sample(samples, rate, hold):
    drive = Sampled(samples, rate, hold)
    np.testing.assert_allclose(drive(jnp.arange(COUNT) / rate), samples, atol=1e-9)


@pytest.mark.parametrize("hold", ["linear", "zero_order"])
def test_outside_the_record_it_keeps_the_nearest_sample(samples, hold):
    drive = Sampled(samples, RATE, hold)
    np.testing.assert_array_equal(drive(jnp.asarray([-3.0, -1e-3])), samples[0])
    np.testing.assert_array_equal(drive(jnp.asarray([2.0, 9.0])), samples[-1])


@pytest.mark.parametrize("hold", ["band_limited", "linear"])
def test_it_agrees_with_the_table_of_the_integration_stages(samples, hold):
    table, _ = tabulate(samples, RATE, hold, 4)
    drive = Sampled(samples, RATE, hold)
    stages = (np.arange(COUNT)[:, None] + np.arange(9) / 8.0) / RATE
    np.testing.assert_allclose(drive(jnp.asarray(stages))[:-1], table[:-1], atol=1e-10)


def test_too_short_a_record_is_refused():
    with pytest.raises(ValueError, match="at least 4 samples"):
        Sampled(np.zeros(3), RATE)
