"""Sobol's indices against closed forms and SciPy's estimator."""

import jax.numpy as jnp
import numpy as np
import pytest
from scipy import stats

import isojax as ij

SPRING, DAMPER, CUBIC = (
    f"{name}.coefficient" for name in ("linear_stiffness", "linear_damping", "cubic_stiffness")
)
CIRCLE = {name: (-np.pi, np.pi) for name in "abc"}


def ishigami(x):
    return jnp.sin(x["a"]) + 7.0 * jnp.sin(x["b"]) ** 2 + 0.1 * x["c"] ** 4 * jnp.sin(x["a"])


def test_ishigami_has_the_indices_of_its_closed_form():
    own, pair = 0.5 * (1.0 + 0.1 * np.pi**4 / 5.0) ** 2, 0.01 * np.pi**8 * (1.0 / 18.0 - 1.0 / 50.0)
    parts = np.array([own, 49.0 / 8.0, 0.0])
    total = parts + np.array([pair, 0.0, pair])
    variance = own + 49.0 / 8.0 + pair
    found = ij.global_sensitivity(ishigami, CIRCLE)
    np.testing.assert_allclose(found.first, parts / variance, atol=0.02)
    np.testing.assert_allclose(found.total, total / variance, atol=0.02)
    assert found.mean == pytest.approx(3.5, rel=0.02)
    assert found.variance == pytest.approx(variance, rel=0.02)
    for truth, interval in ((parts, found.first_interval), (total, found.total_interval)):
        assert np.all((interval[0] < truth / variance) & (truth / variance < interval[1]))
    assert "a  0.3" in repr(found)


