"""A record with fewer samples says the same of what lies below half its new rate."""

from pathlib import Path

import numpy as np
import pytest

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
    np.testing.assert_allclose(thin.input, expected, atol=2e-5)
    np.testing.assert_allclose(thin.output, 2.0 * expected, atol=4e-5)
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
        inside = spectrum[: int(0.6 * spectrum.size)]
        assert np.mean(inside) == pytest.approx(1.0, abs=4.0 / np.sqrt(inside.size))
        assert np.var(thin.input) * factor == pytest.approx(thinned_share(factor), rel=0.01)


def test_what_lies_above_half_the_new_rate_is_gone():
    wave = np.sin(2.0 * np.pi * 200.0 * np.arange(4000) / RATE)
    assert np.max(np.abs(thin_record(_record(wave), 4).input)) < 1e-4


def test_one_sample_for_one_is_the_record_itself():
    record = _record(np.zeros(100))
    assert thin_record(record, 1) is record
    assert thinned_place(70, 2) == 25
