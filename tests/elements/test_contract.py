"""What every registered element must do: a new one is tested here unasked, by its line in the catalogue."""

import inspect
import math
from pathlib import Path
from typing import get_args

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from isojax import paper
from isojax._parameters import list_parameters, own_parameters, replace_parameters, to_free, to_physical
from isojax._results import is_successful
from isojax.elements import CATALOGUE, AbstractElement, Scales
from isojax.elements._element import Group
from isojax.elements._follower import AbstractFollower
from isojax.elements._force import AbstractForce
from isojax.elements._instrument import AbstractInstrument
from isojax.excitations import Harmonic
from isojax.models import Instant, Integrator, Isolator, load_model, save_model, simulate
from isojax.stability.orbit._describing_function import response_start
from isojax.stability.orbit._floquet import multipliers
from isojax.stability.orbit._period_map import period_map
from isojax.stability.orbit._sine import recorded_sine

CONTRACTS = (AbstractForce, AbstractInstrument, AbstractFollower)
SCALES = Scales(
    mass=800.0,
    force=150.0,
    displacement=3e-3,
    velocity=0.08,
    acceleration=2.2,
    angular_frequency=27.0,
    sample_time=1e-3,
    slowest_velocity=0.02,
    reading=2.2,
)

DRIVE = Harmonic(150.0, 4.3)

every_element = pytest.mark.parametrize("kind", CATALOGUE.values(), ids=CATALOGUE.keys())


def with_strength(element: AbstractElement, share: float) -> AbstractElement:
    """The element at a share of its typical strength."""
    strength = jnp.asarray(share * element.typical_strength(SCALES), dtype=float)
    return eqx.tree_at(lambda e: getattr(e, e.strength), element, strength)


def internal(element: AbstractElement, *, rest: bool, shape=(), seed=0) -> tuple:
    """Internal states at rest, or random ones of the size of the motion."""
    size = 0.0 if rest else 0.3 * SCALES.displacement
    draws = np.random.default_rng(seed).standard_normal((element.internal_states, *shape))
    return tuple(jnp.asarray(size * draw) for draw in draws)


def answers(element: AbstractElement, x, v, s, u, du, y) -> tuple:
    """Everything that the isolator asks an element."""
    return (
        element.force(x, v, s),
        element.state_rate(x, v, s),
        jnp.asarray(element.inertia()),
        element.drive(u, du),
        jnp.asarray(element.shift()) + jnp.asarray(element.skew()),
        element.reading(y, s),
        element.reading_rate(y, s),
        *follows(element, x, v, u),
    )


def follows(element: AbstractElement, x, v, u) -> tuple:
    """What signals of a record add, these as large as the drive."""
    channels = {name: math.cos(1.0 + place) * u for place, name in enumerate(element.channels)}
    if not channels:
        return (jnp.zeros(()),) * 4
    base = element.channel_base(channels)
    added = (
        0.0 if base is None else base,
        element.channel_drive(channels),
        element.channel_force(x, v, channels),
        element.channel_reading(channels),
    )
    return tuple(jnp.asarray(value) for value in added)


def motion(shape=(), seed=1) -> list:
    """Random displacement, velocity, drive, drive rate and reading of realistic size."""
    rng = np.random.default_rng(seed)
    sizes = (SCALES.displacement, SCALES.velocity, SCALES.force, SCALES.force * 27.0, SCALES.reading)
    return [jnp.asarray(size * rng.standard_normal(shape)) for size in sizes]


@every_element
def test_an_element_declares_what_it_is(kind):
    assert CATALOGUE[kind.name] is kind
    assert kind.name == kind.name.lower()
    assert len(kind.words.split()) >= 2
    assert kind.strength in [field for field, _ in own_parameters(kind)]
    assert isinstance(kind.signed, bool)
    assert isinstance(kind.active, bool)
    assert kind.group in get_args(Group)
    assert kind.proportional_to in ("", "displacement", "velocity")
    assert kind.internal_states >= 0
    assert kind.substeps >= 1
    assert kind.__subclasses__() == []


