"""Designs against their closed forms, against what cannot be met, and where quantities fail."""

import re
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.stats import norm

import isojax as ij
from isojax.inference import at_least, at_most

K, C, K3 = "linear_stiffness.coefficient", "linear_damping.coefficient", "cubic_stiffness.coefficient"
MODEL = ij.Isolator(800.0, (ij.LinearStiffness(2e6), ij.CubicStiffness(1e11), ij.LinearDamping(1.0)))
WIDE = {K: (1e5, 1e8)}


def stiffness(model):
    return model[K]


class Uncertain(NamedTuple):
    """What a fit is to those who ask for its errors."""

    model: ij.Isolator
    free: tuple[str, ...]
    covariance: np.ndarray
    result: ij.RESULTS = ij.RESULTS.successful
    mixture: ij.models.NormalMixture | None = None


def test_the_stiffest_spring_that_keeps_the_motion_small_is_that_of_the_closed_form():
    """Of a drive above resonance the motion F / |k - m w^2 + i c w| grows with the spring."""
    model = ij.Isolator(800.0, (ij.LinearStiffness(2e5), ij.LinearDamping(4e3)))
    rate, force, limit = 2.0 * np.pi * 10.0, 100.0, 5e-5

    def motion(isolator):
        return ij.find_periodic_orbit(isolator, ij.Harmonic(force, 10.0)).amplitude

    found = ij.design(
        model, lambda isolator: -isolator[K], at_most(motion, limit), free={K: (1e5, 3e6)}, scan=8
    )
    exact = 800.0 * rate**2 - np.sqrt((force / limit) ** 2 - (4e3 * rate) ** 2)
    assert found.values[0] == pytest.approx(exact, rel=1e-5)
    assert ij.is_successful(found.result)
    assert found.outcomes[0].active
    assert found.scan.better == 0


def test_a_pressure_is_chosen_as_in_its_closed_form_with_and_without_a_chance():
    """The lowest pressure at which k + dk (p/p0 - 1) is large enough, also less 2.33 standard errors."""
    model = MODEL.with_elements(ij.elements.PressureStiffness(1.5e6, 2e5))
    free, wanted = {"pressure": (1e5, 4e5)}, 2.2e6
    found = ij.design(model, None, at_least(stiffness, wanted), free=free, scan=4)
    assert found.values[0] == pytest.approx(2e5 * (1.0 + 0.2e6 / 1.5e6), rel=1e-5)
    assert "pressure" in str(found)
    assert "Pa" in str(found)
    assert found.model.conditions == ()
    errors = 2e4, 3e5
    fit = Uncertain(model, (K, "pressure_stiffness.change"), np.diag(np.square(errors)))
    sure = ij.design(model, None, at_least(stiffness, wanted, chance=0.99), free=free, fit=fit, scan=4)

    def short(share):
        return 2e6 + 1.5e6 * share - norm.ppf(0.99) * np.hypot(errors[0], share * errors[1]) - wanted

    assert sure.values[0] == pytest.approx(2e5 * (1.0 + brentq(short, 0.0, 1.0)), rel=1e-5)
    with pytest.raises(ValueError, match=r"at one pressure, .* such as model\.at\(pressure=\.\.\.\)"):
        ij.design(model, None, at_least(stiffness, wanted), free={K: (1e6, 4e6)})
    with pytest.raises(ValueError, match=r"`free` must be one of mass \(m\), .*, but is 'pressure'"):
        ij.design(MODEL, None, at_least(stiffness, wanted), free=free)


def test_a_symbol_names_its_coefficient():
    found = ij.design(MODEL, None, at_least(stiffness, 3e6), free={"k1": (1e6, 4e6)}, scan=4)
    assert found.names == (K,)
    assert found.values[0] == pytest.approx(3e6, rel=1e-5)


def test_coefficients_of_one_and_of_1e11_weigh_alike():
    """The nearest in logarithms whose product is e^3 times as large: each is e times as large."""
    free = {K: (1e5, 1e8), K3: (1e10, 1e13), C: (0.1, 100.0)}
    before = np.array([float(MODEL[name]) for name in free])

    def product(model):
        return jnp.log(model[K]) + jnp.log(model[K3]) + jnp.log(model[C])

    def change(model):
        return sum(jnp.log(model[name] / value) ** 2 for name, value in zip(free, before, strict=True))

    limit = np.log(before).sum() + 3.0
    found = ij.design(MODEL, change, at_least(product, limit), free=free, scan=64)
    np.testing.assert_allclose(found.values, np.e * before, rtol=1e-4)
    np.testing.assert_allclose(found.changes, np.e - 1.0, rtol=1e-4)
    assert found.scan.points == 64
    assert found.scan.better == 0


