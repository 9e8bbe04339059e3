"""Error bars against closed forms."""

from types import SimpleNamespace

import numpy as np

from isojax.identification.fitting import invert_information
from isojax.identification.innovations import ErrorFit


def _line(count=50):
    """A straight line y = a + b x with x in tiny units, sigma 0.2."""
    x = 1e-6 * np.linspace(-1.0, 3.0, count)
    return x, np.stack([np.ones(count), x], axis=1) / 0.2


def test_covariance_of_a_straight_line_is_the_closed_form():
    x, columns = _line()
    found = invert_information(columns.T @ columns)
    spread = np.sum((x - x.mean()) ** 2)
    slope, height = 0.2**2 / spread, 0.2**2 * (1.0 / x.size + x.mean() ** 2 / spread)
    np.testing.assert_allclose(np.diag(found.covariance), [height, slope], rtol=1e-9)
    np.testing.assert_allclose(found.covariance[0, 1], -(0.2**2) * x.mean() / spread, rtol=1e-9)
    np.testing.assert_allclose(found.standard_error, np.sqrt([height, slope]), rtol=1e-9)
    np.testing.assert_allclose(np.diag(found.correlation), 1.0)
    assert found.determined.all()
    assert found.partners == ()


def test_misfit_inflates_the_covariance():
    _, columns = _line()
    plain, inflated = (invert_information(columns.T @ columns, factor) for factor in (1.0, 2.5))
    np.testing.assert_allclose(inflated.covariance, 2.5 * plain.covariance)


def test_a_degenerate_pair_is_flagged_with_its_partners_and_the_rest_is_kept():
    rng = np.random.default_rng(2)
    free = rng.standard_normal((200, 3))
    columns = np.stack([free[:, 0], free[:, 1], 1e9 * free[:, 1], free[:, 2]], axis=1)
    found = invert_information(columns.T @ columns)
    assert found.determined.tolist() == [True, False, False, True]
    assert found.partners == ((1, 2),)
    assert np.isnan(found.standard_error[[1, 2]]).all()
    alone = np.linalg.inv(free.T @ free)
    np.testing.assert_allclose(found.standard_error[[0, 3]], np.sqrt(np.diag(alone)[[0, 2]]), rtol=1e-6)


def test_a_coefficient_without_a_trace_is_not_determined():
    rng = np.random.default_rng(2)
    columns = rng.standard_normal((50, 2)) * np.array([1.0, 0.0])
    found = invert_information(columns.T @ columns)
    assert found.determined.tolist() == [True, False]
    assert np.isfinite(found.standard_error[0])
    assert np.isnan(found.standard_error[1])


def test_nothing_is_known_where_the_information_is_not_finite():
    found = invert_information(np.array([[1.0, np.nan], [np.nan, 1.0]]))
    assert not found.determined.any()
    assert np.isnan(found.covariance).all()


def test_coefficients_of_any_size_keep_their_variance_beside_each_other():
    stiff, cubic, likeness = 1e-9, 1e-19, 0.8  # inverse variances of N/m and of N/m^3
    cross = likeness * np.sqrt(stiff * cubic)
    found = ErrorFit.__dict__["covariance"].fget(
        SimpleNamespace(information=np.array([[stiff, cross], [cross, cubic]]))
    )
    expected = np.array([[cubic, -cross], [-cross, stiff]]) / (stiff * cubic * (1.0 - likeness**2))
    np.testing.assert_allclose(found, expected, rtol=1e-9)
