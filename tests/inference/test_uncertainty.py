"""The error of a fit carried into quantities, against closed forms and central differences."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.stats import chi2, norm, truncnorm

import isojax as ij
from isojax.demo import campaign_folder
from isojax.models import credible_set

STIFFNESS, DAMPING = "linear_stiffness.coefficient", "linear_damping.coefficient"


@pytest.fixture(scope="module")
def fit():
    """A fit to the demo, from a start next to it: its covariance is what counts here."""
    campaign = ij.read_campaign(campaign_folder())
    return ij.fit(ij.classical_guess(campaign).model, campaign)


@pytest.fixture(scope="module")
def wide(fit, tmp_path_factory):
    """The same, saved, with a linear stiffness that is uncertain by a tenth, alone."""
    path = tmp_path_factory.mktemp("fit") / "fit.json"
    fit.save(path)
    saved = ij.load_fit(path)
    covariance = np.zeros_like(saved.covariance)
    place = saved.free.index(STIFFNESS)
    covariance[place, place] = (0.1 * float(saved.model[STIFFNESS])) ** 2
    return saved._replace(covariance=covariance, mixture=None)


def test_of_a_linear_quantity_the_error_is_that_of_the_covariance(fit):
    weights = np.zeros(len(fit.free))
    weights[fit.free.index(STIFFNESS)], weights[fit.free.index(DAMPING)] = 2.0, -30.0
    found = ij.uncertainty(fit, lambda model: 2.0 * model[STIFFNESS] - 30.0 * model[DAMPING])
    expected = np.sqrt(weights @ fit.covariance @ weights)
    assert float(found.standard_error) == pytest.approx(expected, rel=1e-9)
    assert not found.curved.any()
    np.testing.assert_allclose(found.interval - found.value, norm.ppf([0.025, 0.975]) * expected, rtol=1e-9)
    assert np.std(found.draws) == pytest.approx(expected, rel=0.1)
    assert found.failed == 0.0


def test_a_dict_keeps_its_names(fit):
    found = ij.uncertainty(
        fit, lambda model: {"spring": model[STIFFNESS], "rate": model[DAMPING] / model.mass}
    )
    assert found.names == ("spring", "rate")
    errors = [fit.standard_errors[STIFFNESS], fit.standard_errors[DAMPING] / float(fit.model.mass)]
    np.testing.assert_allclose(found.standard_error, errors, rtol=1e-9)
    assert "\n  spring " in repr(found)
    with pytest.raises(ValueError, match="a dict of single numbers, but gives an array as 'spring'"):
        ij.uncertainty(fit, lambda model: {"spring": model[STIFFNESS] * np.ones(2)})


def test_of_what_is_least_at_the_fit_the_interval_begins_there(wide):
    """A distance squared of one normal coefficient: chi-square of one degree of freedom."""
    stiffness = float(wide.model[STIFFNESS])
    found = ij.uncertainty(wide, lambda model: ((model[STIFFNESS] - stiffness) / (0.1 * stiffness)) ** 2)
    assert found.curved
    assert found.interval[0] == found.value == 0.0
    assert float(found.interval[1]) == pytest.approx(chi2.ppf(0.975, 1), rel=0.3)


def test_no_interval_leaves_out_the_value_that_it_belongs_to(fit):
    """Of a model that misses friction the scatters which the records allow lead to other coefficients."""
    cubic = "cubic_stiffness.coefficient"
    law, place = fit.mixture, fit.free.index(cubic)
    assert abs(float(law.weights @ law.means[:, place])) > 0.5 * fit.standard_errors[cubic]
    for level in (0.8, 0.95):
        found = ij.uncertainty(fit, lambda m: jnp.stack([m[cubic], jnp.log(m[cubic])]), confidence=level)
        assert np.all((found.interval[0] < found.value) & (found.value < found.interval[1]))
        assert not found.curved[0]
        width = law.half_width(np.eye(len(fit.free))[place], level)
        np.testing.assert_allclose(found.interval[:, 0] - found.value[0], [-width, width], rtol=1e-4)
        inside = np.mean(np.abs(found.draws[:, 0] - found.value[0]) < width)
        assert inside == pytest.approx(level, abs=4.0 * np.sqrt(level * (1.0 - level) / len(found.draws)))


def test_of_a_curved_quantity_the_interval_is_that_of_its_distribution(wide):
    centre = float(wide.model[STIFFNESS])
    found = ij.uncertainty(
        wide, lambda m: jnp.stack([m[STIFFNESS] / centre, jnp.exp(8.0 * m[STIFFNESS] / centre)]), draws=20_000
    )
    assert found.curved.tolist() == [False, True]
    # The logarithm of the second is normal, with mean 8 and standard deviation 0.8.
    np.testing.assert_allclose(found.interval[:, 1], np.exp(norm.ppf([0.025, 0.975], 8.0, 0.8)), rtol=0.05)
    spread = np.exp(8.0 + 0.32) * np.sqrt(np.expm1(0.64))
    assert found.standard_error[1] == pytest.approx(spread, rel=0.05)
    assert found.standard_error[0] == pytest.approx(0.1, rel=1e-9)


def test_the_tails_of_few_records_widen_intervals_of_other_confidences(wide):
    """Nine tenths of the weight with a small deviation, a tenth with one four times as large."""
    weights, share = np.array([0.9, 0.1]), np.array([1.0, 4.0])

    def width(level):
        return brentq(lambda x: weights @ (2.0 * norm.cdf(x / share) - 1.0) - level, 0.0, 40.0)

    size = np.sqrt(wide.covariance) * norm.ppf(0.975) / width(0.95)
    parts = np.square(share)[:, None, None] * size**2
    few = wide._replace(
        mixture=ij.models.NormalMixture(weights, np.zeros(parts.shape[:2]), parts, np.zeros(2))
    )
    centre = float(wide.model[STIFFNESS])
    for level in (0.5, 0.8, 0.95, 0.99):
        found = ij.uncertainty(few, lambda m: m[STIFFNESS] / centre, confidence=level, draws=20_000)
        expected = 0.1 * norm.ppf(0.975) * width(level) / width(0.95)
        assert not found.curved.any()
        np.testing.assert_allclose(found.interval - 1.0, [-expected, expected], rtol=1e-6)
        outside = np.mean(np.abs(found.draws - 1.0) > expected)
        assert outside == pytest.approx(1.0 - level, abs=4.0 * np.sqrt(level * (1.0 - level) / 20_000))
    bent = ij.uncertainty(few, lambda m: jnp.exp(8.0 * m[STIFFNESS] / centre), confidence=0.8, draws=20_000)
    expected = 8.0 * 0.1 * norm.ppf(0.975) * width(0.8) / width(0.95)
    np.testing.assert_allclose(bent.interval, np.exp(8.0 + expected * np.array([-1.0, 1.0])), rtol=0.05)
    with pytest.raises(ValueError, match=r"a mixture that belongs to its covariance, .* linear_stiff"):
        ij.uncertainty(few._replace(covariance=4.0 * wide.covariance), lambda m: m[STIFFNESS])


def test_of_an_orbit_the_error_is_that_of_central_differences(fit):
    def amplitude(model):
        return ij.find_periodic_orbit(model, ij.Harmonic(amplitude=60.0, frequency=5.0)).amplitude

    found = ij.uncertainty(fit, amplitude, draws=100)
    slopes = []
    for name, error in fit.standard_errors.items():
        moved = [
            float(amplitude(fit.model.replace(**{name.replace(".", "__"): float(fit.model[name]) + h})))
            for h in (-error, error)
        ]
        slopes.append((moved[1] - moved[0]) / (2.0 * error))
    assert list(fit.standard_errors) == list(fit.free)
    expected = np.sqrt(np.array(slopes) @ fit.covariance @ np.array(slopes))
    assert float(found.standard_error) == pytest.approx(expected, rel=1e-4)


def test_bounds_hold_and_draws_that_fail_are_counted(wide):
    seen = float(wide.model[STIFFNESS])
    rough = wide._replace(
        model=wide.model.with_elements(ij.CoulombFriction(1.0, 1e-4)),
        free=(*wide.free, "coulomb_friction.force_level"),
        covariance=np.pad(wide.covariance, ((0, 1), (0, 1))),
    )
    rough.covariance[-1, -1] = 1.0
    drawn = ij.uncertainty(rough, lambda model: model["coulomb_friction.force_level"], draws=20_000)
    # A normal law of mean and standard deviation one, cut at zero.
    np.testing.assert_allclose(drawn.interval, truncnorm.ppf([0.025, 0.975], -1.0, np.inf, 1.0), atol=0.05)
    assert drawn.curved
    found = ij.uncertainty(
        wide, lambda m: jnp.where(m[STIFFNESS] > seen * 1.05, jnp.nan, m[STIFFNESS]), draws=20_000
    )
    assert found.failed == pytest.approx(norm.sf(0.5), abs=0.02)
    # A third of the draws has none: beside "none" stands the interval of the others, a normal law cut above.
    wanted = truncnorm.ppf([0.025, 0.975], -np.inf, 0.5, seen, 0.1 * seen)
    np.testing.assert_allclose(found.interval, wanted, rtol=0.01)
    assert found.may_not_exist
    assert "the quantity is not finite" in str(found)


def test_a_draw_without_a_value_counts_as_outside_the_interval(wide):
    """A hundredth of the draws has none, all of them low: 95 % of all draws are 96 % of the rest."""
    centre = float(wide.model[STIFFNESS])

    def quantity(model):
        value = jnp.exp(8.0 * model[STIFFNESS] / centre)
        return jnp.where(value < np.exp(norm.ppf(0.01, 8.0, 0.8)), jnp.nan, value)

    found = ij.uncertainty(wide, quantity, draws=20_000)
    # Of the 99 % that are left 95 % are held, and 2 % at either end are not.
    expected = np.exp(norm.ppf([0.03, 0.98], 8.0, 0.8))
    np.testing.assert_allclose(found.interval, expected, rtol=0.05)
    inside = (found.draws >= found.interval[0]) & (found.draws <= found.interval[1])
    assert np.mean(inside) == pytest.approx(0.95, abs=1e-3)
    assert not found.may_not_exist


@pytest.mark.parametrize("z", [-1.0, 0.3, 1.2, 1.75])
def test_what_exists_above_zero_alone_has_the_probability_of_the_normal_law(wide, z):
    """z standard deviations above zero at the fit, or below it: then the fit itself has no value."""
    centre = float(wide.model[STIFFNESS])

    def quantity(model):
        above = z + 10.0 * (model[STIFFNESS] / centre - 1.0)
        return jnp.where(above > 0.0, above, jnp.nan)

    found = ij.uncertainty(wide, quantity, draws=20_000)
    exists = norm.cdf(z)
    assert found.probability_error == pytest.approx(np.sqrt(exists * (1.0 - exists) / 20_000), rel=0.05)
    assert found.probability == pytest.approx(exists, abs=4.0 * float(found.probability_error))
    assert bool(np.isnan(found.value)) == (z < 0.0)
    assert bool(found.may_not_exist) == (exists < 0.95)
    # Alone the interval holds 95 % of all draws, else 95 % of those that exist.
    content = 0.95 if exists < 0.95 else 0.95 / exists
    tails = [0.5 * (1.0 - content), 0.5 * (1.0 + content)]
    np.testing.assert_allclose(found.interval, truncnorm.ppf(tails, -z, np.inf, z), atol=0.12)
    assert f"exists with probability {float(found.probability):.3g}" in str(found)


def test_too_few_draws_with_a_value_state_no_interval(wide):
    seen = float(wide.model[STIFFNESS])
    found = ij.uncertainty(wide, lambda m: jnp.where(m[STIFFNESS] > seen * 1.22, 1.0, jnp.nan))
    assert 0.0 < found.probability < 0.04
    assert np.isnan(found.interval).all()
    assert "too few draws for an interval" in str(found)


def test_draws_without_a_fold_have_failed_with_the_reason(wide):
    limit, asked = float(wide.model[STIFFNESS]) * 1.05, []

    def first_fold(model):
        folds = [model[STIFFNESS]] if bool(model[STIFFNESS] < limit) else []
        return folds[0]

    found = ij.uncertainty(wide, first_fold, draws=200, progress=asked.append)
    assert found.failed == pytest.approx(norm.sf(0.5), abs=0.1)
    assert found.reason == "IndexError: list index out of range"
    assert len(asked) == 20
    assert np.isnan(found.draws).sum() == round(200 * found.failed)


def test_a_quantity_that_raises_at_the_fit_has_no_value_there_and_the_probability_of_the_draws(wide):
    limit = float(wide.model[STIFFNESS]) * 0.95

    def first_fold(model):
        folds = [model[STIFFNESS]] if bool(model[STIFFNESS] < limit) else []
        return folds[0]

    found = ij.uncertainty(wide, first_fold, draws=400)
    assert np.isnan(found.value)
    assert found.reason == "IndexError: list index out of range"
    assert float(found.probability) == pytest.approx(norm.cdf(-0.5), abs=4.0 * float(found.probability_error))
    assert found.interval[1] < limit
    with pytest.raises(IndexError):
        ij.uncertainty(wide, lambda model: [][0], draws=100)


def test_a_quantity_that_does_not_bend_is_not_called_curved_for_want_of_draws():
    """Their own error passes a tenth of the interval in 9 of 100 sets of 200 draws."""
    generator, flags = np.random.default_rng(1), []
    for count in (100, 200, 1000):
        drawn = generator.standard_normal((count, 500))
        known = credible_set(np.zeros(500), np.ones(500), drawn, 0.95)
        flags.append(np.mean(known.curved))
        bent = credible_set(np.ones(500), np.full(500, 0.8), np.exp(0.8 * drawn), 0.95)
        assert np.mean(bent.curved) > 0.95
    assert max(flags) < 0.02


@pytest.mark.parametrize(("lost", "said"), [(0.05, True), (0.055, True), (0.01, False), (0.2, False)])
def test_a_probability_next_to_the_confidence_is_said_to_be_undecided(wide, lost, said):
    limit = float(wide.model[STIFFNESS]) * (1.0 + 0.1 * norm.isf(lost))
    found = ij.uncertainty(wide, lambda m: jnp.where(m[STIFFNESS] > limit, jnp.nan, m[STIFFNESS]), draws=2000)
    words = " ".join(str(found).split())
    assert ("Whether the probability reaches 95%, at which the interval jumps" in words) == said


def test_a_quantity_that_leaves_jax_is_told_how_to_stay(wide):
    with pytest.raises(ValueError, match=r"`quantity` must be differentiable by `jax.jacfwd`, .*`float`"):
        ij.uncertainty(wide, lambda model: float(model[STIFFNESS]))


def test_fits_to_campaigns_of_equal_length_are_not_mixed(fit):
    records = [dataclasses.replace(one, output=1.01 * one.output) for one in fit.campaign.records]
    other = fit._replace(campaign=dataclasses.replace(fit.campaign, records=tuple(records)))
    with pytest.raises(
        ValueError, match=r"must list fits to the same records, but those of campaign '.*' differ"
    ):
        ij.uncertainty([fit, other], lambda model: model[STIFFNESS])


def test_fits_that_the_data_do_not_separate_are_mixed_by_their_evidence(wide):
    # Another law whose stiffness is a third higher, and whose BIC is 2 ln 4 higher: a fifth of the evidence.
    inflation = wide.stats.chi2 / wide.stats.dof
    assert inflation > 1.0
    centre, error = float(wide.model[STIFFNESS]), 0.1 * float(wide.model[STIFFNESS])
    stats = wide.stats._replace(bic=wide.stats.bic + 2.0 * inflation * np.log(4.0))
    other = wide._replace(
        model=wide.model.replace(linear_stiffness__coefficient=4.0 * centre / 3.0), stats=stats
    )
    found = ij.uncertainty([wide, other], lambda model: model[STIFFNESS], draws=50_000)
    np.testing.assert_allclose(found.weights, [0.8, 0.2], rtol=1e-9)
    assert float(found.value) == centre

    def share_below(x):
        return 0.8 * norm.cdf(x, centre, error) + 0.2 * norm.cdf(x, 4.0 * centre / 3.0, error)

    expected = [brentq(lambda x, q=q: share_below(x) - q, 0.0, 3.0 * centre) for q in (0.025, 0.975)]
    np.testing.assert_allclose(found.interval, expected, atol=0.05 * error)
    assert "of 2 fits weighed 80%, 20%" in str(found)
    # Two laws are not one normal distribution, but no quantity bends for that.
    assert not found.curved
    assert ij.uncertainty([wide, other], lambda model: model[STIFFNESS] ** 8).curved
    spread = np.hypot(error, 0.4 * centre / 3.0)  # of the mixture
    assert float(found.standard_error) == pytest.approx(spread, rel=0.02)


def test_fits_to_other_records_are_not_mixed(wide):
    other = wide._replace(stats=wide.stats._replace(samples=17))
    with pytest.raises(ValueError, match="must list fits to the same records, but these count 47408, 17"):
        ij.uncertainty([wide, other], lambda model: model[STIFFNESS])
    with pytest.raises(ValueError, match="the list is empty"):
        ij.uncertainty([], lambda model: model[STIFFNESS])


def test_a_function_that_cannot_be_mapped_is_drawn_one_by_one(wide):
    def numpy_only(model):
        return model[STIFFNESS] if bool(model[DAMPING] > 0.0) else -model[STIFFNESS]

    found = ij.uncertainty(wide._replace(free=wide.free), numpy_only, draws=100)
    assert found.draws.shape == (100,)


def test_what_cannot_be_carried_is_refused(wide, unchecked):
    lost = np.array(wide.covariance)
    lost[0] = lost[:, 0] = np.nan
    with pytest.raises(ValueError, match=f"do not determine {wide.free[0]}"):
        ij.uncertainty(wide._replace(covariance=lost), lambda model: model[STIFFNESS])
    negative = np.array(wide.covariance)
    negative[0, 0] = -1.0
    with pytest.raises(ValueError, match=f"variances of 0 or above, but not for {wide.free[0]}"):
        ij.uncertainty(wide._replace(covariance=negative), lambda model: model[STIFFNESS])
    with pytest.raises(ValueError, match=r"`quantity` must be a function of an isolator, .* but is 'k1'"):
        ij.uncertainty(wide, "k1")
    with pytest.raises(ValueError, match=r"must give a number or an array, .* one of type set"):
        ij.uncertainty(wide, lambda model: {"mass"})
    with pytest.raises(ValueError, match="must give real numbers"):
        ij.uncertainty(wide, lambda model: 1j * model[STIFFNESS])
    with pytest.raises(ValueError, match="`confidence` must lie between 0 and 1"):
        ij.uncertainty(wide, lambda model: model[STIFFNESS], confidence=95.0)
    with pytest.raises(ValueError, match="`draws` must be a whole number, but is nan"):
        ij.uncertainty(wide, lambda model: model[STIFFNESS], draws=float("nan"))
    with pytest.raises(ValueError, match=r"`fit\.free` must be one of .*, but is 'k9'"):
        ij.uncertainty(wide._replace(free=("k9", *wide.free[1:])), lambda model: model[STIFFNESS])
    with pytest.raises(ValueError, match="`draws` must be at least 100"):
        ij.uncertainty(wide, lambda model: model[STIFFNESS], draws=10)
    with pytest.raises(ValueError, match="must have succeeded"):
        ij.uncertainty(wide._replace(result=ij.RESULTS.not_converged), lambda model: model[STIFFNESS])


def test_an_interval_of_high_confidence_is_not_cut_at_the_outermost_draw(wide):
    found = ij.uncertainty(wide, lambda model: model[STIFFNESS], confidence=0.9999, draws=1000)
    half = float(np.diff(found.interval, axis=0).squeeze()) / 2.0
    assert half == pytest.approx(norm.ppf(0.99995) * float(found.standard_error), rel=1e-9)
    assert "99.99% interval" in str(found)


def test_a_yes_or_no_has_a_probability(wide):
    centre = float(wide.model[STIFFNESS])
    found = ij.uncertainty(wide, lambda model: model[STIFFNESS] < centre, draws=4000)
    assert np.mean(found.draws) == pytest.approx(0.5, abs=0.03)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda c: np.where(np.eye(len(c)) == 1.0, c, np.nan), "finite, symmetric covariance"),
        (lambda c: c[:1], "a row and a column"),
    ],
)
def test_a_covariance_that_is_none_is_refused(wide, change, words):
    wrong = wide._replace(covariance=change(np.asarray(wide.covariance)))
    with pytest.raises(ValueError, match=words):
        ij.uncertainty(wrong, lambda model: model[STIFFNESS])
