"""Half power, phase resonance, circle fit and decrement against closed forms and the Brake-Reuss beam."""

import numpy as np
import pytest
import scipy.io

from isojax.identification.guess._circle_fit import fit_circle
from isojax.identification.guess._half_power import find_half_power, find_jumps, find_phase_resonance
from isojax.identification.guess._logarithmic_decrement import logarithmic_decrement

MASS, NATURAL = 800.0, 5.5
RATIOS = [0.01, 0.03, 0.1, 0.17]


def _linear(ratio):
    """Exact receptance over seven half-power widths."""
    frequency = NATURAL * np.linspace(max(0.3, 1 - 4 * ratio), 1 + 4 * ratio, 41)
    omega, natural = 2 * np.pi * frequency, 2 * np.pi * NATURAL
    return frequency, 1.0 / (MASS * (natural**2 - omega**2 + 2j * ratio * natural * omega))


@pytest.mark.parametrize("ratio", RATIOS)
def test_half_power_of_a_linear_receptance_is_the_closed_form_with_its_first_order_bias(ratio):
    found = find_half_power(*_linear(ratio))
    square = 1 - 2 * ratio**2 + np.array([-2, 2]) * ratio * np.sqrt(1 - ratio**2)
    lower, upper = NATURAL * np.sqrt(square)
    peak = NATURAL * np.sqrt(1 - 2 * ratio**2)
    assert found.lower == pytest.approx(lower, rel=1e-5)
    assert found.upper == pytest.approx(upper, rel=1e-5)
    assert found.peak_frequency == pytest.approx(peak, rel=1e-3 * ratio)
    assert found.damping_ratio == pytest.approx((upper - lower) / (2 * peak), rel=1e-3)
    assert found.damping_ratio / ratio - 1 == pytest.approx(2 * ratio**2, rel=0.15)
    assert found.peak_inside
    assert not found.jump_inside


@pytest.mark.parametrize("ratio", RATIOS)
def test_phase_resonance_of_a_linear_receptance_is_exact(ratio):
    assert find_phase_resonance(*_linear(ratio)) == pytest.approx(NATURAL, rel=1e-12)


@pytest.mark.parametrize("ratio", RATIOS)
def test_circle_fit_of_a_linear_receptance_is_exact(ratio):
    found = fit_circle(*_linear(ratio))
    assert found.damping_ratio == pytest.approx(ratio, rel=1e-8)
    assert found.natural_frequency == pytest.approx(NATURAL, rel=1e-10)
    assert found.diameter == pytest.approx(1 / (2 * ratio * 2 * np.pi * NATURAL * MASS), rel=1e-10)
    assert found.scatter < 1e-10


@pytest.mark.parametrize("ratio", RATIOS)
def test_a_linear_receptance_has_no_jump(ratio):
    assert not np.any(find_jumps(*_linear(ratio), MASS))


def test_a_fold_is_found_as_a_jump_in_the_gap_where_it_happens():
    # Harmonic balance of a hardening spring, (k_eq(X) - w^2)^2 + (c w)^2 = (F/X)^2, is a quadratic in w^2:
    # its smaller root is the upper branch, its larger one the lower branch as far down as the fold.
    force, damping = 0.3, 0.05
    amplitude = np.linspace(0.2, 6.0, 40000)
    stiffness = 1.0 + 0.75 * 0.05 * amplitude**2
    half = stiffness - damping**2 / 2
    real = half**2 - stiffness**2 + (force / amplitude) ** 2
    amplitude, half, real = amplitude[real >= 0], half[real >= 0], real[real >= 0]
    upper, lower = np.sqrt(np.maximum(half - np.sqrt(real), 0.0)), np.sqrt(half + np.sqrt(real))
    fold = int(np.argmin(lower))
    frequency = np.arange(0.8, 1.6, 0.025)
    jump = 0.5 * (lower[fold] + upper[-1])
    x = np.where(
        frequency < jump,
        np.interp(frequency, upper, amplitude),
        np.interp(frequency, lower[fold::-1], amplitude[fold::-1]),
    )
    receptance = 1.0 / (1.0 + 0.75 * 0.05 * x**2 - frequency**2 + 1j * damping * frequency)
    assert upper[-1] - lower[fold] > 0.05
    found = find_jumps(frequency / (2 * np.pi), receptance, 1.0)
    assert np.flatnonzero(found).tolist() == [int(np.flatnonzero(frequency >= jump)[0]) - 1]
    assert find_half_power(frequency / (2 * np.pi), receptance, found).jump_inside


