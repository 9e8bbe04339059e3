"""Error bars over every scatter that the records allow, against quadrature by SciPy and by simulation."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.stats import halfcauchy, norm

from isojax.identification.fitting._elimination import Nuisances, Spread, eliminate
from isojax.identification.fitting._scatter_mixture import (
    integrate_scatter,
    log_likelihood,
    scatter_of_next,
    scores_over_scatters,
)

UNIT = 1e-3
"""One unit of a stiffness scale's column: a tenth of a percent."""

PRIOR = 1e-3


def reduced_of(columns, scale, readings, spread, inflation=1.0):
    """Equations of records that hold whitened columns of coefficients, one of the scale, and the readings."""
    records, samples, count = columns.shape
    whole = np.concatenate(
        [columns, scale[..., None], np.zeros((records, samples, 1)), readings[..., None]], axis=2
    )
    matrices = inflation * np.einsum("rti,rtj->rij", whole, whole)
    nuisances = Nuisances(np.zeros((records, 1)), np.zeros(records), np.zeros(records), Spread(spread))
    return eliminate(matrices, (1.0,) * records, np.arange(records), count, nuisances), nuisances


def mean_of(readings, noise, spread, inflation=1.0):
    """The uncertainty of a mean [UNIT], each record showing it with its own deviation and noise."""
    columns = np.full((len(readings), 1, 1), 1.0 / noise)
    return integrate_scatter(
        *reduced_of(columns, columns[..., 0], np.array(readings)[:, None] / noise, spread, inflation),
        inflation,
    )


def half_width(readings, noise, about, error_at=None, level=0.95):
    """The same by quadrature: readings of a mean with the variance noise^2 + scatter^2 [all in UNIT].

    `error_at` gives the standard error at a scatter; that of the mean if omitted. `level` is the chance.
    """
    readings, count = np.array(readings), len(readings)
    centre, squares = readings.mean(), np.sum((readings - readings.mean()) ** 2)

    def density(logarithm):
        scatter = np.exp(logarithm)
        variance = noise**2 + scatter**2
        likelihood = variance ** (-0.5 * (count - 1)) * np.exp(-0.5 * squares / variance)
        return likelihood * halfcauchy.pdf(scatter * UNIT, scale=PRIOR) * scatter

    def integral(weight):
        return quad(lambda x: density(x) * weight(np.exp(x)), np.log(1e-4), np.log(300.0), limit=400)[0]

    def held(width):
        def inside(scatter):
            error = np.sqrt((noise**2 + scatter**2) / count) if error_at is None else error_at(scatter)
            return norm.cdf(about + width, centre, error) - norm.cdf(about - width, centre, error)

        return integral(inside) / integral(lambda _: 1.0)

    return brentq(lambda width: held(width) - level, 1e-3, 300.0)


@pytest.mark.parametrize("readings", [(-0.4, 0.5), (0.1, 0.12), (-3.0, 1.0, 2.5), (-0.2, 0.4, 0.1, -0.3)])
@pytest.mark.parametrize("spread", [1e-5, 2e-3], ids=["steady", "loose"])
def test_the_interval_of_a_mean_is_that_of_quadrature(readings, spread):
    noise = 0.2
    error = float(mean_of(readings, noise, spread).standard_error[0])
    # The fit's own mean, alike at every scatter because the records weigh alike.
    expected = half_width(readings, noise, float(np.mean(readings)))
    assert norm.ppf(0.975) * error == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize("level", [0.5, 0.8, 0.99, 0.999])
