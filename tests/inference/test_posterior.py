"""Draws of the posterior against quadrature by SciPy, and the delta method."""

import sys

import numpy as np
import pytest

import isojax as ij
from isojax.identification.fitting import Likelihood

DAMPER, SPRING = "linear_damping.coefficient", "linear_stiffness.coefficient"


@pytest.fixture(scope="module")
def found(decay):
    said = []
    answer = ij.posterior(decay.fit, draws=60, warmup=30, seed=4, progress=said.append)
    assert said[-1] == "180 of 180 draws"
    assert said[-1].done == 1.0
    return answer


def test_the_draws_have_the_moments_of_quadrature(decay, found):
    fitted = [decay.fit.parameters[name] for name in (DAMPER, SPRING)]
    values, others = (one.value + np.linspace(-5.0, 5.0, 61) * one.standard_error for one in fitted)
    chi2 = np.array([[decay.chi2(value, other) for other in others] for value in values])
    weight = np.exp(-0.5 * (chi2 - chi2.min())).sum(axis=1)
    weight /= weight.sum()
    mean = weight @ values
    spread = np.sqrt(weight @ (values - mean) ** 2)
    place = [one.name for one in found.coefficients].index(DAMPER)
    error = spread / np.sqrt(found.effective_draws[place])
    assert found.effective_draws[place] > 40.0
    assert found.mean[place] == pytest.approx(mean, abs=4.0 * error)
    assert found.standard_error[place] == pytest.approx(
        spread, rel=4.0 / np.sqrt(found.effective_draws[place])
    )
    assert np.all(found.r_hat < 1.05)
    assert found.divergent == 0
    assert "2 chains of 60 draws" in repr(found)


def test_the_likelihood_is_that_of_the_closed_form(decay):
    fit = decay.fit
    likelihood = Likelihood(fit.estimate)
    damper, spring = (fit.parameters[name] for name in (DAMPER, SPRING))

    def both(a, b):
        one, other = damper.value + a * damper.standard_error, spring.value + b * spring.standard_error
        values = np.array([{DAMPER: one, SPRING: other}[name] for name in fit.free])
        return likelihood(values)[0], -0.5 * decay.chi2(one, other)

    at_fit = both(0.0, 0.0)
    for place in ((1.0, 0.0), (-1.5, 1.0), (2.0, 2.0)):
        found, expected = np.subtract(both(*place), at_fit)
        assert found == pytest.approx(expected, abs=0.01)


def test_the_gradient_is_the_slope_of_the_likelihood(decay):
    fit = decay.fit
    likelihood = Likelihood(fit.estimate)
    at = np.array([fit.parameters[name].value for name in fit.free])
    errors = fit.estimate.uncertainty.standard_error
    for away in (np.array([0.7, -1.0]), np.array([-1.5, 1.5])):
        here = at + away * errors
        slope = likelihood(here)[1] * errors
        steps = 1e-3 * np.diag(errors)
        moved = [(likelihood(here + step)[0] - likelihood(here - step)[0]) / 2e-3 for step in steps]
        np.testing.assert_allclose(slope, moved, atol=0.05)


def test_without_the_extra_the_error_says_how_to_install_it(decay, monkeypatch):
    monkeypatch.setitem(sys.modules, "numpyro.infer", None)
    with pytest.raises(ImportError, match=r'pip install "isojax\[bayes\]"'):
        ij.posterior(decay.fit)


def test_what_makes_no_sense_is_refused(decay):
    with pytest.raises(ValueError, match="`draws` must be at least 10"):
        ij.posterior(decay.fit, draws=1)
    with pytest.raises(ValueError, match="`chains` must be at least 2"):
        ij.posterior(decay.fit, chains=1)
    with pytest.raises(ValueError, match="must have succeeded"):
        ij.posterior(decay.fit._replace(result=ij.RESULTS.not_converged))


def test_the_picture_is_of_the_coefficient_that_is_asked_for(found):
    axes = ij.plot.posterior(found, "c1").axes[0]
    assert axes.get_xlabel() == "linear damping [N s/m]"
    with pytest.raises(ValueError, match="must be one of"):
        ij.plot.posterior(found, "k9")