def test_without_an_objective_the_design_is_the_nearest():
    found = ij.design(MODEL, subject_to=at_most(stiffness, 1e6), free={"mass": (600.0, 900.0), **WIDE})
    np.testing.assert_allclose(found.values, [800.0, 1e6], rtol=1e-5)
    assert found.objective == pytest.approx(0.25, rel=1e-5)
    assert found.objective_before == pytest.approx(0.0, abs=1e-20)
    drawn = ij.plot.design(found).axes[0]
    np.testing.assert_allclose([patch.get_width() for patch in drawn.patches[2:]], [0.0, -50.0], atol=1e-3)
    assert drawn.get_title(loc="left") == "stiffness ≤ 1e+06"
    assert ij.is_successful(found.result)


def test_a_coefficient_whose_bounds_differ_in_sign_moves_evenly():
    found = ij.design(MODEL, lambda model: (model[K3] + 5e11) ** 2, free={K3: (-1e12, 1e12)}, scan=16)
    assert found.values[0] == pytest.approx(-5e11, rel=1e-5)


def test_a_bound_of_zero_is_one_like_any_other():
    found = ij.design(MODEL, lambda model: (model[C] - 321.0) ** 2, free={C: (0.0, 9e3)}, scan=4)
    assert found.values[0] == pytest.approx(321.0, rel=1e-5)


def test_what_cannot_be_met_is_named_with_by_how_much():
    alone = ij.design(MODEL, stiffness, at_least(stiffness, 3e6), free={K: (1e6, 2.5e6)}, scan=8)
    assert not ij.is_successful(alone.result)
    assert alone.result == ij.RESULTS.infeasible
    assert alone.outcomes[0].margins[0] == pytest.approx(-5e5, rel=1e-4)
    assert alone.missed == ("stiffness ≥ 3e+06: 2.5e+06: missed by 5e+05",)
    limits = (at_least(stiffness, 2e6), at_most(stiffness, 1e6), at_most(stiffness, 9e7, name="far"))
    both = ij.design(MODEL, stiffness, limits, free=WIDE, scan=8)
    # Equal misses over the limits: (2e6 - k) / 2e6 = (k - 1e6) / 1e6.
    assert both.values[0] == pytest.approx(4e6 / 3.0, rel=1e-3)
    assert len(both.missed) == 2
    words = " ".join(repr(both).split())
    assert "no point was found that keeps the constraints; the best one breaks " in words
    assert "scan of 8 points: none breaks the constraints by less" in words
    assert re.search(r"stiffness ≥ 2e\+06 by 6\.6\d+e\+05 and stiffness ≤ 1e\+06 by 3\.3\d+e\+05", words)


def test_a_limit_beyond_where_a_quantity_exists_is_missed_there():
    def force(model):
        return jnp.where(model[K] < 3e6, 1e-4 * model[K], jnp.nan)

    found = ij.design(MODEL, None, at_least(force, 400.0, name="fold force"), free=WIDE, scan=8)
    assert found.result == ij.RESULTS.infeasible
    assert found.values[0] == pytest.approx(3e6, rel=1e-3)
    assert found.stopped.startswith("fold force is not finite at linear_stiffness.coefficient = 3")
    words = " ".join(repr(found).split())
    assert (
        "no point was found that keeps the constraints; the best one breaks fold force ≥ 400 by 100" in words
    )
    assert f"the search went no further because {found.stopped}" in words


def _lost_below(edge, target):
    def objective(model):
        return jnp.where(model[K] > edge, jnp.log(model[K] / target) ** 2, jnp.nan)

    return objective


def test_where_the_objective_fails_on_the_way_the_search_goes_back():
    found = ij.design(MODEL, _lost_below(1.15e6, 1.2e6), free={K: (1e5, 2.1e6)}, scan=32)
    assert found.values[0] == pytest.approx(1.2e6, rel=1e-4)
    assert found.retreats > 0
    assert found.scan.failed > 0


def test_a_function_that_raises_on_the_way_has_failed_there_and_one_that_raises_at_once_is_wrong():
    found = []

    def objective(model):
        distance = jnp.log(model[K] / 1.2e6) ** 2
        return found[0] * distance if jax.lax.stop_gradient(model[K]) < 1.15e6 else distance

    reached = ij.design(MODEL, objective, free={K: (1e5, 2.1e6)}, scan=16)
    assert reached.values[0] == pytest.approx(1.2e6, rel=1e-4)
    assert reached.retreats > 0
    with pytest.raises(IndexError):
        ij.design(MODEL, lambda model: found[0], free=WIDE)


def test_where_the_search_cannot_avoid_a_failure_it_says_so():
    with pytest.raises(
        ValueError, match=r"the objective is not finite at linear_stiffness\.coefficient = 1\.1"
    ):
        ij.design(MODEL, _lost_below(1.15e6, 1e6), free={K: (1e5, 2.1e6)})
    with pytest.raises(ValueError, match="the objective is not finite"):
        ij.design(MODEL, _lost_below(5e6, 1e6), free=WIDE)


