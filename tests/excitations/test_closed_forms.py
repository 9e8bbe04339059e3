"""Each excitation against its formula, and its derivative against the derivative of that formula."""

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.signal import chirp

from isojax.excitations import Harmonic, Multisine, SteppedSine, SweptSine, random_phase_multisine

T = np.linspace(0.0, 6.0, 1201)


def test_harmonic_is_a_sine_of_phase_zero():
    drive = Harmonic(150.0, 4.3)
    omega = 2 * np.pi * 4.3
    np.testing.assert_allclose(drive(jnp.asarray(T)), 150.0 * np.sin(omega * T), atol=1e-11)
    np.testing.assert_allclose(drive.rate(jnp.asarray(T)), 150.0 * omega * np.cos(omega * T), atol=1e-9)


def test_stepped_sine_dwells_whole_cycles_at_each_frequency():
    frequencies, cycles = np.array([4.0, 5.0, 4.5]), 7.0
    drive = SteppedSine(80.0, jnp.asarray(frequencies), cycles)
    edges = np.concatenate([[0.0], np.cumsum(cycles / frequencies)])
    np.testing.assert_allclose(drive.starts, edges[:-1], rtol=1e-14)
    np.testing.assert_allclose(drive.duration, edges[-1], rtol=1e-14)
    for start, stop, frequency in zip(edges[:-1], edges[1:], frequencies, strict=True):
        t = np.linspace(start + 1e-9, stop - 1e-9, 100)
        np.testing.assert_allclose(
            drive(jnp.asarray(t)), 80.0 * np.sin(2 * np.pi * frequency * (t - start)), atol=1e-9
        )


def test_stepped_sine_is_continuous_at_each_step_even_after_broken_cycles():
    drive = SteppedSine(80.0, jnp.asarray([4.0, 5.0, 4.5]), 6.3)
    edges = np.asarray(drive.starts)[1:]
    before, after = drive(jnp.asarray(edges - 1e-9)), drive(jnp.asarray(edges + 1e-9))
    np.testing.assert_allclose(before, after, atol=80.0 * 2 * np.pi * 5.0 * 3e-9)


def test_stepped_sine_keeps_its_last_frequency_after_the_end():
    drive = SteppedSine(80.0, jnp.asarray([4.0, 5.0]), 4.0)
    t = float(drive.duration) + np.linspace(0.0, 1.0, 50)
    np.testing.assert_allclose(drive(jnp.asarray(t)), 80.0 * np.sin(2 * np.pi * 5.0 * (t - 1.0)), atol=1e-9)


@pytest.mark.parametrize("law", ["linear", "logarithmic"])
def test_swept_sine_is_scipys_chirp(law):
    drive = SweptSine(80.0, 2.0, 9.0, 6.0, law)
    expected = 80.0 * chirp(T, 2.0, 6.0, 9.0, law, phi=-90.0)
    np.testing.assert_allclose(drive(jnp.asarray(T)), expected, atol=1e-9)


@pytest.mark.parametrize("law", ["linear", "logarithmic"])
def test_swept_sine_has_the_derivative_of_its_phase(law):
    drive = SweptSine(80.0, 2.0, 9.0, 6.0, law)
    frequency = 2.0 + 7.0 * T / 6.0 if law == "linear" else 2.0 * 4.5 ** (T / 6.0)
    quadrature = 80.0 * chirp(T, 2.0, 6.0, 9.0, law, phi=0.0)
    np.testing.assert_allclose(drive.rate(jnp.asarray(T)), 2 * np.pi * frequency * quadrature, atol=1e-7)


def test_a_swept_sine_of_an_unknown_law_is_refused(unchecked):
    with pytest.raises(ValueError, match=r"`law` must be .*, but is 'log'"):
        SweptSine(80.0, 2.0, 9.0, 6.0, "log")


@pytest.mark.parametrize("shape", [(), (4,), (2, 3)])
def test_multisine_is_the_sum_of_its_lines_in_any_shape(shape):
    frequencies, phases = np.array([1.0, 2.5, 4.0]), np.array([0.3, 1.1, 5.0])
    t = np.random.default_rng(2).uniform(0.0, 6.0, shape)
    found = Multisine(3.0, jnp.asarray(frequencies), jnp.asarray(phases))(jnp.asarray(t))
    expected = sum(3.0 * np.sin(2 * np.pi * f * t + p) for f, p in zip(frequencies, phases, strict=True))
    assert found.shape == shape
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_random_phase_multisine_fills_the_band_with_lines_of_one_amplitude():
    drive = random_phase_multisine(2.0, 8.0, 1.0, 20.0, odd=False, seed=3)
    t = np.arange(8 * 128) / 128.0
    spectrum = np.abs(np.fft.rfft(np.asarray(drive(jnp.asarray(t))))) * 2.0 / t.size
    band = np.arange(spectrum.size) / 8.0
    inside = (band >= 1.0) & (band <= 20.0)
    np.testing.assert_allclose(spectrum[inside], 2.0, rtol=1e-10)
    np.testing.assert_allclose(spectrum[~inside], 0.0, atol=1e-10)


def test_an_odd_multisine_turns_its_sign_after_half_a_period():
    drive = random_phase_multisine(2.0, 8.0, 1.0, 20.0, odd=True, seed=3)
    t = np.linspace(0.0, 4.0, 301)
    np.testing.assert_allclose(drive(jnp.asarray(t + 4.0)), -drive(jnp.asarray(t)), atol=1e-10)


def test_the_seed_decides_the_phases():
    one, same, other = (random_phase_multisine(2.0, 8.0, 1.0, 20.0, odd=False, seed=s) for s in (3, 3, 4))
    np.testing.assert_array_equal(one.phases, same.phases)
    assert not np.array_equal(one.phases, other.phases)


def test_a_band_without_a_line_is_refused():
    with pytest.raises(
        ValueError, match=r"must enclose a multiple of 1/period = 0.125 Hz, but are 1.01 and 1.05"
    ):
        random_phase_multisine(2.0, 8.0, 1.01, 1.05, odd=False, seed=3)
