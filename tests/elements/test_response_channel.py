"""AC coupling and saturation of the response channel."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import signal

from isojax.elements import AcCoupling, Clipping, LinearDamping, LinearStiffness, SensorGain
from isojax.excitations import Harmonic
from isojax.models import Instant, Isolator, simulate

PLANT = (LinearStiffness(1.08e6), LinearDamping(1.0e4))
DRIVE = Harmonic(150.0, 4.3)
LAG = Isolator(800.0, PLANT)


@pytest.mark.parametrize("quantity", ["acceleration", "displacement"])
def test_ac_coupling_is_the_butterworth_high_pass_of_first_order(quantity):
    corner, rate = 0.4, 4000.0
    coupled = simulate(
        Isolator(800.0, (*PLANT, AcCoupling(corner, 0.0))), DRIVE, duration=3.0, rate=rate, quantity=quantity
    )
    plain = simulate(LAG, DRIVE, duration=3.0, rate=rate, quantity=quantity)
    analog = signal.butter(1, 2.0 * np.pi * corner, "highpass", analog=True)
    expected = signal.lsim(analog, np.asarray(plain.reading), np.asarray(plain.time))[1]
    np.testing.assert_allclose(coupled.displacement, plain.displacement, rtol=1e-12, atol=1e-18)
    np.testing.assert_allclose(coupled.reading, expected, atol=2e-6 * float(jnp.max(jnp.abs(plain.reading))))


@pytest.mark.parametrize("leak", [0.0, 0.1])
def test_ac_coupling_leads_in_phase_by_its_corner_over_the_frequency(leak):
    element, zero, one = AcCoupling(0.05, leak), jnp.zeros(()), jnp.ones(())
    own = jax.jacfwd(lambda s: element.reading_rate(zero, (s,))[0])(zero)
    inward = jax.jacfwd(lambda y: element.reading_rate(y, (zero,))[0])(zero)
    out = element.reading(zero, (one,))
    frequency = np.array([3.0, 5.0, 9.0])
    response = 1.0 + out * inward / (2j * np.pi * frequency - own)
    np.testing.assert_allclose(response, (1j * frequency + leak) / (1j * frequency + 0.05 + leak), rtol=1e-12)
    np.testing.assert_allclose(np.angle(response), 0.05 / frequency, rtol=3e-3)


def test_instruments_before_the_coupling_act_on_what_it_follows():
    state, u = (jnp.asarray(1e-3), jnp.asarray(0.02), jnp.asarray(0.004)), jnp.asarray(40.0)
    before = Isolator(800.0, (*PLANT, SensorGain(1.0), AcCoupling(0.3, 0.0)))
    after = Isolator(800.0, (*PLANT, AcCoupling(0.3, 0.0), SensorGain(1.0)))
    wc = 2.0 * np.pi * 0.3
    np.testing.assert_allclose(before.rates(state, Instant(u), "velocity")[2], 0.04 - wc * 0.004, rtol=1e-12)
    np.testing.assert_allclose(after.rates(state, Instant(u), "velocity")[2], 0.02 - wc * 0.004, rtol=1e-12)
    np.testing.assert_allclose(
        after.reading(state, Instant(u), "velocity"), 2.0 * (0.02 - wc * 0.004), rtol=1e-12
    )


@pytest.mark.parametrize("share", [1.0, 0.4])
def test_clipping_loses_its_share_beyond_the_level_of_either_sign(share):
    y = jnp.asarray([-3.0, -2.0, -0.5, 0.0, 1.9, 2.1, 5.0])
    beyond = np.array([-1.0, 0.0, 0.0, 0.0, 0.0, 0.1, 3.0])
    np.testing.assert_allclose(Clipping(share, 2.0, 2.0).reading(y, ()), y - share * beyond, rtol=1e-13)


def test_the_ends_of_a_clipped_range_need_not_be_alike():
    y = jnp.asarray([-3.0, -0.6, -0.5, 0.0, 1.9, 2.1, 5.0])
    np.testing.assert_allclose(Clipping(1.0, 2.0, 0.5).reading(y, ()), [-0.5, -0.5, -0.5, 0.0, 1.9, 2.0, 2.0])


def test_a_clipped_record_is_the_clip_of_the_plain_one():
    clipped = simulate(Isolator(800.0, (*PLANT, Clipping(1.0, 0.15, 0.1))), DRIVE, duration=1.0)
    plain = simulate(LAG, DRIVE, duration=1.0)
    assert float(jnp.max(plain.reading)) > 0.2
    np.testing.assert_allclose(clipped.reading, np.clip(plain.reading, -0.1, 0.15), rtol=1e-12, atol=1e-15)
