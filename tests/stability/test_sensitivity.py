"""Derivatives against closed forms of the linear isolator, and against differences of the paper's model."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import isojax as ij

MASS, STIFFNESS, DAMPING, FORCE, FREQUENCY = 800.0, 1.0e6, 8.0e3, 100.0, 4.0
STATIC = ("linear_stiffness.coefficient", "linear_damping.coefficient", "mass")


def linear() -> ij.Isolator:
    return ij.Isolator(MASS, (ij.LinearStiffness(STIFFNESS), ij.LinearDamping(DAMPING)))


def receptance(k=STIFFNESS, c=DAMPING, m=MASS, force=FORCE, f=FREQUENCY):
    omega = 2 * np.pi * f
    return force / np.abs(k - m * omega**2 + 1j * omega * c)


def radius(k=STIFFNESS, c=DAMPING, m=MASS, f=FREQUENCY):
    return np.exp(-c / (2 * m * f))


def difference(function, name, value, share=1e-5):
    return (function(**{name: value * (1 + share)}) - function(**{name: value * (1 - share)})) / (
        2 * share * value
    )


@pytest.fixture(scope="module")
def of_orbit() -> ij.Sensitivity:
    orbit = ij.find_periodic_orbit(linear(), ij.Harmonic(FORCE, FREQUENCY))
    covariance = np.diag([(0.01 * STIFFNESS) ** 2, (0.05 * DAMPING) ** 2])
    return ij.sensitivity(orbit, covariance=covariance, covariance_of=STATIC[:2])


LETTERS = {
    "linear_stiffness.coefficient": ("k", STIFFNESS),
    "linear_damping.coefficient": ("c", DAMPING),
    "mass": ("m", MASS),
    "drive.amplitude": ("force", FORCE),
    "drive.frequency": ("f", FREQUENCY),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", LETTERS)
def test_amplitude_of_the_linear_isolator_moves_as_its_receptance(of_orbit: ij.Sensitivity, name: str):
    letter, value = LETTERS[name]
    expected = difference(receptance, letter, value)
    assert float(of_orbit.by("amplitude", name)) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("linear_stiffness.coefficient", 0.0),
        ("linear_damping.coefficient", -radius() / (2 * MASS * FREQUENCY)),
        ("mass", radius() * DAMPING / (2 * MASS**2 * FREQUENCY)),
        ("drive.amplitude", 0.0),
        ("drive.frequency", radius() * DAMPING / (2 * MASS * FREQUENCY**2)),
    ],
)
def test_spectral_radius_of_the_linear_isolator_moves_as_its_decay(of_orbit, name: str, expected: float):
    scale = radius() / LETTERS[name][1]
    assert float(of_orbit.by("spectral_radius", name)) == pytest.approx(expected, abs=1e-8 * scale, rel=1e-8)


def test_standard_error_is_that_of_first_order(of_orbit: ij.Sensitivity):
    slopes = [difference(receptance, *LETTERS[name]) for name in STATIC[:2]]
    expected = np.hypot(slopes[0] * 0.01 * STIFFNESS, slopes[1] * 0.05 * DAMPING)
    assert of_orbit.standard_errors is not None
    assert float(of_orbit.standard_errors["amplitude"]) == pytest.approx(expected, rel=1e-6)


def test_relative_sensitivities_of_the_amplitude_keep_its_dimension(of_orbit: ij.Sensitivity):
    # X = F / |k - m w^2 + i w c| is homogeneous: of degree 1 in F, -1 in (k, c, m) together.
    shares = dict(zip(of_orbit.parameters, np.asarray(of_orbit.relative("amplitude")), strict=True))
    assert shares["drive.amplitude"] == pytest.approx(1.0, rel=1e-7)
    assert sum(shares[name] for name in STATIC) == pytest.approx(-1.0, rel=1e-6)


@pytest.mark.slow
def test_map_of_the_linear_isolator_moves_as_its_receptance_in_every_cell():
    amplitudes, frequencies = np.linspace(50.0, 100.0, 3), np.linspace(3.0, 7.0, 5)
    sens = ij.sensitivity(ij.stability_map(linear(), amplitudes, frequencies))
    for name in ("linear_stiffness.coefficient", "linear_damping.coefficient", "mass"):
        letter, value = LETTERS[name]
        for row, force in enumerate(amplitudes):
            for column, f in enumerate(frequencies):
                expected = difference(lambda **kw: receptance(force=force, f=f, **kw), letter, value)  # noqa: B023
                assert float(sens.by("response", name)[row, column]) == pytest.approx(expected, rel=1e-4)
                decay = difference(lambda **kw: radius(f=f, **kw), letter, value)  # noqa: B023
                found = float(sens.by("spectral_radius", name)[row, column])
                assert found == pytest.approx(decay, rel=1e-4, abs=1e-4 / value)


@pytest.mark.slow
def test_derivatives_read_off_a_large_map_are_those_of_the_receptance_within_their_error():
    forces, band = np.linspace(50.0, 100.0, 60), np.linspace(3.0, 9.0, 60)
    # With so many steps that only the reading is in error.
    smap = ij.stability_map(linear(), forces, band, integrator=ij.Integrator(steps_per_period=512))
    sens = ij.sensitivity(smap, parameters=tuple(LETTERS))
    assert sens.error is not None
    assert sens.error <= 2e-5
    assert f"at most {sens.error:.2g}" in repr(sens)
    # Over the resonance at 5.6 Hz; the sum of the multipliers also follows the damped frequency.
    numbers = {"k": STIFFNESS, "c": DAMPING, "m": MASS, "force": forces[:, None], "f": band[None, :]}

    def two_multipliers(k, c, m, force, f):
        turn = np.sqrt(k / m - (c / (2 * m)) ** 2) / f
        return np.exp(-c / (2 * m * f)) * 2 * np.cos(turn) + 0.0 * force

    found = {
        "response": sens.derivatives["response"],
        "sum": sens.derivatives["multipliers"].sum(axis=-1).real,
    }
    for name, function in (("response", receptance), ("sum", two_multipliers)):
        exact = []
        for letter in numbers:
            # Fourth-order differences, whose own error is far below.
            step = 1e-3 * numbers[letter]

            def moved(times, letter=letter, function=function, step=step):
                return function(**(numbers | {letter: numbers[letter] + times * step}))

            slope = (8 * (moved(1) - moved(-1)) - (moved(2) - moved(-2))) / (12 * step)
            exact.append(np.broadcast_to(slope, (60, 60)))
        # Each over its size, its median, or the least share of what a relative change of another moves.
        scale = np.array([np.median(value) for value in numbers.values()])[:, None, None]
        moves = np.abs(exact) * scale
        usual = np.median(moves, axis=(1, 2), keepdims=True)
        size = np.maximum(np.maximum(moves, usual), 1e-4 * usual.max()) / scale
        off = np.abs(np.asarray(found[name]) - exact) / size
        assert off.max() <= sens.error + 1e-7, name


@pytest.fixture(scope="module")
def paper() -> ij.Isolator:
    return ij.paper.y_direction()


@pytest.fixture(scope="module")
def at_jump(paper: ij.Isolator) -> ij.Orbit:
    return ij.find_periodic_orbit(paper, ij.Harmonic(150.0, 4.3))


COEFFICIENTS = (
    "linear_stiffness.coefficient",
    "abs_quadratic_stiffness.coefficient",
    "cubic_stiffness.coefficient",
    "linear_damping.coefficient",
    "abs_quadratic_damping.coefficient",
    "cubic_damping.coefficient",
)


@pytest.fixture(scope="module")
def of_jump(at_jump: ij.Orbit) -> ij.Sensitivity:
    return ij.sensitivity(at_jump, parameters=COEFFICIENTS)


@pytest.mark.slow
def test_derivatives_near_the_jump_are_those_of_differences(paper, at_jump: ij.Orbit, of_jump):
    for place, name in enumerate(COEFFICIENTS):
        value = float(paper[name])

        def there(share: float, name: str = name, value: float = value) -> np.ndarray:
            changed = paper.replace(**{name.replace(".", "__"): value * (1 + share)})
            orbit = ij.find_periodic_orbit(changed, at_jump.excitation)
            return np.array([float(orbit.floquet.spectral_radius), float(orbit.amplitude)])

        step = 1e-4
        # Fourth-order differences: their own error stays below a millionth.
        slope = (8 * (there(step) - there(-step)) - (there(2 * step) - there(-2 * step))) / (
            12 * step * value
        )
        found = [float(of_jump.derivatives[name][place]) for name in ("spectral_radius", "amplitude")]
        assert found == pytest.approx(slope, rel=1e-6)


def reverse(model: ij.Isolator, quantity) -> np.ndarray:
    """Give the derivatives of a number of a model by its coefficients, in reverse mode."""
    slopes = jax.grad(quantity)(model)
    return np.array([float(slopes[name]) for name in COEFFICIENTS])


@pytest.mark.slow
def test_reverse_mode_gives_the_derivatives_of_an_orbit_that_forward_mode_gives(
    paper, at_jump: ij.Orbit, of_jump
):
    found = reverse(paper, lambda model: ij.find_again(at_jump, model).floquet.spectral_radius)
    size = np.array([float(paper[name]) for name in COEFFICIENTS])
    expected = size * np.asarray(of_jump.derivatives["spectral_radius"])
    np.testing.assert_allclose(size * found, expected, atol=1e-10 * np.abs(expected).max(), rtol=0.0)


@pytest.mark.slow
def test_derivatives_of_a_map_are_those_of_its_orbits(paper: ij.Isolator, of_jump: ij.Sensitivity):
    smap = ij.stability_map(paper, np.array([100.0, 150.0]), np.array([4.3, 5.0]), coexisting=True)
    sens = ij.sensitivity(smap, parameters=COEFFICIENTS)
    found = np.asarray(sens.derivatives["spectral_radius"])[:, 0, 1, 0]
    np.testing.assert_allclose(found, of_jump.derivatives["spectral_radius"], rtol=1e-4)
    backwards = reverse(paper, lambda model: ij.find_again(smap, model).spectral_radius[0, 1, 0])
    np.testing.assert_allclose(backwards, found, rtol=1e-10)
    with pytest.raises(ValueError, match=r"find_again\(smap, model\)"):
        jax.grad(lambda model: ij.stability_map(model, [100.0], [5.0]).response[0, 0])(paper)


@pytest.mark.slow
def test_fold_force_moves_as_the_fold_that_differences_find(paper: ij.Isolator):
    def fold(model: ij.Isolator) -> ij.SpecialPoint:
        found = ij.continue_branch(
            model, parameter="amplitude", frequency=4.3, start=120.0, stop=200.0, other_periods=()
        )
        return found.special_points[0]

    point = fold(paper)
    assert point.kind == "fold"
    names = ("cubic_stiffness.coefficient", "linear_damping.coefficient", "drive.frequency")
    sens = ij.sensitivity(point, parameters=names)
    for name in names[:2]:
        value, step = float(paper[name]), 1e-4
        changed = [paper.replace(**{name.replace(".", "__"): value * (1 + s * step)}) for s in (1, -1)]
        above, below = (float(fold(model).amplitude) for model in changed)
        assert float(sens.by("value", name)) == pytest.approx((above - below) / (2 * step * value), rel=1e-6)
    backwards = jax.grad(lambda model: ij.find_again(point, model).value)(paper)
    for name in names[:2]:
        assert float(backwards[name]) == pytest.approx(float(sens.by("value", name)), rel=1e-10)
    # The amplitude is what the fold solves for.
    with pytest.raises(ValueError, match=r"must be one of .*, but is 'drive\.amplitude'"):
        ij.sensitivity(point, parameters=("drive.amplitude",))


def test_function_of_a_model_is_differentiated_by_name():
    def static(model: ij.Isolator):
        return {"softness": 1.0 / model["linear_stiffness.coefficient"]}

    sens = ij.sensitivity(static, linear())
    assert float(sens.by("softness", "linear_stiffness.coefficient")) == pytest.approx(-1.0 / STIFFNESS**2)
    assert float(sens.by("softness", "mass")) == 0.0


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"parameters": ["stiffness"]}, r"`parameters` must be one of mass \(m\), .* but is 'stiff"),
        ({"parameters": ["k1", STATIC[0]]}, r"name linear_stiffness\.coefficient once, .* 'k1' and 'linear"),
        ({"parameters": []}, "`parameters` must name some of mass, .* but is empty"),
        ({"parameters": 3}, "`parameters` must list names of parameters, but is 3"),
        ({"covariance": np.eye(2), "covariance_of": ("k1", STATIC[0])}, "`covariance_of` must name linear_s"),
        ({"covariance": np.eye(2)}, "`covariance` and `covariance_of` must be given together"),
        ({"covariance": -np.eye(1), "covariance_of": "k1"}, "must be symmetric, with no negative variance"),
        ({"covariance": np.eye(3), "covariance_of": STATIC[:2]}, "a row and a column for each of 2 names"),
        (
            {"parameters": ["mass"], "covariance": np.eye(2), "covariance_of": STATIC[:2]},
            "lacks 'linear_stiff",
        ),
    ],
)
def test_what_does_not_fit_together_is_refused(given: dict, words: str, unchecked):
    with pytest.raises(ValueError, match=words):
        ij.sensitivity(lambda model: jnp.asarray(model.mass), linear(), **given)


def test_a_symbol_names_a_coefficient_as_its_name_does():
    def static(model: ij.Isolator):
        return model["k1"] ** 2 * model["c1"]

    whole = ij.sensitivity(static, linear())
    some = ij.sensitivity(static, linear(), parameters=["c1", "k1"], covariance=np.eye(1), covariance_of="k1")
    assert some.parameters == (STATIC[1], STATIC[0])
    assert float(whole.by("value", "c1")) == float(some.by("value", STATIC[1])) == STIFFNESS**2
    assert float(some.standard_errors["value"]) == pytest.approx(2.0 * STIFFNESS * DAMPING)
    with pytest.raises(ValueError, match=r"`parameter` must be one of .*\(c1\), .*\(k1\), but is 'm'"):
        some.by("value", "m")


def test_the_print_of_a_map_says_how_far_its_cells_move():
    """Made up: the response moves by 1 to 9 % a newton of the drive, and by twice as much with the damper."""
    response, share = np.full((3, 3), 2e-4), np.arange(1.0, 10.0).reshape(3, 3)
    slopes = np.stack([-2.0 * share / DAMPING * response, 0.01 * share * response])
    names = ("linear_damping.coefficient", "drive.amplitude")
    at, values = jnp.asarray([DAMPING, np.nan]), {"response": jnp.asarray(response)}
    moved = {"response": jnp.asarray(slopes)}
    shown = repr(ij.Sensitivity(names, ("c1", ""), ("N s/m", "N"), at, values, moved, None, 1.5e-5))
    assert "linear_damping.coefficient +1 %  response 10 (-18) %" in shown
    assert "drive.amplitude +1 N             response 5 (+9) %" in shown
    assert "relative error at most 1.5e-05" in shown


def test_what_has_no_percent_or_no_derivative_is_treated_as_such(unchecked):
    zero = repr(ij.sensitivity(lambda model: model["k1"] - STIFFNESS, linear(), parameters="k1"))
    assert "linear_stiffness.coefficient +1 %  value +1e+04" in zero  # of zero there are no percent
    with pytest.raises(ValueError, match=r"`subject` must be an orbit, .* but is of type str"):
        ij.sensitivity("k1", linear())
    with pytest.raises(ValueError, match=r"`subject` must be differentiable by `jax\.jacfwd`"):
        ij.sensitivity(lambda model: float(model["k1"]), linear())


@pytest.mark.parametrize(
    ("model", "drive", "words"),
    [
        (ij.Isolator(MASS, (ij.LinearStiffness(STIFFNESS),)), {}, "numbers only .* has linear_stiffness un"),
        (linear(), {"amplitude": np.ones(2)}, r"`amplitude` must be one real number, but has shape \(2,\)"),
        (linear(), {"amplitude": "100"}, "`amplitude` must be one real number, but is '100'"),
        (linear(), {"frequency": 1j}, r"`frequency` must be one real number"),
    ],
)
def test_an_answer_of_other_elements_or_drives_is_not_found_again(model, drive, words, unchecked):
    known = ij.stability_map(linear(), [FORCE], [FREQUENCY])
    with pytest.raises(ValueError, match=words):
        ij.find_again(known, model, **drive)


def test_a_function_needs_its_model():
    with pytest.raises(ValueError, match="`model` must be given where `subject` is a function"):
        ij.sensitivity(lambda model: jnp.asarray(model.mass))
