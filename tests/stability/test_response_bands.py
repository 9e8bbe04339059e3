"""Response bands of a fitted model, compared with curves and errors by other routes."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.stats import norm

import isojax as ij
from isojax import RESULTS
from isojax.elements import LinearDamping, LinearStiffness
from isojax.models import FitAt, coefficient_errors


def with_errors(model, share):
    """A fit whose coefficients have independent relative errors."""
    names = tuple(one.name for one in model.parameters if one.name != "mass")
    errors = share * np.array([float(model[name]) for name in names])
    return FitAt(model, names, np.diag(errors**2), RESULTS.successful)


@pytest.fixture(scope="module")
def paper():
    fit = with_errors(ij.paper.y_direction(), 0.003)
    return fit, ij.response_bands(fit, [100.0, 175.0], (4.0, 6.5))


@pytest.mark.parametrize("excitation", ["force", "base_acceleration"])
def test_a_linear_isolator_has_the_response_and_the_errors_of_the_closed_form(excitation):
    model = ij.Isolator(800.0, (LinearStiffness(1e6), LinearDamping(4e3)), excitation)
    (curve,) = ij.response_bands(with_errors(model, 0.01), [2.0], (3.0, 12.0)).curves
    omega = 2.0 * np.pi * curve.frequency

    def closed_form(logarithms):
        k, c = 1e6 * jnp.exp(logarithms[0]), 4e3 * jnp.exp(logarithms[1])
        impedance = k + 1j * c * omega - 800.0 * omega**2
        size = 2.0 / jnp.abs(impedance) * (1.0 if excitation == "force" else 800.0)
        return jnp.stack([size, jnp.abs((k + 1j * c * omega) / impedance)])

    values = closed_form(jnp.zeros(2))
    errors = 0.01 * np.linalg.norm(jax.jacfwd(closed_form)(jnp.zeros(2)), axis=-1)
    for name, value, error in zip(("displacement", "transmissibility"), values, errors, strict=True):
        np.testing.assert_allclose(getattr(curve, name), value, rtol=2e-4)
        np.testing.assert_allclose(curve.standard_error[name], error, rtol=1e-2, atol=1e-4 * error.max())
    assert curve.stable.all()
    assert not curve.folds


@pytest.mark.parametrize("share", [0.98, 1.02])
def test_the_probability_of_a_fold_is_that_of_the_closed_form(share):
    """x'' + c x' + x + x^3 = F sin(w t) folds over w by one harmonic where c lies below a value c0.

    There w^2 - 1 = sqrt(3) c0 w and F^2 = 32 (w^2 - 1)^3 / 81.
    """
    rate = 1.1
    turning = (rate**2 - 1.0) / (np.sqrt(3.0) * rate)
    force = np.sqrt(32.0 * (rate**2 - 1.0) ** 3 / 81.0)
    damper = ij.LinearDamping(share * turning)
    model = ij.Isolator(1.0, (LinearStiffness(1.0), damper, ij.CubicStiffness(1.0)))
    fit = FitAt(
        model, ("linear_damping.coefficient",), np.array([[(0.03 * turning) ** 2]]), RESULTS.successful
    )
    found = ij.response_bands(fit, [0.5 * force, force, 2.0 * force], (0.95 / 6.2832, 1.4 / 6.2832))
    few, near, all_of_them = found.fold_probability
    assert (few, all_of_them) == (0.0, 1.0)
    assert near == pytest.approx(norm.cdf((1.0 - share) / 0.03), abs=4.0 * found.fold_probability_error[1])


def test_folds_and_their_intervals_are_those_of_continuation(paper):
    fit, found = paper
    (curve,) = (one for one in found.curves if one.amplitude == 175.0)

    def branch_folds(model):
        branch = ij.continue_branch(
            model, parameter="frequency", amplitude=175.0, start=4.0, stop=6.5, other_periods=()
        )
        return jnp.stack([one.frequency for one in branch.special_points if one.kind == "fold"])

    value, change = coefficient_errors(fit).carry(branch_folds)
    half = 1.96 * np.linalg.norm(change, axis=1)
    np.testing.assert_allclose([one.frequency for one in curve.folds], value, atol=2e-4)
    found = np.array([one.interval for one in curve.folds])
    np.testing.assert_allclose(found, np.stack([value - half, value + half], axis=1), atol=1e-3)
    assert not curve.stable.all()
    assert curve.stable[0]
    assert curve.stable[-1]


def test_the_band_is_that_of_a_single_orbit(paper):
    fit, found = paper
    curve = found.curves[0]
    place = int(np.argmin(np.abs(curve.frequency - 5.6)))

    def amplitude(model):
        drive = ij.Harmonic(curve.amplitude, float(curve.frequency[place]))
        return jnp.abs(ij.find_periodic_orbit(model, drive).harmonics[1])

    value, change = coefficient_errors(fit).carry(amplitude)
    np.testing.assert_allclose(curve.displacement[place], value, rtol=1e-3)
    np.testing.assert_allclose(curve.standard_error["displacement"][place], np.linalg.norm(change), rtol=0.01)


def test_the_picture_marks_both_folds_of_the_curve_that_has_them(paper):
    (ax,) = ij.plot.response_bands(paper[1]).axes
    marked = [line for line in ax.get_lines() if line.get_marker() not in ("None", "none", "", None)]
    assert sum(len(np.atleast_1d(line.get_xdata())) for line in marked) >= 2
    assert ax.get_xlabel() == "frequency [Hz]"


def test_frequencies_that_are_none_are_refused(paper):
    with pytest.raises(ValueError, match="`frequencies` must hold two different ones"):
        ij.response_bands(paper[0], [100.0], [5.0])