@every_element
def test_an_element_is_alone_in_the_file_of_its_name(kind):
    module = inspect.getmodule(kind)
    own = [
        member
        for member in vars(module).values()
        if inspect.isclass(member) and issubclass(member, AbstractElement) and member is not AbstractElement
    ]
    assert module.__name__ == f"isojax.elements._{kind.name}"
    assert own == [kind]


@every_element
def test_an_element_overrides_methods_of_one_contract_alone(kind):
    methods = [
        {name for name, what in vars(contract).items() if callable(what) and not name.startswith("_")}
        for contract in CONTRACTS
    ]
    assert [len(names) for names in methods] == [10, 4, 8]
    assert sum(bool(names & set(vars(kind))) for names in methods) == 1


@every_element
def test_an_element_says_where_its_law_comes_from(kind):
    assert "Source:" in inspect.getdoc(kind)
    for field, _ in own_parameters(kind):
        assert f"{field}: " in inspect.getdoc(kind)


@every_element
def test_a_law_declared_proportional_to_a_motion_is(kind):
    element = with_strength(kind.guess(SCALES), 0.3)
    if not kind.proportional_to:
        return
    x, v, *_ = motion((9,))
    along = {"displacement": x, "velocity": v}[kind.proportional_to]
    np.testing.assert_allclose(element.force(x, v, ()), getattr(element, kind.strength) * along, rtol=1e-14)


@every_element
def test_parameters_have_symbols_units_and_bounds(kind):
    for field, spec in own_parameters(kind):
        assert spec.symbol, field
        assert spec.unit, field
        assert spec.lower < spec.upper, field


@every_element
def test_a_strength_that_may_be_negative_is_not_bounded_at_zero(kind):
    lower = dict(own_parameters(kind))[kind.strength].lower
    assert lower < 0.0 if kind.signed else lower in (0.0, -math.inf)


@every_element
def test_the_guess_and_the_grid_are_the_absent_effect_within_bounds(kind):
    grid = kind.grid(SCALES)
    assert len(grid) >= 1
    for element in (kind.guess(SCALES), *grid):
        assert type(element) is kind
        assert float(getattr(element, kind.strength)) == 0.0
        for entry in list_parameters(element):
            assert entry.value.dtype == jnp.float64
            assert entry.value.shape == ()
            assert math.isfinite(entry.value)
            assert entry.spec.lower <= entry.value <= entry.spec.upper


@every_element
def test_the_grid_repeats_no_element(kind):
    points = [
        tuple(float(entry.value) for entry in list_parameters(element)) for element in kind.grid(SCALES)
    ]
    assert len(set(points)) == len(points)


@every_element
def test_zero_strength_removes_the_effect(kind):
    for element in (kind.guess(SCALES), *kind.grid(SCALES)):
        x, v, u, du, y = motion((7,))
        s = internal(element, rest=False, shape=(7,))
        force, _, inertia, driven, shift, reading, sensed, *followed = answers(element, x, v, s, u, du, y)
        for added in followed:
            np.testing.assert_array_equal(added, 0.0)
        np.testing.assert_array_equal(force, 0.0)
        assert float(inertia) == 0.0
        assert float(shift) == 0.0
        np.testing.assert_array_equal(driven, (u, du))
        np.testing.assert_array_equal(reading, y)
        assert len(sensed) == element.internal_states


@every_element
def test_the_typical_strength_is_positive_finite_and_does_something(kind):
    strength = kind.typical_strength(SCALES)
    assert math.isfinite(strength)
    assert strength > 0.0
    absent, present = kind.guess(SCALES), with_strength(kind.guess(SCALES), 1.0)
    x, v, u, du, y = motion()
    s = internal(present, rest=False)
    before = jax.tree.leaves(answers(absent, x, v, s, u, du, y))
    after = jax.tree.leaves(answers(present, x, v, s, u, du, y))
    assert any(float(jnp.max(jnp.abs(a - b))) > 0.0 for a, b in zip(before, after, strict=True))


