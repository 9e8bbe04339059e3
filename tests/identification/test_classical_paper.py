"""The classical route's arithmetic against the numbers that the paper prints."""

import numpy as np
import pytest
from scipy.integrate import quad

from isojax.identification.guess._equivalent_coefficients import (
    HARMONIC_FACTORS,
    equivalent_coefficients,
    invert_equivalent,
    normalised_law,
)
from isojax.identification.guess._equivalent_law import average_law, fit_equivalent_law

# Printed polynomials, forward and backward; averages; laws: the paper, eqs. (10)-(28). Eq. (21) prints
# -3.418e7, where its average (22) needs -3.418e6.
PRINTED = {
    "y stiffness": (
        [[1.087e6, -5.724e8, 1.817e11], [1.074e6, -6.115e8, 1.958e11]],
        [1.0805e6, -5.9195e8, 1.8875e11],
        [1.0805e6, -6.974e8, 2.51667e11],
    ),
    "y damping": (
        [[1.009e4, -3.212e5, 4.166e6], [1.045e4, -3.049e5, 3.897e6]],
        [1.027e4, -3.1305e5, 4.0315e6],
        [1.027e4, -3.6880e5, 5.3753e6],
    ),
    "z stiffness": (
        [[1.424e5, -3.817e5, -3.016e6], [1.404e5, -3.189e5, -3.418e6]],
        [1.414e5, -3.503e5, -3.217e6],
        [1.414e5, -4.126e5, -4.289e6],
    ),
    "z damping": (
        [[2656.0, -1252.0, 526.1], [2620.0, -1114.0, 592.2]],
        [2638.0, -1183.0, 559.15],
        [2638.0, -1393.0, 745.533],
    ),
}


@pytest.mark.parametrize("case", PRINTED)
def test_averages_and_laws_are_those_that_the_paper_prints(case):
    polynomials, average, law = PRINTED[case]
    found = average_law(np.array(polynomials))
    np.testing.assert_allclose(found.average, average, rtol=1e-12)
    # The paper prints four to six digits of each law, and rounds 1393.6 down to 1393.
    np.testing.assert_allclose(found.law, law, rtol=5e-4)


@pytest.mark.parametrize(
    ("law", "amplitude", "printed"),
    [
        # Eqs. (14), (19), (24), (29). Eq. (24) prints +0.003 where its own (23) is negative.
        ([1.0805e6, -6.974e8, 2.51667e11], 1e-3, [1.0, -0.6454, 0.2329]),
        ([1.027e4, -3.6880e5, 5.3753e6], 1e-2, [1.0, -0.3591, 0.0523]),
        ([1.414e5, -4.126e5, -4.289e6], 1e-2, [1.0, -0.0292, -0.0030]),
        ([2638.0, -1393.0, 745.533], 1e-1, [1.0, -0.0528, 0.0028]),
    ],
)
def test_normalised_laws_are_those_that_the_paper_prints(law, amplitude, printed):
    np.testing.assert_allclose(normalised_law(np.array(law), amplitude), printed, atol=6e-5)


@pytest.mark.parametrize("power", [1, 2, 3])
def test_harmonic_factors_are_first_fourier_coefficients(power):
    def projected(phase):
        sine = np.sin(phase)
        return np.sign(sine) ** (power + 1) * sine**power * sine

    integral, _ = quad(projected, 0.0, 2 * np.pi, points=[np.pi])
    assert HARMONIC_FACTORS[power - 1] == pytest.approx(integral / np.pi, rel=1e-12)


def test_inversion_undoes_the_equivalent_coefficients():
    law = np.array([1.1, -2.2, 3.3])
    np.testing.assert_allclose(invert_equivalent(equivalent_coefficients(law)), law, rtol=1e-15)


def test_normalised_law_refuses_what_has_no_linear_part():
    with pytest.raises(ValueError, match="linear coefficient"):
        normalised_law(np.array([0.0, 1.0]), 1.0)
    with pytest.raises(ValueError, match="must be positive"):
        normalised_law(np.array([1.0, 1.0]), 0.0)


def _points(amplitudes):
    amplitude = np.asarray(amplitudes)
    return np.stack([amplitude, 5.0 - 2.0 * amplitude + 0.5 * amplitude**2], axis=1)


def test_four_levels_recover_the_quadratic_without_a_note():
    law, notes = fit_equivalent_law({"forward": _points([0.5, 1.0, 1.5, 2.0])}, "stiffness")
    assert law is not None
    np.testing.assert_allclose(law.average, [5.0, -2.0, 0.5], rtol=1e-10)
    assert notes == ()


@pytest.mark.parametrize(
    ("amplitudes", "words", "zeros"),
    [([1.0, 1.5, 2.0], "exactly", 0), ([1.0, 1.001, 2.0], "straight line", 1), ([1.0], "constant", 2)],
)
def test_too_few_levels_lower_the_order_and_are_said(amplitudes, words, zeros):
    law, notes = fit_equivalent_law({"forward": _points(amplitudes)}, "stiffness")
    assert law is not None
    assert np.count_nonzero(law.average == 0) == zeros
    assert len(notes) == 1
    assert words in notes[0]


def test_records_without_a_resonance_do_not_count():
    rows = _points([0.5, 1.0, 1.5, 2.0])
    rows[2, 1] = np.nan
    law, _ = fit_equivalent_law({"forward": rows}, "damping")
    assert law is not None
    np.testing.assert_allclose(law.average, [5.0, -2.0, 0.5], rtol=1e-10)
    nothing, notes = fit_equivalent_law({"forward": rows[2:3]}, "damping")
    assert nothing is None
    assert "no record" in notes[0].lower()
