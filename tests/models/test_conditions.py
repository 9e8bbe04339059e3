"""An isolator at a pressure: its dependence goes into plain coefficients, as linear response shows."""

import math
from types import SimpleNamespace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.stats import norm

import isojax as ij
from isojax.elements import (
    CubicStiffness,
    LinearDamping,
    LinearStiffness,
    PressureCubicStiffness,
    PressureDamping,
    PressureStiffness,
    TemperatureDamping,
)
from isojax.models import FitAt, NormalMixture, coefficient_errors, fit_at

MASS, K, C, DK, DC, REFERENCE = 800.0, 1.08e6, 8e3, 7e5, 3e3, 2e5
FORCE, FREQUENCY = 10.0, 5.5
LAWS = (LinearStiffness(K), LinearDamping(C))
FOLLOWERS = (PressureStiffness(DK, REFERENCE), PressureDamping(DC, REFERENCE))
MODEL = ij.Isolator(MASS, (*LAWS, *FOLLOWERS))


def test_pressures_go_side_by_side_and_the_slope_by_pressure_is_that_of_the_coefficients():
    def force(pressure):
        model = MODEL.at(pressure=pressure)
        return model.restoring_force((jnp.asarray(2e-3), jnp.asarray(0.05)))

    pressures = np.array([1.5e5, 2e5, 2.7e5])
    slope = (DK * 2e-3 + DC * 0.05) / REFERENCE
    expected = K * 2e-3 + C * 0.05 + slope * (pressures - REFERENCE)
    np.testing.assert_allclose(jax.jit(jax.vmap(force))(jnp.asarray(pressures)), expected, rtol=1e-12)
    assert float(jax.jacfwd(force)(2.2e5)) == pytest.approx(slope, rel=1e-12)


def test_each_coefficient_changes_by_its_share_and_one_that_is_absent_appears():
    model = ij.Isolator(
        MASS,
        (
            *LAWS,
            PressureCubicStiffness(4e10, REFERENCE),
            TemperatureDamping(-5e3, 300.0),
            PressureStiffness(DK, REFERENCE),
        ),
    )
    at = model.at(pressure=2.5e5, temperature=330.0)
    assert [one.name for one in at.elements] == ["linear_stiffness", "linear_damping", "cubic_stiffness"]
    assert float(at["linear_stiffness.coefficient"]) == pytest.approx(K + 0.25 * DK)
    assert float(at["linear_damping.coefficient"]) == pytest.approx(C - 0.1 * 5e3)
    assert float(at["cubic_stiffness.coefficient"]) == pytest.approx(0.25 * 4e10)
    assert eqx.tree_equal(MODEL.at(pressure=REFERENCE), ij.Isolator(MASS, LAWS))


def test_a_stiffness_at_a_pressure_moves_with_its_slope():
    moved = ij.sensitivity(lambda model: model.at(pressure=2.4e5)["k1"], MODEL)
    assert float(moved.by("value", "pressure_stiffness.change")) == pytest.approx(0.2, rel=1e-12)
    assert float(moved.by("value", "k1")) == pytest.approx(1.0, rel=1e-12)


def test_the_force_in_a_record_is_that_of_the_isolator_at_its_pressure():
    model = ij.Isolator(
        MASS, (*LAWS, CubicStiffness(1e11), *FOLLOWERS, PressureCubicStiffness(4e10, REFERENCE))
    )
    state, zero = (jnp.asarray(2e-3), jnp.asarray(0.05)), jnp.asarray(0.0)
    followed = ij.models.Instant(zero, zero, {"pressure": jnp.asarray(2.6e5)})
    plain = ij.models.Instant(zero, zero)
    expected = model.at(pressure=2.6e5).acceleration(state, plain)
    assert float(model.acceleration(state, followed)) == pytest.approx(float(expected), rel=1e-12)


def test_a_curvature_bends_the_change_and_its_error_goes_along():
    bent = ij.Isolator(MASS, (*LAWS, PressureStiffness(DK, REFERENCE, 0.5)))
    at = bent.at(pressure=2.6e5)
    # By the square of the pressure: (1 + r)^2 - 1 = 2 (r + r^2 / 2).
    assert float(at["linear_stiffness.coefficient"]) == pytest.approx(K + 0.5 * DK * (1.3**2 - 1.0))
    free = ("linear_stiffness.coefficient", "pressure_stiffness.change", "pressure_stiffness.curvature")
    known = FitAt(bent, free, np.diag([9e6, 4e8, 1e-4]), ij.RESULTS.successful)
    there = fit_at(known, pressure=2.6e5)
    expected = 9e6 + (0.3 + 0.5 * 0.09) ** 2 * 4e8 + (0.09 * DK) ** 2 * 1e-4
    np.testing.assert_allclose(there.covariance, [[expected]], rtol=1e-12)


@pytest.mark.parametrize(
    "ask",
    [
        lambda: ij.stability_map(MODEL, np.linspace(1.0, 9.0, 3), np.linspace(4.0, 6.0, 3)),
        lambda: ij.find_periodic_orbit(MODEL, ij.Harmonic(FORCE, FREQUENCY)),
        lambda: ij.frequency_response(MODEL, FORCE, (4.0, 6.0)),
        lambda: ij.simulate(MODEL, ij.Harmonic(FORCE, FREQUENCY), duration=1.0),
        lambda: ij.stability.find_nearest_folds(MODEL, [1.0], [5.0], [[0.0, 0.0]]),
    ],
)
def test_what_has_no_pressure_says_how_to_give_one(ask):
    with pytest.raises(ValueError, match=r"at one pressure, .* such as model\.at\(pressure=\.\.\.\)"):
        ask()