@pytest.mark.parametrize("readings", [(-0.4, 0.5), (0.1, 0.12), (-3.0, 1.0, 2.5), (-0.2, 0.4, 0.1, -0.3)])
def test_the_interval_of_a_mean_is_that_of_quadrature_at_other_confidences(readings, level):
    noise = 0.2
    law = mean_of(readings, noise, 1e-5).mixture
    expected = half_width(readings, noise, float(np.mean(readings)), level=level)
    assert law.half_width(np.ones(1), level) == pytest.approx(expected, rel=0.02)
    draws = law.draw(
        np.random.default_rng(1).random(40_000), np.random.default_rng(2).normal(size=(40_000, 1))
    )
    outside = np.mean(np.abs(draws) > expected)
    assert outside == pytest.approx(1.0 - level, abs=5.0 * np.sqrt(level * (1.0 - level) / 40_000))


@pytest.mark.parametrize("readings", [(-0.4, 0.5), (-3.0, 1.0, 2.5), (-0.2, 0.4, 0.1, -0.3)])
def test_the_deviation_of_a_further_record_is_that_of_quadrature(readings):
    noise, columns = 0.2, np.full((len(readings), 1, 1), 5.0)
    known = reduced_of(columns, columns[..., 0], np.array(readings)[:, None] / noise, 2e-3)
    expected = half_width(readings, noise, float(np.mean(readings)), error_at=lambda scatter: scatter)
    assert norm.ppf(0.975) * scatter_of_next(*known, 1.0) / UNIT == pytest.approx(expected, rel=2e-3)


def test_noise_that_was_taken_too_small_is_inflated_first():
    readings = (-0.4, 0.5, 0.3)
    honest, proud = mean_of(readings, 0.2, 1e-4), mean_of(readings, 0.2, 1e-4, inflation=4.0)
    assert proud.standard_error[0] == pytest.approx(honest.standard_error[0], rel=1e-9)


def test_without_a_scale_in_the_readings_least_squares_is_left():
    draw = np.random.default_rng(1)
    columns = draw.normal(size=(3, 40, 2)) * np.array([1.0, 1e6])
    found = integrate_scatter(*reduced_of(columns, np.zeros((3, 40)), draw.normal(size=(3, 40)), 1e-4), 1.0)
    flat = columns.reshape(-1, 2)
    np.testing.assert_allclose(found.covariance, np.linalg.inv(flat.T @ flat), rtol=1e-9)


def test_what_the_data_do_not_determine_is_named_and_spoils_nothing_else():
    draw = np.random.default_rng(2)
    columns = draw.normal(size=(3, 40, 3))
    columns[..., 2] = 2.0 * columns[..., 1]
    scale, readings = columns[..., 0] + draw.normal(size=(3, 40)), draw.normal(size=(3, 40))
    found = integrate_scatter(*reduced_of(columns, scale, readings, 1e-3), 1.0)
    fewer = integrate_scatter(*reduced_of(columns[..., :2], scale, readings, 1e-3), 1.0)
    assert found.determined.tolist() == [True, False, False]
    assert found.standard_error[0] == pytest.approx(fewer.standard_error[0], rel=1e-6)
    assert np.isnan(found.standard_error[1:]).all()


@pytest.mark.parametrize("spread", [1e-5, 2e-3], ids=["steady", "loose"])
def test_the_likelihood_of_a_mean_is_that_of_quadrature(spread):
    readings, noise, columns = np.array([-0.4, 0.9, 0.3]), 0.2, np.full((3, 1, 1), 5.0)

    def found(mean):
        equations = reduced_of(columns, columns[..., 0], (readings - mean)[:, None] / noise, spread)
        return log_likelihood(*equations, 1.0, True)

    def expected(mean):
        def density(logarithm):
            scatter = np.exp(logarithm)
            chances = norm.pdf(readings, mean, np.hypot(noise, scatter))
            return np.prod(chances) * halfcauchy.pdf(scatter * UNIT, scale=PRIOR) * scatter

        return np.log(quad(density, np.log(1e-4), np.log(300.0), limit=400)[0])

    for mean in (0.0, 1.0):
        assert found(mean)[0] - found(0.3)[0] == pytest.approx(expected(mean) - expected(0.3), abs=2e-3)
    slope = (expected(0.7 + 1e-4) - expected(0.7 - 1e-4)) / 2e-4
    assert found(0.7)[1][0] == pytest.approx(slope, rel=5e-3)


