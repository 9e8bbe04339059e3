"""Physical numbers: declared, listed, replaced, and mapped to unbounded variables."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.special import expit

from isojax import paper
from isojax._parameters import (
    ParameterSpec,
    find_parameter,
    full_names,
    list_parameters,
    own_parameters,
    parameter,
    replace_parameters,
    to_free,
    to_physical,
)
from isojax.elements import CoulombFriction, LinearStiffness, MaxwellBranch
from isojax.models import Instant, Isolator

FREE = ParameterSpec("k", "N/m", -np.inf, np.inf, True)
BELOW = ParameterSpec("k", "N/m", 2.0, np.inf, True)
ABOVE = ParameterSpec("k", "N/m", -np.inf, 2.0, True)
BETWEEN = ParameterSpec("n", "1", 0.5, 10.0, True)


@pytest.mark.parametrize(
    ("spec", "expected"),
    [
        (FREE, lambda u: 7.0 * u),
        (BELOW, lambda u: 2.0 + 7.0 * np.log1p(np.exp(u))),
        (ABOVE, lambda u: 2.0 - 7.0 * np.log1p(np.exp(u))),
        (BETWEEN, lambda u: 0.5 + 9.5 * expit(u)),
    ],
)
def test_each_transform_is_its_formula(spec, expected):
    for u in (-3.0, 0.0, 0.7, 5.0):
        np.testing.assert_allclose(to_physical(jnp.asarray(u), spec, 7.0), expected(u), rtol=1e-14)


@pytest.mark.parametrize("spec", [FREE, BELOW, ABOVE, BETWEEN])
@pytest.mark.parametrize("scale", [1e-4, 1.0, 1e8])
def test_to_free_inverts_to_physical(spec, scale):
    for u in (-5.0, -0.3, 0.0, 2.0, 6.0):
        value = to_physical(jnp.asarray(u), spec, scale)
        if spec in (BELOW, ABOVE):
            distance = abs(float(value) - 2.0) / scale
            tolerance = max(1e-12, 1e-15 * 2.0 / scale / min(distance, 1.0) * 10.0)
        else:
            tolerance = 1e-12
        np.testing.assert_allclose(to_free(value, spec, scale), u, atol=tolerance, rtol=1e-12)


@pytest.mark.parametrize(
    ("spec", "low", "high"), [(BELOW, 2.0, np.inf), (ABOVE, -np.inf, 2.0), (BETWEEN, 0.5, 10.0)]
)
def test_no_free_variable_leaves_the_bounds(spec, low, high):
    for u in (-700.0, -30.0, 0.0, 30.0, 700.0):
        assert low <= float(to_physical(jnp.asarray(u), spec, 3.0)) <= high


@pytest.mark.parametrize(
    ("spec", "outside", "inside"),
    [
        (BELOW, 2.0, 2.0 + 3e-3),
        (BELOW, -50.0, 2.0 + 3e-3),
        (ABOVE, 2.0, 2.0 - 3e-3),
        (BETWEEN, 0.5, 0.5 + 9.5e-3),
    ],
)
def test_a_value_on_a_bound_starts_a_thousandth_inside_it(spec, outside, inside):
    start = to_free(outside, spec, 3.0)
    assert np.isfinite(start)
    np.testing.assert_allclose(to_physical(start, spec, 3.0), inside, rtol=1e-12)


def test_the_transform_has_a_finite_derivative_where_a_fit_starts():
    for spec in (FREE, BELOW, ABOVE, BETWEEN):
        slope = jax.grad(lambda u, spec=spec: to_physical(u, spec, 3.0))(to_free(2.0, spec, 3.0))
        assert np.isfinite(slope)
        assert slope != 0.0


def test_bounds_in_the_wrong_order_are_refused():
    with pytest.raises(ValueError, match=r"`lower` must be below `upper`, but 2.0 is not below 1.0"):
        parameter(symbol="k", unit="N/m", lower=2.0, upper=1.0)


def test_names_say_owner_and_field_and_count_second_elements():
    model = Isolator(
        800.0, (LinearStiffness(1.0), CoulombFriction(2.0, 3.0), LinearStiffness(4.0), LinearStiffness(5.0))
    )
    assert [(entry.name, float(entry.value)) for entry in list_parameters(model)] == [
        ("mass", 800.0),
        ("linear_stiffness.coefficient", 1.0),
        ("coulomb_friction.force_level", 2.0),
        ("coulomb_friction.width", 3.0),
        ("linear_stiffness_2.coefficient", 4.0),
        ("linear_stiffness_3.coefficient", 5.0),
    ]
    assert find_parameter(model, "linear_stiffness_2.coefficient") == 4
    changed = model.replace(linear_stiffness_2__coefficient=9.0)
    assert [
        float(element.coefficient) for element in changed.elements if element.name == "linear_stiffness"
    ] == [1.0, 9.0, 5.0]


def test_a_single_element_lists_its_fields_alone():
    assert [entry.name for entry in list_parameters(MaxwellBranch(1.0, 2.0))] == [
        "stiffness",
        "time_constant",
    ]
    assert own_parameters(MaxwellBranch) == own_parameters(MaxwellBranch(1.0, 2.0))


def test_replaced_values_stand_in_the_order_of_the_list():
    model = paper.z_direction()
    values = np.arange(1.0, 8.0)
    for given in (values.tolist(), jnp.asarray(values)):
        found = list_parameters(replace_parameters(model, given))
        np.testing.assert_array_equal([entry.value for entry in found], values)
        assert all(isinstance(entry.value, jax.Array) and entry.value.dtype == jnp.float64 for entry in found)


def test_elements_that_share_one_number_are_replaced_apart():
    shared = jnp.asarray(3.0)
    model = Isolator(shared, (LinearStiffness(shared), CoulombFriction(shared, shared)))
    found = list_parameters(replace_parameters(model, [1.0, 2.0, 4.0, 5.0]))
    assert [float(entry.value) for entry in found] == [1.0, 2.0, 4.0, 5.0]


def test_one_element_used_twice_is_replaced_apart():
    spring = LinearStiffness(3.0)
    found = list_parameters(replace_parameters(Isolator(800.0, (spring, spring)), [1.0, 2.0, 4.0]))
    assert [float(entry.value) for entry in found] == [1.0, 2.0, 4.0]


def test_a_wrong_count_of_values_is_refused():
    with pytest.raises(ValueError, match=r"`values` must hold 7 numbers, but holds 2"):
        replace_parameters(paper.z_direction(), [1.0, 2.0])


def test_replacing_is_differentiable():
    model = Isolator(800.0, (LinearStiffness(1e6),))

    def acceleration(values):
        state = (jnp.asarray(1e-3), jnp.asarray(0.0))
        return replace_parameters(model, values).acceleration(state, Instant(jnp.asarray(100.0)))

    slopes = jax.jacfwd(acceleration)(jnp.asarray([800.0, 1e6]))
    np.testing.assert_allclose(slopes, [(1e3 - 100.0) / 800.0**2, -1e-3 / 800.0], rtol=1e-13)


def test_a_parameter_is_named_once_by_name_or_symbol(unchecked):
    model = Isolator(800.0, (LinearStiffness(1e6), CoulombFriction(10.0, 1e-3)))
    names = ("coulomb_friction.force_level", "linear_stiffness.coefficient")
    assert full_names(model, ("Fc", "k1")) == full_names(model, names) == names
    assert full_names(model, "k1") == names[1:]
    assert full_names(model, ("pressure", "k1"), "free", "pressure") == ("pressure", names[1])
    with pytest.raises(ValueError, match=r"`free` must name linear_stiffness\.coefficient once, .* 'k1' and"):
        full_names(model, ("k1", names[1]), "free")
    with pytest.raises(ValueError, match="`free` must list names of parameters, but is 3"):
        full_names(model, 3, "free")
    with pytest.raises(ValueError, match=r"`name` must name linear_stiffness\.coefficient once"):
        model.replace(k1=1.0, linear_stiffness__coefficient=2.0)