@pytest.mark.parametrize(
    ("model", "conditions", "message"),
    [
        (MODEL, {}, r"`pressure` must be given"),
        (
            MODEL,
            {"pressure": 2e5, "temperature": 300.0},
            r"`temperature` must not be given.* follows pressure",
        ),
        (MODEL, {"pressure": 0.0}, r"`pressure` must be positive and finite, but is 0"),
        (MODEL, {"pressure": 2.4}, r"`pressure` must be absolute, in its SI unit, and within a factor of 10"),
        (MODEL, {"pressure": math.inf}, r"`pressure` must be positive and finite, but is inf"),
        (MODEL, {"pressure": [2e5, 3e5]}, r"`pressure` must be one real number, but has shape \(2,\)"),
        (MODEL, {"pressure": "2 bar"}, r"`pressure` must be one real number, but is '2 bar'"),
        (ij.Isolator(MASS, LAWS), {"pressure": 2e5}, r"`pressure` must not be given.* follows nothing"),
        (
            ij.Isolator(MASS, (*LAWS, PressureDamping(-DC, REFERENCE))),
            {"pressure": 8e5},
            r"at pressure=800000.0 they turn linear_damping from 8000 to -1000",
        ),
        (
            ij.Isolator(MASS, (*LAWS, PressureStiffness(DK, REFERENCE, 50.0))),
            {"pressure": 2.1e5},
            r"`pressure_stiffness.curvature` must lie from -10 to 10, but is 50",
        ),
    ],
)
def test_a_condition_that_is_missing_unknown_or_not_positive_is_refused(
    model, conditions, message, unchecked
):
    with pytest.raises(ValueError, match=message):
        model.at(**conditions)


def test_the_covariance_at_a_pressure_is_that_of_the_sum_of_both_coefficients():
    free = ("linear_damping.coefficient", "linear_stiffness.coefficient", "pressure_stiffness.change")
    covariance = np.array([[1e4, 0.0, 2e5], [0.0, 9e6, -2e7], [2e5, -2e7, 4e8]])
    fitted = FitAt(MODEL, free, covariance, ij.RESULTS.successful)
    there, share = fit_at(fitted, pressure=2.6e5), 0.3
    assert there.free == ("linear_stiffness.coefficient", "linear_damping.coefficient")
    expected = [[9e6 - 2.0 * share * 2e7 + share**2 * 4e8, share * 2e5], [share * 2e5, 1e4]]
    np.testing.assert_allclose(there.covariance, expected, rtol=1e-12)
    errors = coefficient_errors(there, there.model)
    np.testing.assert_allclose(errors.root @ errors.root.T, expected, rtol=1e-9)


def test_at_a_pressure_long_tails_add_up_as_they_are_correlated():
    """A tenth of the weight with errors four times as large, which all but cancel at the pressure."""
    free, weights = ("linear_stiffness.coefficient", "pressure_stiffness.change"), np.array([0.9, 0.1])
    whole = np.array([[9e6, 0.0], [0.0, 1e8]])
    rare = 16.0 * np.array([[9e6, -0.99 * 3e7], [-0.99 * 3e7, 1e8]])
    parts = np.stack([whole, rare])
    law = NormalMixture(weights, np.zeros((2, 2)), parts, np.zeros(2))

    def standard_error(slopes):
        spread = np.sqrt(np.einsum("i,pij,j->p", slopes, parts, slopes))
        width = brentq(
            lambda x: weights @ (2.0 * norm.cdf(x / spread) - 1.0) - 0.95, 0.0, 10.0 * spread.max()
        )
        return width / norm.ppf(0.975)

    sizes = np.array([standard_error(np.array(slopes)) for slopes in ([1.0, 0.0], [0.0, 1.0])])
    moment = np.einsum("p,pij->ij", weights, parts)
    scale = sizes / np.sqrt(np.diag(moment))
    fitted = FitAt(MODEL, free, moment * np.outer(scale, scale), ij.RESULTS.successful, law)
    there = fit_at(fitted, pressure=2.6e5)
    assert np.sqrt(there.covariance[0, 0]) == pytest.approx(standard_error(np.array([1.0, 0.3])), rel=1e-9)
    assert there.mixture.covariances[:, 0, 0] == pytest.approx(
        [9e6 + 0.09e8, 16.0 * (9e6 - 0.6 * 0.99 * 3e7 + 0.09e8)]
    )
    assert coefficient_errors(there).mixture is not None


def test_what_is_no_fit_has_none_at_a_pressure():
    with pytest.raises(ValueError, match="`fit` must be a fit, or end with one, but is of type SimpleNames"):
        fit_at(SimpleNamespace(after=None), pressure=2e5)


def test_a_response_is_drawn_at_one_pressure():
    fitted = FitAt(MODEL, ("linear_stiffness.coefficient",), np.array([[9e6]]), ij.RESULTS.successful)
    with pytest.raises(
        ValueError, match=r"`fit` must be at one pressure.*isojax.fit_at\(fit, pressure=...\)"
    ):
        ij.response_bands(fitted, [50.0], (4.0, 7.0))
