"""A record with fewer samples says the same of slow motion, and of jumps what models say of them."""

from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

from isojax.models._event_step import Jump, find_ringing
from isojax.records import Dwell, Record, thin_record, thinned_place, thinned_share

RATE = 1000.0


def _record(values: np.ndarray, **fields) -> Record:
    time = np.arange(values.size) / RATE
    return Record("one", Path("one.npz"), time, RATE, values, 2.0 * values, values, 2.0 * values, **fields)


@pytest.mark.parametrize("factor", [2, 3, 4, 9])
def test_a_sine_stays_where_it_was(factor):
    def wave(time):
        return np.sin(2.0 * np.pi * 7.3 * time + 0.4)

    dwells = Dwell(0, 1000, 7.3, 7.3), Dwell(1000, 1703, 7.3, 5.13)
    record = _record(wave(np.arange(1703) / RATE), settle=500, dwells=dwells, start=800)
    thin = thin_record(record, factor)
    # The record's own clock: where its first sample lay is where its dwells and its file say it lies.
    lost = thin_record(_record(np.arange(1703.0)), factor).input[0]
    expected = wave((lost + factor * np.arange(thin.input.size)) / RATE)
    # Its phase is kept. Its amplitude falls by up to a thirtieth of the square of its angle in a new sample.
    gain = float(thin.input @ expected / (expected @ expected))
    angle = 2.0 * np.pi * 7.3 * factor / RATE
    assert abs(1.0 - gain) < angle**2 / 29.0
    np.testing.assert_allclose(thin.input, gain * expected, atol=1e-12)
    np.testing.assert_allclose(thin.output, 2.0 * gain * expected, atol=1e-12)
    assert thin.rate == RATE / factor
    np.testing.assert_allclose(thin.time, np.arange(thin.input.size) * factor / RATE)
    for old, new in zip(dwells, thin.dwells, strict=True):
        first = lost + factor * new.start
        assert old.start <= first
        assert new.start == 0 or first - factor < old.start
        assert lost + factor * (new.stop - 1) < old.stop
        assert new.cycles == pytest.approx((new.stop - new.start) * factor / RATE * 7.3, rel=2e-3)
    assert thin.dwells[0].stop == thin.dwells[1].start
    assert lost + factor * thin.settle >= 500 > lost + factor * (thin.settle - 1)
    assert thin.start * factor == pytest.approx(800 + lost, abs=factor)


def test_white_noise_keeps_its_density():
    noise = np.random.default_rng(1).standard_normal(400_000)
    for factor in (2, 5):
        thin = thin_record(_record(noise), factor)
        spectrum = np.abs(np.fft.rfft(thin.input)) ** 2 / thin.input.size * factor
        inside = spectrum[: int(0.1 * spectrum.size)]
        assert np.mean(inside) == pytest.approx(1.0, abs=0.01 + 4.0 / np.sqrt(inside.size))
        assert np.var(thin.input) * factor == pytest.approx(thinned_share(factor), rel=0.01)


@pytest.mark.parametrize("share", [0.1, 0.5, 0.85])
def test_a_jump_is_what_simulated_readings_have_of_one(share):
    factor = 400
    jumped = (np.arange(20 * factor) >= (9.0 + share) * factor).astype(float)
    thin = thin_record(_record(jumped), factor).input
    ringing = find_ringing(Jump(jnp.asarray(share), jnp.asarray(1.0)), 0, 1)
    # The first sample of the record is lost, so that the jump lies between the ninth sample and the next.
    expected = np.where(np.arange(thin.size) > 8, 1.0, 0.0)
    expected[8:10] += float(ringing.before), float(ringing.after)
    np.testing.assert_allclose(thin, expected, atol=5e-3)


def test_one_sample_for_one_is_the_record_itself():
    record = _record(np.zeros(100))
    assert thin_record(record, 1) is record
    assert thinned_place(70, 2) == 34