@every_element
@pytest.mark.parametrize("share", [0.0, 0.1])
@pytest.mark.parametrize("shape", [0.6, 1.0, 1.7])
def test_derivatives_are_finite_at_rest(kind, share, shape):
    guess = kind.guess(SCALES)
    element = with_strength(
        replace_parameters(guess, [shape * p.value for p in list_parameters(guess)]), share
    )
    zero = jnp.asarray(0.0)

    def everything(element, x, v, s):
        return answers(element, x, v, s, zero, zero, zero)

    slopes = jax.jacfwd(everything, argnums=(0, 1, 2, 3))(element, zero, zero, internal(element, rest=True))
    for slope in jax.tree.leaves(slopes):
        assert bool(jnp.all(jnp.isfinite(slope)))


@every_element
def test_free_variables_and_physical_numbers_round_trip(kind):
    element = with_strength(kind.guess(SCALES), 0.1)
    for entry in list_parameters(element):
        scale = kind.typical_strength(SCALES) if entry.name == kind.strength else abs(entry.value) + 1e-300
        back = to_physical(to_free(entry.value, entry.spec, scale), entry.spec, scale)
        np.testing.assert_allclose(back, entry.value, rtol=1e-12)


@every_element
@pytest.mark.parametrize("shape", [(), (5,), (2, 3)])
def test_any_leading_shape_gives_the_single_answers(kind, shape):
    element = with_strength(kind.guess(SCALES), 0.1)
    x, v, u, du, y = motion(shape)
    s = internal(element, rest=False, shape=shape)
    together = jax.tree.leaves(eqx.filter_jit(answers)(element, x, v, s, u, du, y))
    flat = [jnp.ravel(value) for value in (x, v, u, du, y)]
    lanes = jax.vmap(lambda x, v, s, u, du, y: answers(element, x, v, s, u, du, y))
    apart = jax.tree.leaves(lanes(flat[0], flat[1], tuple(jnp.ravel(p) for p in s), *flat[2:]))
    for batch, single in zip(together, apart, strict=True):
        single = single if batch.shape == () and shape != () else jnp.reshape(single, shape)
        np.testing.assert_allclose(jnp.broadcast_to(batch, single.shape), single, rtol=1e-12)


@pytest.fixture(scope="module")
def absent():
    """A record of the paper's model with every effect at zero strength: one compilation serves all."""
    return simulated({name: kind.guess(SCALES) for name, kind in CATALOGUE.items()})


def simulated(effects: dict[str, AbstractElement], integrator: Integrator | None = None):
    """A record that is let go from the largest motion, so that it passes every gap."""
    model = paper.y_direction().with_elements(*effects.values())
    model = model.at(**{name: 1.1 * getattr(SCALES, name) for name in model.conditions})
    start = (SCALES.displacement,) + (0.0,) * (1 + model.internal_states)
    return simulate(model, DRIVE, duration=0.2, initial_state=start, integrator=integrator)


def test_effects_of_zero_strength_leave_the_simulated_record_as_it_was(absent):
    finest = Integrator(substeps=max(kind.substeps for kind in CATALOGUE.values()))
    without = simulated({}, finest)
    np.testing.assert_allclose(absent.reading, without.reading, rtol=1e-12, atol=1e-14)


@pytest.mark.parametrize("kind", [kind for kind in CATALOGUE.values() if not kind.channels])
def test_an_effect_simulates_and_shows_in_the_record(kind, absent):
    effects = {name: other.guess(SCALES) for name, other in CATALOGUE.items()}
    present = simulated(effects | {kind.name: with_strength(effects[kind.name], 0.1)})
    assert is_successful(present.result)
    assert bool(jnp.all(jnp.isfinite(present.reading)))
    assert float(jnp.max(jnp.abs(present.reading - absent.reading))) > 1e-6 * SCALES.reading


@every_element
def test_json_keeps_every_digit(kind, tmp_path):
    element = with_strength(kind.guess(SCALES), 1.0 / 3.0)
    model = Isolator(800.0 / 7.0, (element,))
    save_model(model, tmp_path / "model.json")
    assert eqx.tree_equal(load_model(tmp_path / "model.json"), model)


