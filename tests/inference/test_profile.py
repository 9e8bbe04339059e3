"""Profile likelihood against closed forms, scans by SciPy and the delta method."""

import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar
from scipy.stats import chi2 as chi2_law

import isojax as ij

DAMPER, SPRING = "linear_damping.coefficient", "linear_stiffness.coefficient"


@pytest.fixture(scope="module")
def damping(decay):
    return ij.profile(decay.fit, "c1")


def test_a_curved_interval_is_that_of_a_scan(decay, damping):
    lowest = minimize_scalar(decay.lowest, bounds=(100.0, 1500.0), method="bounded")
    # Spring, damper and the two states of the start are fitted.
    inflation = max(1.0, lowest.fun / (decay.time.size - 4))

    def above(value):
        return decay.lowest(value) - lowest.fun - inflation * chi2_law.ppf(0.95, 1)

    ends = [brentq(above, 50.0, lowest.x), brentq(above, lowest.x, 2000.0)]
    width = np.diff(damping.symmetric)
    np.testing.assert_allclose(damping.interval, ends, atol=0.004 * float(width[0]))
    # It is so curved that the symmetric one would not do.
    assert np.max(np.abs(damping.symmetric - ends)) > 0.02 * float(width[0])
    assert damping.reasons == ()


def test_each_point_is_the_best_that_the_others_can_make_of_it(decay, damping):
    lowest = minimize_scalar(decay.lowest, bounds=(100.0, 1500.0), method="bounded")
    inflation = max(1.0, lowest.fun / (decay.time.size - 4))
    rise = [(decay.lowest(value) - lowest.fun) / inflation for value in damping.values]
    np.testing.assert_allclose(np.abs(damping.root) ** 2, rise, atol=0.02)
    assert damping.others == (SPRING,)
    assert damping.best.shape == (damping.values.size, 1)
    assert np.all(np.diff(damping.root) > 0.0)


def test_a_straight_profile_is_the_interval_of_the_delta_method(decay):
    # The spring of a decay is its frequency: the phase grows in proportion to it.
    found = ij.profile(decay.fit, SPRING, confidence=0.68)
    width = float(np.diff(found.symmetric)[0])
    np.testing.assert_allclose(found.interval, found.symmetric, atol=0.01 * width)
    np.testing.assert_allclose(found.root, (found.values - found.value) / found.standard_error, atol=0.02)


def test_a_bound_ends_the_interval_and_is_named(decay):
    # So sure that the damper is almost nothing: a fit of the last second, where only noise is left.
    fit = decay.fit
    wide = fit._replace(
        estimate=fit.estimate._replace(
            uncertainty=fit.estimate.uncertainty._replace(
                standard_error=40.0 * fit.estimate.uncertainty.standard_error
            )
        )
    )
    found = ij.profile(wide, DAMPER)
    print(found, found.values, found.root)
    assert found.interval[0] == 0.0
    assert found.reasons[0] == (
        "The lower end: the bound of the coefficient is reached before chi2 has risen."
    )
    assert found.reasons[0] in repr(found)


def test_the_only_free_coefficient_needs_no_search(decay):
    alone = ij.fit(decay.fit.model, decay.fit.campaign, free=(DAMPER,))
    found = ij.profile(alone, DAMPER)
    assert found.others == ()
    assert np.all(np.isfinite(found.interval))
    assert found.interval[0] < found.value < found.interval[1]


def test_a_search_that_fails_is_named_and_has_no_end(decay, monkeypatch):
    from isojax.inference import _profile

    def failing(found, name, value, start, search):
        descent = real(found, name, value, start, search)
        away = name is not None and value > decay.fit.parameters["c1"].value
        return descent._replace(result=ij.RESULTS.not_converged) if away else descent

    real = _profile.fit_held
    monkeypatch.setattr(_profile, "fit_held", failing)
    found = ij.profile(decay.fit, "c1")
    assert np.isnan(found.interval[1])
    assert np.isfinite(found.interval[0])
    assert np.isnan(found.root[-1])
    assert "upper end: the search of the others failed. The search stopped before" in found.reasons[0]


def test_what_makes_no_sense_is_refused(decay):
    for name, words in (("k7", "none of the coefficients"), ("mass", "free coefficient .*was held")):
        with pytest.raises(ValueError, match=words):
            ij.profile(decay.fit, name)
    with pytest.raises(ValueError, match="`confidence` must lie"):
        ij.profile(decay.fit, "c1", confidence=95.0)
    with pytest.raises(ValueError, match="must have succeeded"):
        ij.profile(decay.fit._replace(result=ij.RESULTS.not_converged), "c1")


def test_the_picture_shows_both_intervals(damping):
    axes = ij.plot.show(damping).axes[0]
    straight, curved = axes.get_lines()[:2]
    limit = chi2_law.ppf(0.95, 1)
    for line, ends in ((straight, damping.symmetric), (curved, damping.interval)):
        x, y = line.get_data()
        inside = x[y < limit]
        np.testing.assert_allclose([inside.min(), inside.max()], ends, atol=3.0 * np.diff(x).max())
    assert axes.get_xlabel() == "linear damping [N s/m]"