def test_a_sweep_that_ends_too_early_gives_no_damping_ratio():
    frequency, receptance = _linear(0.03)
    kept = frequency < NATURAL * 1.01
    found = find_half_power(frequency[kept], receptance[kept])
    assert np.isfinite(found.lower)
    assert np.isnan(found.upper)
    assert np.isnan(found.damping_ratio)


def test_lines_that_do_not_increase_are_refused():
    frequency, receptance = _linear(0.03)
    with pytest.raises(ValueError, match=r"frequency\[1\]"):
        find_half_power(frequency[::-1], receptance)
    with pytest.raises(ValueError, match="at least 3"):
        find_half_power(frequency[:2], receptance[:2])


@pytest.mark.parametrize("ratio", [0.005, 0.03, 0.1])
def test_logarithmic_decrement_of_a_linear_decay_is_exact(ratio):
    time = np.arange(40000) / 1000.0
    natural = 2 * np.pi * 3.0
    decay = 1e-3 * np.exp(-ratio * natural * time) * np.sin(natural * np.sqrt(1 - ratio**2) * time + 0.4)
    found = logarithmic_decrement(decay, 1000.0)
    assert found.damping_ratio == pytest.approx(ratio, rel=1e-3)
    assert found.natural_frequency == pytest.approx(3.0, rel=1e-4)


def test_a_record_without_swings_has_no_decrement():
    found = logarithmic_decrement(np.exp(-np.arange(100.0)), 100.0)
    assert np.isnan(found.damping_ratio)


def _beam(shared_data, control):
    """Lines of the Brake-Reuss beam: frequency, receptance, largest acceleration."""
    content = scipy.io.loadmat(
        shared_data / "brb" / "ForcedFrequencyResponses.mat", squeeze_me=True, struct_as_record=False
    )
    for one in getattr(content["FRdata"], control):
        displacement = one.amplitude * np.exp(1j * one.phase) / (2 * np.pi * one.frequency) ** 2
        yield one.frequency, displacement / one.force, float(np.max(one.amplitude)), one.force


def test_damping_of_the_bolted_beam_rises_with_level(shared_data):
    lines = list(_beam(shared_data, "ResponseControl"))
    ratios = np.array(
        [find_half_power(frequency, receptance).damping_ratio for frequency, receptance, *_ in lines]
    )
    circles = np.array(
        [fit_circle(frequency, receptance).damping_ratio for frequency, receptance, *_ in lines]
    )
    assert np.all(np.diff([level for _, _, level, _ in lines]) > 0)
    assert np.all(np.diff(ratios) > 0)
    # Chen et al. 2022 (MSSP 166:108401): from about 0.0012 at 5 m/s^2 to 0.0062 at 80 m/s^2.
    assert ratios[0] == pytest.approx(0.0012, abs=5e-4)
    assert ratios[-1] == pytest.approx(0.0062, abs=5e-4)
    np.testing.assert_allclose(circles, ratios, rtol=0.05)


def test_the_measured_force_of_each_line_makes_the_receptance(shared_data):
    # Under response control the amplitude hardly varies: only the force of each line shows the resonance.
    for frequency, receptance, _, force in _beam(shared_data, "ResponseControl"):
        assert np.ptp(force) > np.min(force)
        found = find_half_power(frequency, receptance)
        nominal = find_half_power(frequency, receptance * force / np.mean(force))
        assert np.isfinite(found.damping_ratio)
        assert not np.isfinite(nominal.damping_ratio)