@every_element
def test_the_linearised_isolator_is_finite_at_rest(kind):
    model = paper.y_direction().with_elements(with_strength(kind.guess(SCALES), 0.1))
    size = 2 + model.internal_states
    rest, zero = tuple(jnp.asarray(0.0) for _ in range(size)), jnp.asarray(0.0)
    matrix = np.asarray(jax.jacfwd(lambda y: model.rates(y, Instant(zero, zero)))(rest))
    assert matrix.shape == (size, size)
    assert np.all(np.isfinite(matrix))
    assert kind.active or np.all(np.linalg.eigvals(matrix).real < 1e-9)


@every_element
def test_a_law_beside_its_kinks_is_the_law_where_it_lies_on_those_sides(kind):
    element = with_strength(kind.guess(SCALES), 0.5)
    for seed in range(8):
        x, v, *_ = motion((16,), seed)
        s = internal(element, rest=False, shape=(16,), seed=seed)
        sides = tuple(jnp.where(kink >= 0.0, 1.0, -1.0) for kink in element.kinks(x, v, s))
        force, rates = element.force(x, v, s), element.state_rate(x, v, s)
        np.testing.assert_allclose(element.force_beside(x, v, s, sides), force, rtol=1e-12)
        beside = element.state_rate_beside(x, v, s, sides)
        for one, other in zip(beside, rates, strict=True):
            np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-15)


@every_element
def test_a_sharp_law_is_the_limit_of_the_rounded_one(kind):
    element = with_strength(kind.guess(SCALES), 0.5)
    if not element.splits:
        return
    x, v, *_ = motion((64,))
    s = internal(element, rest=False, shape=(64,))
    # Corners lie within the motion, and the rounding far within the distance to any of them.
    element = replace_parameters(
        element,
        [
            1e-9 * p.value if p.name == "width" else 0.3 * SCALES.displacement if p.name == "gap" else p.value
            for p in list_parameters(element)
        ],
    )
    sides = tuple(jnp.where(corner < 0.0, -1.0, 1.0) for corner in element.corners(x, v, s))
    sharp = element.sharp_force(x, v, s, jnp.sign(v), sides)
    assert sharp.shape == x.shape
    np.testing.assert_allclose(sharp, element.force(x, v, s), rtol=1e-6, atol=1e-9 * SCALES.force)
    absent = with_strength(element, 0.0)
    assert float(jnp.max(jnp.abs(absent.sharp_force(x, v, s, jnp.sign(v), sides)))) == 0.0


@every_element
def test_an_absent_effect_adds_no_harmonic_to_a_drive(kind):
    absent = with_strength(kind.guess(SCALES), 0.0)
    assert not any(float(one.share) for one in absent.harmonics())


@every_element
def test_a_law_beside_a_kink_goes_on_smoothly_past_it(kind):
    # With the sides held, the slope across the kinks, which all lie at rest, is that of central differences;
    # for |s|s itself the two differ by |s|s times the step.
    element = with_strength(kind.guess(SCALES), 0.5)
    x, v, *_ = motion((16,))
    s = internal(element, rest=False, shape=(16,))
    sides = tuple(jnp.where(kink >= 0.0, 1.0, -1.0) for kink in element.kinks(x, v, s))
    if not sides:
        return

    def along(share):
        state = share * x, share * v, tuple(share * value for value in s)
        return jnp.stack([element.force_beside(*state, sides), *element.state_rate_beside(*state, sides)])

    step = 1e-4
    left, right = (along(sign * step) for sign in (-1.0, 1.0))
    slopes = jax.jvp(along, (0.0,), (1.0,))[1]
    np.testing.assert_allclose((right - left) / (2.0 * step), slopes, rtol=1e-3, atol=1e-9 * SCALES.force)