@pytest.mark.parametrize("count", [2, 4])
def test_intervals_cover_where_the_scatter_is_drawn_from_its_prior(count):
    draw = np.random.default_rng(count)
    repeats, noise, inside, known = 800, 0.2, 0, 0
    levels = np.array([0.5, 0.8, 0.99])
    held = np.zeros(levels.size)
    for scatter in halfcauchy.rvs(scale=PRIOR / UNIT, size=repeats, random_state=draw):
        readings = tuple(draw.normal(size=count) * np.hypot(noise, scatter))
        found = mean_of(readings, noise, 1e-5)
        error = float(found.standard_error[0])
        held += abs(np.mean(readings)) < found.mixture.half_width(np.ones((3, 1)), levels)
        inside += abs(np.mean(readings)) < norm.ppf(0.975) * error
        moments = np.sqrt(np.maximum(np.var(readings, ddof=1), noise**2) / count)
        known += abs(np.mean(readings)) < norm.ppf(0.975) * moments
    assert inside / repeats == pytest.approx(0.95, abs=0.023)
    np.testing.assert_allclose(held / repeats, levels, atol=3.0 * np.sqrt(0.25 / repeats))
    assert held[2] / repeats == pytest.approx(0.99, abs=0.0105)
    # An estimate of the scatter taken as known covers less.
    assert known < inside


def chance_of(readings, noise, spread, against):
    """The p-value of an effect that adds to some records and takes from others, beside their mean."""
    columns = np.stack([np.ones(len(readings)), against], axis=1)[:, None] / noise
    equations = reduced_of(columns, columns[..., 0], np.array(readings)[:, None] / noise, spread)
    found = scores_over_scatters(*equations, 1.0, 1)
    return found.weight[:, 0] @ (
        2.0 * norm.sf(np.abs(found.score[:, 0]) / np.sqrt(found.information[:, 0, 0]))
    )


@pytest.mark.parametrize("readings", [(-0.4, 0.5, 0.3), (-3.0, 1.0, 2.5, 2.4)])
def test_the_chance_of_a_score_is_that_of_quadrature(readings):
    noise, against = 0.2, np.where(np.arange(len(readings)) % 2, 1.0, -1.0)
    readings, left = np.array(readings), against - against.mean()
    score, size = left @ readings, left @ left
    squares = np.sum((readings - readings.mean()) ** 2) - score**2 / size

    def density(logarithm):
        scatter = np.exp(logarithm)
        variance = noise**2 + scatter**2
        likelihood = variance ** (-0.5 * (len(readings) - 2)) * np.exp(-0.5 * squares / variance)
        return likelihood * halfcauchy.pdf(scatter * UNIT, scale=PRIOR) * scatter

    def integral(weight):
        return quad(lambda x: density(x) * weight(np.exp(x)), np.log(1e-4), np.log(300.0), limit=400)[0]

    def tail(scatter):
        return 2.0 * norm.sf(abs(score) / np.sqrt((noise**2 + scatter**2) * size))

    expected = integral(tail) / integral(lambda _: 1.0)
    for spread in (1e-5, 2e-3):
        assert chance_of(readings, noise, spread, against) == pytest.approx(expected, rel=5e-3)


def test_no_effect_is_significant_more_often_than_its_chance_says():
    draw = np.random.default_rng(7)
    noise, against = 0.2, np.array([1.0, 1.0, -1.0, -1.0])
    chances = []
    for scatter in halfcauchy.rvs(scale=PRIOR / UNIT, size=600, random_state=draw):
        chances.append(chance_of(draw.normal(size=4) * np.hypot(noise, scatter), noise, 1e-5, against))
    for level in (0.01, 0.05, 0.5):
        spread = 3.0 * np.sqrt(level * (1.0 - level) / len(chances))
        assert np.mean(np.array(chances) < level) == pytest.approx(level, abs=spread)