def test_a_better_minimum_that_the_scan_finds_is_taken():
    def wells(model):
        """Minima near 1e6 and, deeper, near 3e7."""
        x = jnp.log10(model[K])
        return (x - 6.0) ** 2 * (x - 7.5) ** 2 - 0.3 * (x - 6.0)

    found = ij.design(MODEL.replace(linear_stiffness__coefficient=1.1e6), wells, free=WIDE)
    roots = np.roots(np.polyder(np.polymul(np.poly([6.0, 6.0]), np.poly([7.5, 7.5]))) - [0, 0, 0, 0.3])
    assert np.log10(found.values[0]) == pytest.approx(roots.real.max(), abs=1e-4)
    assert found.scan.better == 0


def test_a_chance_is_kept_by_the_error_of_the_fit_which_grows_with_the_coefficient():
    fit = Uncertain(MODEL, (K, C), np.diag([(0.05 * 2e6) ** 2, 0.01]))
    limit = at_least(stiffness, 1e6, chance=0.99)
    found = ij.design(MODEL, stiffness, limit, free=WIDE, fit=fit, scan=8)
    assert found.values[0] == pytest.approx(1e6 / (1.0 - 0.05 * norm.ppf(0.99)), rel=1e-5)
    assert found.outcomes[0].bound[0] == pytest.approx(1e6, rel=1e-5)
    assert "with a chance of 0.99" in repr(found)
    # A tenth of the weight with a deviation three times as large: as wide at 95 %, wider at 98 %.
    weights, share = np.array([0.9, 0.1]), np.array([1.0, 3.0])

    def width(level):
        return brentq(lambda x: weights @ (2.0 * norm.cdf(x / share) - 1.0) - level, 0.0, 40.0)

    parts = np.square(share * norm.ppf(0.975) / width(0.95))[:, None, None] * fit.covariance
    few = fit._replace(mixture=ij.models.NormalMixture(weights, np.zeros((2, 2)), parts, np.zeros(2)))
    found = ij.design(MODEL, stiffness, limit, free=WIDE, fit=few, scan=8)
    room = 0.05 * norm.ppf(0.975) * width(0.98) / width(0.95)
    assert room > 1.1 * 0.05 * norm.ppf(0.99)
    assert found.values[0] == pytest.approx(1e6 / (1.0 - room), rel=1e-5)
    with pytest.raises(ValueError, match="`fit` must be given"):
        ij.design(MODEL, stiffness, limit, free=WIDE)


def test_mistakes_are_refused(unchecked):
    for free, words in (
        ({}, "at least one coefficient"),
        ({"k": (1.0, 2.0)}, "one of mass"),
        ({K: (3e6, 1e6)}, "two finite numbers"),
        ({K: (3e6, 4e6)}, "start within the bounds"),
        ({"mass": (-1.0, 900.0)}, "must bound mass within"),
        ([K], r"must give the bounds of at least one coefficient, .* but is \['linear"),
        ({K: 3e6}, "two finite numbers, the lower first, but is 3000000"),
        ({"k1": (1e5, 1e7), K: (1e5, 1e7)}, r"name linear_stiffness\.coefficient once"),
    ):
        with pytest.raises(ValueError, match=words):
            ij.design(MODEL, stiffness, free=free)
    with pytest.raises(ValueError, match="`objective` or `subject_to` must be given"):
        ij.design(MODEL, free=WIDE)
    with pytest.raises(ValueError, match="one number"):
        ij.design(MODEL, lambda model: jnp.stack([model[K], model[K]]), free=WIDE)
    with pytest.raises(ValueError, match="one limit or one for each of 1"):
        ij.design(MODEL, stiffness, at_most(stiffness, [1e6, 2e6]), free=WIDE)
    with pytest.raises(ValueError, match="finite numbers"):
        at_most(stiffness, np.nan)
    with pytest.raises(ValueError, match=r"between 0\.5 and 1"):
        at_most(stiffness, 1.0, chance=99.0)
    with pytest.raises(ValueError, match=r"`subject_to` must hold constraints, .* of type function"):
        ij.design(MODEL, stiffness, stiffness, free=WIDE)
    with pytest.raises(ValueError, match=r"`objective` must be differentiable by `jax\.jacfwd`"):
        ij.design(MODEL, lambda model: float(model[K]), free=WIDE)
    with pytest.raises(ValueError, match="`quantity` must be a function of an isolator"):
        at_most("k1", 1e6)
    with pytest.raises(ValueError, match="`scan` must be at least 2"):
        ij.design(MODEL, stiffness, free=WIDE, scan=0)
