"""What a sampled drive does between its samples, against the signal that was sampled."""

import numpy as np
import pytest

from isojax.excitations import tabulate

RATE, COUNT, SUBSTEPS = 1000.0, 4000, 2
LINES = [(100.0, 4.3, 0.4), (20.0, 37.0, 1.6), (3.0, 180.0, 2.9)]


def signal(t, derivative=0):
    """A sum of sines, or its derivative."""
    return sum(
        a * (2 * np.pi * f) ** derivative * np.sin(2 * np.pi * f * t + p + 0.5 * np.pi * derivative)
        for a, f, p in LINES
    )


def stages(count=COUNT, substeps=SUBSTEPS):
    """Times of the stages of each sample."""
    parts = 2 * substeps
    return (np.arange(count)[:, None] + np.arange(parts + 1) / parts) / RATE


@pytest.fixture(scope="module")
def samples():
    return signal(np.arange(COUNT) / RATE)


@pytest.fixture(scope="module")
def size():
    return sum(a for a, _, _ in LINES)


def test_band_limited_recovers_a_sum_of_sines_away_from_the_ends(samples, size):
    values, slopes = tabulate(samples, RATE, "band_limited", SUBSTEPS)
    inner = slice(500, -500)
    np.testing.assert_allclose(values[inner], signal(stages())[inner], atol=1e-7 * size)
    np.testing.assert_allclose(slopes[inner], signal(stages(), 1)[inner], atol=1e-7 * size * RATE)


def test_band_limited_passes_through_the_samples(samples, size):
    values, _ = tabulate(samples, RATE, "band_limited", SUBSTEPS)
    np.testing.assert_allclose(values[:, 0], samples, atol=1e-13 * size)
    np.testing.assert_allclose(values[:-1, -1], samples[1:], atol=1e-13 * size)


@pytest.mark.parametrize("end", [0, COUNT - 1])
def test_band_limited_keeps_its_documented_accuracy_at_the_ends(end):
    phase = 0.9
    t = np.arange(COUNT) / RATE

    def sine(t, derivative=0):
        return (2 * np.pi * 20.0) ** derivative * np.sin(
            2 * np.pi * 20.0 * t + phase + 0.5 * np.pi * derivative
        )

    values, slopes = tabulate(sine(t), RATE, "band_limited", SUBSTEPS)
    wrong = np.max(np.abs(values - sine(stages())), axis=1)
    slope_wrong = np.max(np.abs(slopes - sine(stages(), 1)), axis=1)
    bend = abs(sine(end / RATE, 2)) / RATE**2
    near, further = (0, 10) if end == 0 else (-2, -12)
    assert 0.030 * bend < wrong[near] < 0.038 * bend
    assert 0.20 * bend * RATE < slope_wrong[near] < 0.26 * bend * RATE
    assert wrong[further] < 0.012 * wrong[near]
    assert slope_wrong[further] < 0.012 * slope_wrong[near]


@pytest.mark.parametrize("count", [500, 501])
def test_band_limited_is_exact_for_a_drive_that_is_odd_about_its_ends(count):
    t = np.arange(count) / RATE
    frequency = 24.5 * RATE / (count - 1)

    def odd(t):
        return 3.0 + 2.0 * t + 5.0 * np.sin(2 * np.pi * frequency * t)

    values, _ = tabulate(odd(t), RATE, "band_limited", SUBSTEPS)
    np.testing.assert_allclose(values[:-1], odd(stages(count))[:-1], atol=2e-6)


@pytest.mark.parametrize("shift", [0.4e-3, 13.37e-3, -5.2e-3])
def test_band_limited_is_delayed_by_any_time(samples, size, shift):
    values, slopes = tabulate(samples, RATE, "band_limited", SUBSTEPS, shift)
    inner = slice(500, -500)
    np.testing.assert_allclose(values[inner], signal(stages() - shift)[inner], atol=1e-7 * size)
    np.testing.assert_allclose(slopes[inner], signal(stages() - shift, 1)[inner], atol=1e-7 * size * RATE)


@pytest.mark.parametrize(("shift", "skew"), [(0.0, 3e-3), (2.7e-3, -2e-3)])
def test_band_limited_is_delayed_by_a_time_that_grows(samples, size, shift, skew):
    values, slopes = tabulate(samples, RATE, "band_limited", SUBSTEPS, shift, skew)
    inner, acted = slice(500, -500), stages() * (1.0 - skew) - shift
    np.testing.assert_allclose(values[inner], signal(acted)[inner], atol=1e-7 * size)
    np.testing.assert_allclose(slopes[inner], signal(acted, 1)[inner], atol=1e-6 * size * RATE)