@eqx.filter_jit
def closed(model):
    """Newton's method on the period map of fixed steps: multipliers, and what is left open of the motion."""
    drive = recorded_sine(model, DRIVE.amplitude, DRIVE.frequency)
    start = response_start(model, DRIVE.amplitude, DRIVE.frequency)

    def moved(state):
        return jnp.stack(period_map(model, Integrator(), drive, tuple(state)))

    def improve(now):
        state, _, _, count = now
        # One copy of the period map in the compiled code, which is most of this test's time.
        units = jnp.eye(state.size)
        end, matrix = jax.vmap(lambda one: jax.jvp(moved, (state,), (one,)), out_axes=(None, 1))(units)
        step = jnp.linalg.solve(matrix - jnp.eye(state.size), end - state)
        return state - step, matrix, (end - state)[:2], count + 1

    def is_open(now):
        _, _, left, count = now
        return (count < 9) & (jnp.max(jnp.abs(left)) > 1e-9 * SCALES.velocity)

    nothing = jnp.full((start.size, start.size), jnp.nan), jnp.full(2, jnp.inf), 0
    _, matrix, left, _ = jax.lax.while_loop(is_open, improve, (start, *nothing))
    return multipliers(matrix), left


@pytest.mark.slow
@every_element
def test_an_orbit_of_the_isolator_with_the_effect_has_finite_multipliers(kind):
    # All other effects absent: one compilation serves all elements.
    effects = {name: other.guess(SCALES) for name, other in CATALOGUE.items()}
    effects[kind.name] = with_strength(effects[kind.name], 0.1)
    roots, left = closed(paper.y_direction().with_elements(*effects.values()))
    assert float(jnp.max(jnp.abs(left))) < 1e-8 * SCALES.velocity
    assert roots.shape == (2 + sum(other.internal_states for other in CATALOGUE.values()),)
    assert bool(jnp.all(jnp.isfinite(roots)))


def test_the_catalogue_holds_every_element_file():
    folder = Path(inspect.getfile(AbstractElement)).parent
    contracts = {"_init__", "element", "effect", "force", "instrument", "follower"}
    files = {path.stem[1:] for path in folder.glob("_*.py")} - contracts
    assert files == set(CATALOGUE)


@every_element
def test_look_alikes_are_effects_of_the_catalogue_and_exact_ones_are_translated(kind):
    element = with_strength(kind.guess(SCALES), 0.3)
    exact = {name for alike in kind.look_alikes if alike.exact for name in alike.others}
    assert {twin.name for twin in element.twins()} == exact
    for alike in kind.look_alikes:
        assert {*alike.others, *alike.beside} <= set(CATALOGUE) - {kind.name}
        assert bool(alike.beside) <= alike.exact
        assert len(alike.test.split()) > 5


def left_over(law, others, corners) -> float:
    """Share of a law's force, rounded or sharp, that no sum of others makes up along a random motion."""
    x = jnp.linspace(-2.0, 2.0, 41) * SCALES.displacement
    v = 0.3 * SCALES.velocity * jnp.cos(jnp.arange(41.0))

    def forces(one) -> np.ndarray:
        sides = tuple(jnp.where(value > 0.0, 1.0, -1.0) for value in one.corners(x, v, ()))
        return np.asarray(one.sharp_force(x, v, (), jnp.sign(v), sides) if corners else one.force(x, v, ()))

    columns = np.stack([forces(other) for other in others], axis=1)
    columns = columns / np.linalg.norm(columns, axis=0)
    left = forces(law) - columns @ np.linalg.lstsq(columns, forces(law), rcond=None)[0]
    return float(np.linalg.norm(left) / np.linalg.norm(forces(law)))


@every_element
@pytest.mark.parametrize("corners", [False, True], ids=["rounded", "sharp"])
def test_an_exact_look_alike_is_the_law_but_for_what_it_declares_beside_it(kind, corners):
    element = with_strength(kind.guess(SCALES), 0.3)
    for twin in element.twins():
        alike = next(one for one in kind.look_alikes if twin.name in one.others)
        beside = [with_strength(CATALOGUE[name].guess(SCALES), 1.0) for name in alike.beside]
        assert left_over(element, [twin, *beside], corners) < 1e-9
        # Were what stands beside them all there is, the test would say nothing.
        assert not beside or left_over(element, beside, corners) > 0.05
        back = kind.twin_of(twin)
        assert back is None or left_over(back, [twin, *beside], corners) < 1e-9
