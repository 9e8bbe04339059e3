"""Profile likelihood against closed forms, scans by SciPy and the delta method."""

import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar
from scipy.stats import chi2 as chi2_law

import isojax as ij
from isojax.demo import campaign_folder
from isojax.inference import _profile
from isojax.inference._profile import _Held, _walk

BOUND = "the bound of the coefficient is reached before chi2 has risen."
DAMPER, SPRING = "linear_damping.coefficient", "linear_stiffness.coefficient"


@pytest.fixture(scope="module")
def damping(decay):
    return ij.profile(decay.fit, "c1")


@pytest.fixture(scope="module")
def beside_friction():
    campaign = ij.read_campaign(campaign_folder())
    start = ij.classical_guess(campaign).model.with_elements(ij.CoulombFriction(25.0, 1.6e-4))
    return ij.fit(start, campaign)


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


@pytest.mark.parametrize("name", [SPRING, DAMPER])
def test_a_straight_profile_is_the_interval_of_the_delta_method(sharp_decay, name):
    found = ij.profile(sharp_decay.fit, name)
    np.testing.assert_allclose(found.interval, found.symmetric, atol=5e-3 * np.diff(found.symmetric)[0])
    straight = (found.values - found.value) / found.standard_error
    np.testing.assert_allclose(found.root, straight, atol=0.02)


@pytest.mark.slow
def test_the_ends_are_those_of_uncertainty_at_any_confidence():
    """Of few records: the tails of the law that they allow count in both."""
    campaign = ij.read_campaign(campaign_folder())
    fit = ij.fit(ij.classical_guess(campaign).model, campaign)
    for level in (0.8, 0.99):
        found = ij.profile(fit, "k1", confidence=level)
        band = ij.uncertainty(fit, lambda m: m["k1"], confidence=level).interval
        np.testing.assert_allclose(found.symmetric, band, rtol=1e-9)
        factor = (band[1] - found.value) / found.standard_error
        assert found.coverage_factor == pytest.approx(factor, rel=1e-9)
        assert np.all(np.abs(np.interp(found.interval, found.values, found.root)) > 0.9 * factor)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["Fc", "k3"])
def test_dry_friction_does_not_keep_it_from_an_end(beside_friction, name):
    """Initial states beside a kink would take chi2 up and down by more than the ends are away."""
    found = ij.profile(beside_friction, name)
    assert found.reasons == ()
    assert np.all(np.diff(found.root) > 0.0)
    # So many records and samples make the model all but linear in its coefficients.
    np.testing.assert_allclose(found.interval, found.symmetric, atol=0.1 * found.standard_error)
    truth = {"Fc": 30.0, "k3": 1.5e11}[name]
    assert found.interval[0] < truth < found.interval[1]


def walk(root, room=np.inf, fails_beyond=np.inf):
    """Go out along a profile that is known in closed form."""

    def hold(away, near):
        result = ij.RESULTS.not_finite if away > fails_beyond else ij.RESULTS.successful
        return _Held(away, root(away), near), result

    return _walk(_Held(0.0, 0.0, None), hold, 1.0, 1.96, room)


def test_the_walk_ends_where_a_known_profile_does():
    straight = walk(lambda away: away)
    assert straight.end == pytest.approx(1.96)
    assert len(straight.points) == 3
    assert straight.reason == ""
    assert walk(lambda away: away + 0.3 * away**2).end == pytest.approx(
        (np.sqrt(3.352) - 1.0) / 0.6, rel=2e-3
    )
    assert walk(lambda away: 4.0 * np.tanh(away / 8.0)).end == pytest.approx(8.0 * np.arctanh(0.49), rel=5e-3)


def test_a_walk_that_cannot_go_on_says_why():
    assert walk(lambda away: away, room=1.5)[1:] == ((), 1.5, BOUND)
    assert walk(lambda away: away, room=0.0)[1:] == ((), 0.0, BOUND)
    bent = walk(lambda away: away * (2.0 - away))
    assert np.isnan(bent.end)
    assert "another minimum" in bent.reason
    lost = walk(lambda away: away, fails_beyond=1.5)
    assert lost.lost == (pytest.approx(1.96),)
    assert "the search of the others failed. The simulated response left" in lost.reason
    flat = walk(np.arctan)
    assert np.isnan(flat.end)
    assert "not risen enough after 12 points" in flat.reason


def test_the_only_free_coefficient_needs_no_search(decay):
    alone = ij.fit(decay.fit.model, decay.fit.campaign, free=(DAMPER,))
    found = ij.profile(alone, DAMPER)
    assert found.others == ()
    assert np.all(np.isfinite(found.interval))
    assert found.interval[0] < found.value < found.interval[1]


def test_a_search_that_fails_has_no_end_and_is_in_the_row(decay, monkeypatch):
    real = _profile.fit_held

    def failing(found, name, value, start, search):
        descent = real(found, name, value, start, search)
        away = name is not None and value > decay.fit.parameters["c1"].value
        return descent._replace(result=ij.RESULTS.not_converged) if away else descent

    monkeypatch.setattr(_profile, "fit_held", failing)
    found = ij.profile(decay.fit, "c1")
    assert np.isnan(found.interval[1])
    assert np.isfinite(found.interval[0])
    assert np.isnan(found.root[-1])
    assert found.reasons[0].startswith("The upper end: the search of the others failed.")
    assert "upper end  not found" in repr(found)
    assert "upper end: the search" in repr(found)


def test_what_makes_no_sense_is_refused(decay):
    for name, words in (("k7", "none of the coefficients"), ("mass", "free coefficient .*was held")):
        with pytest.raises(ValueError, match=words):
            ij.profile(decay.fit, name)
    with pytest.raises(ValueError, match="`confidence` must lie"):
        ij.profile(decay.fit, "c1", confidence=95.0)
    with pytest.raises(ValueError, match="must have succeeded"):
        ij.profile(decay.fit._replace(result=ij.RESULTS.not_converged), "c1")


def test_the_picture_shows_both_intervals(damping):
    axes = ij.plot.profile(damping).axes[0]
    straight, curved = axes.get_lines()[:2]
    limit = chi2_law.ppf(0.95, 1)
    for line, ends in ((straight, damping.symmetric), (curved, damping.interval)):
        x, y = line.get_data()
        inside = x[y < limit]
        np.testing.assert_allclose([inside.min(), inside.max()], ends, atol=3.0 * np.diff(x).max())
    assert axes.get_xlabel() == "linear damping [N s/m]"