def test_a_delay_that_grows_is_the_growing_of_a_delay_at_the_ends_of_the_record_too(samples, size):
    for skew in (4e-3, -4e-3):
        values, slopes = tabulate(samples, RATE, "band_limited", SUBSTEPS, 0.0, skew)
        for place in (0, COUNT - 1):
            constant = tabulate(samples, RATE, "band_limited", SUBSTEPS, skew * place / RATE)
            for found, wanted, unit in ((values, constant[0], 1.0), (slopes, constant[1], RATE)):
                np.testing.assert_allclose(found[place, 0], wanted[place, 0], atol=1e-6 * size * unit)


@pytest.mark.parametrize("hold", ["linear", "zero_order"])
def test_a_drive_that_is_not_band_limited_is_delayed_by_a_time_that_grows(samples, hold):
    values, _ = tabulate(samples, RATE, hold, SUBSTEPS, 1e-3, 2e-3)
    place = (stages() * (1.0 - 2e-3) - 1e-3)[:, 1:-1] * RATE
    held = samples[np.clip(np.floor(place).astype(int), 0, COUNT - 1)]
    wanted = held if hold == "zero_order" else np.interp(place, np.arange(COUNT), samples)
    np.testing.assert_allclose(values[:, 1:-1], wanted, atol=1e-9)


@pytest.mark.parametrize("shift", [0.0, 0.4e-3, -2.1e-3])
def test_linear_is_straight_between_the_samples(samples, size, shift):
    values, slopes = tabulate(samples, RATE, "linear", SUBSTEPS, shift)
    times = stages() - shift
    expected = np.interp(times * RATE, np.arange(COUNT), samples)
    np.testing.assert_allclose(values, expected, atol=1e-12 * size)
    inner = slice(5, -5)
    middle = 0.5 * (times[:, 1:] + times[:, :-1])[inner]
    chord = np.diff(values, axis=1)[inner] * RATE * 2 * SUBSTEPS
    whole = np.floor(times[inner][:, :-1] * RATE + 1e-6) == np.floor(times[inner][:, 1:] * RATE - 1e-6)
    place = np.floor(middle * RATE).astype(int)
    np.testing.assert_allclose(chord[whole], ((samples[place + 1] - samples[place]) * RATE)[whole], atol=1e-6)
    place = np.floor(times[inner][:, 1:-1] * RATE + 1e-6).astype(int)
    np.testing.assert_allclose(
        slopes[inner][:, 1:-1], (samples[place + 1] - samples[place]) * RATE, atol=1e-6
    )


def test_linear_has_the_slope_of_its_own_interval_at_both_ends_of_it(samples):
    _, slopes = tabulate(samples, RATE, "linear", SUBSTEPS)
    expected = np.diff(samples)[:, None] * RATE * np.ones(2 * SUBSTEPS + 1)
    np.testing.assert_allclose(slopes[:-1], expected, rtol=1e-12)


def test_linear_is_flat_beyond_the_record(samples):
    values, slopes = tabulate(samples, RATE, "linear", SUBSTEPS, 3e-3)
    np.testing.assert_array_equal(values[:3], samples[0])
    np.testing.assert_array_equal(slopes[:3], 0.0)
    values, slopes = tabulate(samples, RATE, "linear", SUBSTEPS, -3e-3)
    np.testing.assert_array_equal(values[-3:], samples[-1])
    np.testing.assert_array_equal(slopes[-3:], 0.0)


def test_zero_order_keeps_the_sample_through_its_whole_interval(samples):
    values, slopes = tabulate(samples, RATE, "zero_order", SUBSTEPS)
    np.testing.assert_array_equal(values, samples[:, None] * np.ones(2 * SUBSTEPS + 1))
    np.testing.assert_array_equal(slopes, 0.0)


def test_zero_order_is_delayed_by_whole_samples_exactly_and_by_parts_at_the_stages(samples):
    values, _ = tabulate(samples, RATE, "zero_order", SUBSTEPS, 3e-3)
    np.testing.assert_array_equal(values[3:], samples[:-3, None] * np.ones(2 * SUBSTEPS + 1))
    np.testing.assert_array_equal(values[:3], samples[0])
    values, _ = tabulate(samples, RATE, "zero_order", SUBSTEPS, 0.4e-3)
    np.testing.assert_array_equal(values[1:, :2], samples[:-1, None] * np.ones(2))
    np.testing.assert_array_equal(values[1:, 2:], samples[1:, None] * np.ones(3))


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"values": np.zeros(3)}, r"`values` must be at least 4 samples, but has shape \(3,\)"),
        ({"values": np.array([0.0, 1.0, np.nan, 0.0])}, r"`values` must be finite, but values\[2\] = nan"),
        ({"rate": 0.0}, r"`rate` must be positive, but is 0.0"),
        ({"substeps": 0}, r"`substeps` must be positive, but is 0"),
        ({"hold": "zoh"}, r"`hold` must be one of .*, but is 'zoh'"),
    ],
)
def test_what_cannot_be_tabulated_is_refused(unchecked, changed, message):
    arguments = {"values": np.zeros(8), "rate": RATE, "hold": "linear", "substeps": 1}
    with pytest.raises(ValueError, match=message):
        tabulate(**(arguments | changed))