def test_indices_are_those_of_scipy_on_the_same_design():
    def both(x):
        x = dict(zip("abc", x, strict=True))
        return np.stack([ishigami(x), x["a"] + 2.0 * x["c"]])

    laws = [stats.norm(1.0, 2.0), stats.lognorm(0.3), stats.uniform(-1.0, 3.0)]
    reference = stats.sobol_indices(func=both, n=256, dists=laws, rng=np.random.default_rng(5))
    ranges = dict(zip("abc", [laws[0], laws[1], (-1.0, 2.0)], strict=True))
    found = ij.global_sensitivity(
        lambda x: jnp.stack([ishigami(x), x["a"] + 2.0 * x["c"]]), ranges, samples=256, seed=5
    )
    np.testing.assert_allclose(found.first, reference.first_order.T, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(found.total, reference.total_order.T, rtol=1e-9, atol=1e-12)


def test_in_the_linear_limit_the_indices_of_a_model_are_the_local_ones():
    model = ij.paper.y_direction()

    def resonance(model):
        """Amplitude of the linear part at 60 N, and the stiffness that it works against."""
        amplitude = 60.0 / (model[DAMPER] * jnp.sqrt(model[SPRING] / model.mass))
        return amplitude * (model[SPRING] + 0.75 * model[CUBIC] * amplitude**2)

    errors = {SPRING: 1e-3, DAMPER: 1e-3, CUBIC: 5e-3}
    ranges = {name: stats.norm(model[name], share * abs(model[name])) for name, share in errors.items()}
    said = []
    found = ij.global_sensitivity(resonance, ranges, model, samples=1024, progress=said.append)
    slopes = ij.sensitivity(resonance, model, parameters=tuple(ranges))
    parts = np.square(slopes.derivatives["value"] * np.array([law.std() for law in ranges.values()]))
    np.testing.assert_allclose(found.first, parts / parts.sum(), atol=0.01)
    np.testing.assert_allclose(found.total, parts / parts.sum(), atol=0.01)
    assert len(said) == 5
    assert said[-1] == "5120 of 5120 samples"


def test_a_fit_stands_for_its_model_and_a_dict_keeps_its_names():
    model = ij.paper.y_direction()
    variance = np.diag([1e3**2])
    fit = ij.models.FitAt(model, (SPRING,), variance, ij.RESULTS.successful)
    ranges = {SPRING: (0.9 * model[SPRING], 1.1 * model[SPRING]), DAMPER: (4e3, 6e3)}

    def both(model):
        return {"stiffness": model[SPRING], "time": model[DAMPER] / model[SPRING]}

    named = ij.global_sensitivity(both, ranges, fit, samples=256)
    plain = ij.global_sensitivity(
        lambda model: jnp.stack([*both(model).values()]), ranges, model, samples=256
    )
    assert named.names == ("stiffness", "time")
    np.testing.assert_array_equal(named.first, plain.first)
    np.testing.assert_allclose(named.first[:, 0], (1.0, 0.0), atol=0.02)
    assert f"stiffness, {SPRING}" in str(named)


def test_a_sample_that_fails_is_counted_with_place_and_reason():
    def rough(x):
        away = x["a"] > 0.9 * np.pi
        return jnp.where(away, jnp.nan, ishigami(x)), ij.RESULTS.where(
            away, ij.RESULTS.not_converged, ij.RESULTS.successful
        )

    found = ij.global_sensitivity(rough, CIRCLE, samples=1024)
    # Of five samples of a row four have the first `a`, one the second: both are uniform.
    assert len(found.failed_at) == pytest.approx(0.05 * found.samples, rel=0.05)
    assert found.failed_at[:, 0].min() > 0.9 * np.pi
    assert "stopped before it converged" in found.reason
    assert f"{len(found.failed_at)} of 5120 samples failed" in repr(found)
    assert np.all(np.isfinite(found.total))
    silent = ij.global_sensitivity(lambda x: rough(x)[0], CIRCLE, samples=64)
    assert silent.reason == "the quantity is not finite"
    assert ij.global_sensitivity(ishigami, CIRCLE, samples=64).reason == ""
    # A finite number of a search that failed is no answer either.
    with pytest.raises(ValueError, match=r"failed in 64 of 64 rows: .* stopped before it converged"):
        ij.global_sensitivity(lambda x: (x["a"], ij.RESULTS.not_converged), CIRCLE, samples=64)


def test_samples_that_raise_fail_beside_those_whose_search_failed():
    def rough(x):
        if bool(x["a"] > 0.95 * np.pi):
            raise IndexError("no fold")
        lost = bool(x["b"] > 0.95 * np.pi)
        # A count: what raised has none either.
        return jnp.array(3 + int(x["a"] > 0.0)), ij.RESULTS.not_converged if lost else ij.RESULTS.successful

    found = ij.global_sensitivity(rough, CIRCLE, samples=256)
    raised, lost = (found.failed_at[:, place] > 0.95 * np.pi for place in (0, 1))
    assert np.all(raised | lost)
    assert np.any(raised & ~lost)
    assert np.any(lost & ~raised)
    assert found.reason == "IndexError: no fold"


def test_a_function_that_cannot_be_mapped_is_evaluated_one_by_one():
    def plain(x):
        return x["a"] if bool(x["b"] > 0.0) else -x["a"]

    mapped = ij.global_sensitivity(lambda x: jnp.sign(x["b"]) * x["a"], CIRCLE, samples=64)
    np.testing.assert_allclose(ij.global_sensitivity(plain, CIRCLE, samples=64).total, mapped.total)


def test_a_function_that_gives_no_numbers_is_refused_at_once():
    asked = []
    for plain in (lambda one: one, float):  # with `jax.vmap`, and where that cannot go through

        def names(x, plain=plain):
            asked.append(plain(x["a"]))
            return "nothing"

        with pytest.raises(ValueError, match=r"gave one of type str"):
            ij.global_sensitivity(names, CIRCLE, samples=64)
    assert len(asked) == 2


def test_what_makes_no_sense_is_refused(unchecked):
    model = ij.paper.y_direction()
    for ranges, words in (
        ({}, "at least one input"),
        ({"a": (1.0, 1.0)}, "least and greatest value"),
        ({"a": 3.0}, "gives a 3"),
        ({"a": ("1", "2")}, "gives a "),
        ({"a": (False, True)}, "gives a "),
        ({"a": stats.norm}, "gives a the law norm without any"),
    ):
        with pytest.raises(ValueError, match=words):
            ij.global_sensitivity(lambda x: x["a"], ranges)
    with pytest.raises(ValueError, match="`ranges` must be a dictionary"):
        ij.global_sensitivity(lambda m: m.mass, model)
    with pytest.raises(ValueError, match="`quantity` must be a function"):
        ij.global_sensitivity("mass", {"mass": (700.0, 900.0)}, model)
    with pytest.raises(ValueError, match=r"`model` must be an isolator, .* but is of type str"):
        ij.global_sensitivity(lambda m: m.mass, {"mass": (700.0, 900.0)}, "model.json")
    with pytest.raises(ValueError, match="`ranges` must be one of mass"):
        ij.global_sensitivity(lambda m: m.mass, {"mess": (1.0, 2.0)}, model)
    with pytest.raises(ValueError, match=r"keep mass between 0 .* kg, but \d+ of 192 samples"):
        ij.global_sensitivity(lambda m: m.mass, {"mass": stats.norm(0.0, 1.0)}, model, samples=64)
    with pytest.raises(ValueError, match="power of 2"):
        ij.global_sensitivity(ishigami, CIRCLE, samples=1000)
    with pytest.raises(ValueError, match="real numbers"):
        ij.global_sensitivity(lambda x: 1j * x["a"], CIRCLE, samples=64)
    with pytest.raises(ValueError, match="`confidence` must lie"):
        ij.global_sensitivity(ishigami, CIRCLE, confidence=95.0)
    with pytest.raises(ValueError, match=r"depend on an input of `ranges`, but is 3.* for all 320 samples"):
        ij.global_sensitivity(lambda x: 3.0 + 0.0 * x["a"], CIRCLE, samples=64)


def test_the_picture_has_two_bars_an_input_and_asks_for_one_entry():
    found = ij.global_sensitivity(
        lambda x: jnp.stack([x["a"], 3.0 * x["b"] + x["a"]]), {"a": (0.0, 1.0), "b": (0.0, 1.0)}, samples=64
    )
    axes = ij.plot.show(found, index=1).axes[0]
    assert [label.get_text() for label in axes.get_yticklabels()] == ["b", "a"]
    widths = [bar.get_width() for bar in axes.patches]
    np.testing.assert_allclose(widths, [*found.first[::-1, 1], *found.total[::-1, 1]])
    with pytest.raises(ValueError, match="`index` must lead to one number"):
        ij.plot.global_sensitivity(found)


def test_two_answers_of_a_quantity_are_two_columns():
    both = ij.global_sensitivity(lambda x: (x["a"], x["a"] + x["b"]), CIRCLE, samples=64)
    np.testing.assert_allclose(both.first, [[1.0, 0.5], [0.0, 0.5], [0.0, 0.0]], atol=0.1)
