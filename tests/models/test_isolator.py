"""The isolator: names, replacement, and what it refuses."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from isojax import paper
from isojax._parameters import parameter
from isojax.elements import (
    AbsQuadraticStiffness,
    AbstractElement,
    CoulombFriction,
    CubicStiffness,
    EndStop,
    FractionalDamping,
    LinearDamping,
    LinearStiffness,
    MaxwellBranch,
    PressureStiffness,
    SensorGain,
    StribeckFriction,
)
from isojax.excitations import Harmonic
from isojax.models import (
    ContinuedLaw,
    Instant,
    Isolator,
    Regime,
    freeing_accelerations,
    law_beside,
    simulate,
)
from isojax.stability import find_periodic_orbit


def test_numbers_become_float64_arrays():
    model = Isolator(800, (LinearStiffness(1000000), LinearDamping(np.float32(2.0))))
    for entry in model.parameters:
        assert entry.value.dtype == jnp.float64


def test_a_parameter_is_read_and_replaced_by_its_name_in_reports():
    model = paper.y_direction()
    assert float(model["cubic_stiffness.coefficient"]) == 2.51667e11
    changed = model.replace(cubic_stiffness__coefficient=2e11, mass=790.0)
    assert float(changed["cubic_stiffness.coefficient"]) == 2e11
    assert float(changed["mass"]) == 790.0
    assert float(changed["linear_stiffness.coefficient"]) == float(model["linear_stiffness.coefficient"])
    assert float(model["mass"]) == 800.0


def test_a_replaced_model_compiles_nothing_anew():
    model = paper.y_direction()
    traced = []

    @eqx.filter_jit
    def stiffness(model):
        traced.append(1)
        return model["linear_stiffness.coefficient"]

    stiffness(model)
    stiffness(model.replace(linear_stiffness__coefficient=2.0))
    stiffness(model.replace(mass=jnp.asarray(3.0)))
    assert len(traced) == 1


def test_a_symbol_stands_for_the_one_parameter_that_has_it():
    friction = CoulombFriction(1.0, 1e-3), StribeckFriction(1.0, 2.0, 0.1, 1e-3)
    model = Isolator(2.0, (LinearStiffness(3.0), *friction))
    assert float(model["k1"]) == 3.0
    assert float(model.replace(k1=4.0)["linear_stiffness.coefficient"]) == 4.0
    with pytest.raises(ValueError, match=r"'vs', the symbol of coulomb_friction\.width and stribeck"):
        model["vs"]


def test_an_unknown_parameter_is_refused_with_the_names_there_are():
    model = Isolator(800.0, (LinearStiffness(1e6),))
    with pytest.raises(
        ValueError, match=r"one of mass \(m\), linear_stiffness.coefficient \(k1\), but is 'damping'"
    ):
        model["damping"]
    with pytest.raises(ValueError, match=r"'cubic_stiffness.coefficient'"):
        model.replace(cubic_stiffness__coefficient=1.0)


def test_an_element_is_found_by_its_catalogue_name():
    model = paper.y_direction()
    assert isinstance(model.element("cubic_stiffness"), CubicStiffness)
    assert model.element("bouc_wen") is None


def test_elements_are_appended_and_the_rest_kept():
    model = Isolator(800.0, (LinearStiffness(1e6),), "base_acceleration").with_elements(LinearDamping(1e4))
    assert [element.name for element in model.elements] == ["linear_stiffness", "linear_damping"]
    assert model.excitation == "base_acceleration"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((0.0, ()), r"`mass` must be positive, but is 0.0"),
        ((1.0, (EndStop(1e6, 1e-3, 0.0, 0.0),)), r"`end_stop.width` must be positive, but is 0.0"),
        ((-800.0, ()), r"`mass` must be positive, but is -800.0"),
        ((float("nan"), ()), r"`mass` must be positive, but is nan"),
        (
            (800.0, (PressureStiffness(1e5, 0.0),)),
            r"`pressure_stiffness.reference` must be positive, but is 0.0",
        ),
        ((800.0, (LinearStiffness, 3.0)), r"`elements` must hold elements, but elements\[0\]"),
        ((800.0, (), "base"), r"`excitation` must be .*, but is 'base'"),
    ],
)
def test_what_is_no_isolator_is_refused(unchecked, arguments, message):
    with pytest.raises(ValueError, match=message):
        Isolator(*arguments)


@pytest.mark.parametrize(
    ("element", "message"),
    [
        (MaxwellBranch(1e5, -0.1), r"`maxwell_branch.time_constant` must be at least 0 s, but is -0.1"),
        (
            FractionalDamping(2e4, 1.7, 1.0, 1e3),
            r"`fractional_damping.order` must lie from 0.02 to 0.98, but is 1.7",
        ),
    ],
)
def test_a_shape_that_no_element_admits_is_refused_where_a_model_is_asked_for(element, message):
    model = Isolator(800.0, (LinearStiffness(1e6), element))
    for ask in (
        lambda: simulate(model, Harmonic(100.0, 5.0), duration=1.0, rate=100.0),
        lambda: find_periodic_orbit(model, Harmonic(100.0, 5.0)),
    ):
        with pytest.raises(ValueError, match=message):
            ask()


def test_numbers_that_no_model_admits_do_not_replace_others():
    model = Isolator(800.0, (LinearStiffness(1e6), MaxwellBranch(1e5, 0.1)))
    with pytest.raises(ValueError, match=r"`maxwell_branch.time_constant` must be at least 0 s, but is -1.0"):
        model.replace(maxwell_branch__time_constant=-1.0)
    with pytest.raises(ValueError, match=r"`mass` must be positive, but is 0.0"):
        model.replace(mass=0.0)


def test_a_number_that_is_named_in_two_ways_is_refused():
    model = Isolator(800.0, (LinearStiffness(1e6),))
    twice = {"linear_stiffness.coefficient": 2e6, "linear_stiffness__coefficient": 3e6}
    with pytest.raises(ValueError, match=r"linear_stiffness\.coefficient"):
        model.replace(**twice)


def test_a_model_is_built_inside_a_traced_function():
    @jax.jit
    def force(mass):
        model = Isolator(mass, (LinearStiffness(1e6),))
        return model.acceleration((jnp.asarray(1e-3), jnp.asarray(0.0)), Instant(jnp.asarray(0.0)))

    np.testing.assert_allclose(force(500.0), -2.0, rtol=1e-14)
    np.testing.assert_allclose(jax.grad(force)(500.0), 2.0 / 500.0, rtol=1e-14)


def test_lanes_of_states_give_lanes_of_rates():
    model = paper.y_direction()
    state = (jnp.asarray([1e-3, -2e-3, 0.0]), jnp.asarray([0.0, 0.05, 0.1]))
    together = model.rates(state, Instant(jnp.asarray([1.0, 2.0, 3.0])))
    for lane in range(3):
        alone = model.rates(tuple(value[lane] for value in state), Instant(jnp.asarray(lane + 1.0)))
        np.testing.assert_allclose([value[lane] for value in together], alone, rtol=1e-14)


def test_a_sensor_with_memory_follows_the_reading_of_the_instruments_before_it():
    class Follower(AbstractElement):
        name = "follower"
        words = "first-order lag of the sensor"
        strength = "lag"
        internal_states = 1

        lag: jax.Array = parameter(symbol="T", unit="s")

        @classmethod
        def guess(cls, scales):
            return cls(0.0)

        @classmethod
        def typical_strength(cls, scales):
            return 1.0

        def reading_rate(self, y, s):
            return ((y - s[0]) / self.lag,)

        def reading(self, y, s):
            return s[0]

    state, zero = (jnp.asarray(1e-3), jnp.asarray(0.0), jnp.asarray(2e-3)), jnp.asarray(0.0)
    before = Isolator(800.0, (SensorGain(1.0), Follower(0.1)))
    after = Isolator(800.0, (Follower(0.1), SensorGain(1.0)))
    np.testing.assert_allclose(
        before.rates(state, Instant(zero), "displacement")[2], (2e-3 - 2e-3) / 0.1, atol=1e-15
    )
    np.testing.assert_allclose(
        after.rates(state, Instant(zero), "displacement")[2], (1e-3 - 2e-3) / 0.1, rtol=1e-14
    )
    np.testing.assert_allclose(before.reading(state, Instant(zero), "displacement"), 2e-3, rtol=1e-14)
    np.testing.assert_allclose(after.reading(state, Instant(zero), "displacement"), 4e-3, rtol=1e-14)


def test_the_law_that_is_meant_is_said_beside_the_state_and_not_guessed_from_it():
    model = Isolator(2.0, (AbsQuadraticStiffness(3e6), CoulombFriction(10.0, 1e-3)))
    state, at = (jnp.asarray(1e-3), jnp.asarray(0.0)), Instant(jnp.asarray(8.0))
    one = jnp.ones(())
    np.testing.assert_allclose(model.acceleration(state, at), (8.0 - 3.0) / 2.0, rtol=1e-14)
    # The law of the other side of rest, carried on to a positive displacement; friction without its rounding.
    beside = ContinuedLaw((-one,) * len(model.switches(state)))
    np.testing.assert_allclose(model.acceleration(state, at, beside), (8.0 + 3.0 + 10.0) / 2.0, rtol=1e-14)
    held = law_beside(model, (-one, 0.0 * one))
    np.testing.assert_allclose(model.acceleration(state, at, held), 0.0, atol=1e-14)
    forward, backward = freeing_accelerations(model, state, at, (-one, 0.0 * one))
    np.testing.assert_allclose(forward, (8.0 + 3.0 - 10.0) / 2.0, rtol=1e-14)
    np.testing.assert_allclose(backward, (8.0 + 3.0 + 10.0) / 2.0, rtol=1e-14)
    for direction, expected in (
        (1.0, (8.0 - 3.0 - 10.0) / 2.0),
        (-1.0, (8.0 - 3.0 + 10.0) / 2.0),
        (0.0, 0.0),
    ):
        sharp = Regime(direction * one, (one,) * len(model.corners(state)))
        np.testing.assert_allclose(model.acceleration(state, at, sharp), expected, rtol=1e-14)
