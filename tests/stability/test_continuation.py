"""Branches of periodic orbits against closed forms, harmonic balance and an independent table of folds."""

import re

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy_map

import isojax as ij

TABLE = {
    4.0: (211.67, 211.31, 1.023),
    4.1: (194.01, 190.62, 1.089),
    4.2: (178.12, 171.89, 1.120),
    4.4: (150.66, 144.52, 1.105),
    4.6: (128.87, 128.11, 1.026),
}
"""Frequency [Hz] to upper fold [N], lower fold [N] and largest multiplier of the saddles: found by others
with RK4 shooting and variational equations, forces good to 0.01 N."""

LINEAR = ij.Isolator(2.0, (ij.LinearDamping(3.0), ij.LinearStiffness(800.0)))
DUFFING = ij.Isolator(1.0, (ij.LinearDamping(0.02), ij.LinearStiffness(1.0), ij.CubicStiffness(1e-3)))


def along_force(model, frequency, start=1.0, stop=400.0, **options):
    asked = {"other_periods": (), **options}
    return ij.continue_branch(
        model, parameter="amplitude", frequency=frequency, start=start, stop=stop, **asked
    )


def test_what_is_compiled_for_one_part_of_the_drive_serves_the_other_and_any_length(caplog):
    parts = {"_starts", "trace", "_points_of_block", "_locate", "polish"}

    def compiled(parameter, start, stop, **drive):
        caplog.clear()
        with jax.log_compiles():
            branch = ij.continue_branch(
                DUFFING, parameter=parameter, start=start, stop=stop, other_periods=(), **drive
            )
        return branch, parts & set(re.findall(r"Compiling jit\((\w+)\)", caplog.text))

    force, first = compiled("amplitude", 0.1, 10.0, frequency=0.2)
    swept, again = compiled("frequency", 0.05, 0.4, amplitude=0.3)
    assert (force.special_points[0].kind, swept.special_points[0].kind) == ("fold", "fold")
    assert (first, again) == (parts, set())
    blocks = {-(-branch.points.value.size // 128) for branch in (force, swept)}
    assert len(blocks) == 2


@pytest.fixture(scope="module")
def paper_branches():
    return along_force(ij.paper.y_direction(), jnp.array([*TABLE, 4.7]))


@pytest.mark.slow
def test_folds_of_the_paper_model_are_those_of_the_table(paper_branches):
    for place, (frequency, (upper, lower, _)) in enumerate(TABLE.items()):
        points = [point for point in paper_branches.special_points if point.branch == place]
        assert [point.kind for point in points] == ["fold", "fold"]
        assert [float(point.frequency) for point in points] == pytest.approx([frequency] * 2, rel=1e-14)
        assert [float(point.amplitude) for point in points] == pytest.approx([upper, lower], abs=0.01)
    assert {point.branch for point in paper_branches.special_points} == set(range(5))


@pytest.mark.slow
def test_saddles_are_as_unstable_as_in_the_table(paper_branches):
    largest = np.nanmax(np.asarray(paper_branches.points.spectral_radius), axis=1)
    np.testing.assert_allclose(largest[:5], [row[2] for row in TABLE.values()], atol=1e-3)
    assert largest[5] < 1.0


@pytest.mark.slow
def test_every_branch_of_a_batch_ends_at_the_stop(paper_branches):
    values = np.asarray(paper_branches.points.value)
    assert np.all(np.asarray(paper_branches.result == ij.RESULTS.successful))
    for row in values:
        assert row[np.isfinite(row)][-1] == pytest.approx(400.0, rel=1e-7)
    assert values[:, 0] == pytest.approx(1.0, rel=1e-7)


@pytest.mark.slow
def test_folds_carry_the_multiplier_one_by_scipy(paper_branches):
    for point in paper_branches.special_points[:4]:
        end, matrix, _ = scipy_map.after(
            scipy_map.paper_y_law(), 800.0, float(point.amplitude), float(point.frequency), point.y0, 1.0
        )
        np.testing.assert_allclose(end, point.y0, rtol=0, atol=1e-8 * np.abs(end).max())
        values = scipy_map.eigenvalues(matrix)
        # At a fold multipliers answer with the root of an error: compare their symmetric functions.
        assert np.sum(values) == pytest.approx(complex(np.sum(point.multipliers)), abs=1e-7)
        assert abs((values[0] - 1.0) * (values[1] - 1.0)) < 1e-7


@pytest.mark.slow
def test_one_branch_is_that_of_the_batch(paper_branches):
    alone = along_force(ij.paper.y_direction(), 4.2)
    count = alone.points.value.shape[0]
    np.testing.assert_allclose(alone.points.value, paper_branches.points.value[2, :count], rtol=1e-9)
    folds = [float(point.amplitude) for point in alone.special_points]
    batch = [float(point.amplitude) for point in paper_branches.special_points if point.branch == 2]
    assert folds == pytest.approx(batch, rel=1e-9)


def test_a_linear_isolator_answers_in_closed_form():
    branch = ij.continue_branch(
        LINEAR, parameter="frequency", amplitude=5.0, start=1.0, stop=8.0, other_periods=()
    )
    assert ij.is_successful(branch.result)
    assert branch.special_points == ()
    omega = 2 * np.pi * np.asarray(branch.points.value)
    answer = 5.0 / (800.0 - 2.0 * omega**2 + 3.0j * omega)
    np.testing.assert_allclose(branch.points.response, np.abs(answer), rtol=1e-6)
    np.testing.assert_allclose(branch.points.y0[:, 0], answer.imag, atol=1e-6 * np.abs(answer).max())
    decay = np.exp(-0.5 * 3.0 / 2.0 / np.asarray(branch.points.frequency))
    np.testing.assert_allclose(branch.points.spectral_radius, decay, rtol=1e-6)
    assert np.all(branch.points.stable)


def test_a_linear_isolator_answers_a_changing_mass_in_closed_form():
    branch = ij.continue_branch(
        LINEAR,
        parameter="mass",
        amplitude=5.0,
        frequency=3.0,
        start=1.0,
        stop=4.0,
        step=0.05,
        other_periods=(),
    )
    assert ij.is_successful(branch.result)
    omega = 6.0 * np.pi
    answer = 5.0 / (800.0 - np.asarray(branch.points.value) * omega**2 + 3.0j * omega)
    np.testing.assert_allclose(branch.points.response, np.abs(answer), rtol=1e-6)
    assert np.all(np.asarray(branch.points.frequency) == 3.0)


@pytest.mark.slow
def test_weak_duffing_folds_are_those_of_harmonic_balance():
    # ((1 - w^2 + 3/4 k X^2)^2 + (c w)^2) X^2 = F^2; a fold where F^2 has an extremum over X^2.
    omega, stiff, damping = 1.05, 1e-3, 0.02
    detuned, bend = 1.0 - omega**2, 0.75 * stiff
    squares = np.roots([3 * bend**2, 4 * bend * detuned, detuned**2 + (damping * omega) ** 2])
    forces = np.sqrt(squares * ((detuned + bend * squares) ** 2 + (damping * omega) ** 2))
    branch = along_force(DUFFING, omega / (2 * np.pi), start=0.01, stop=1.0)
    folds = [float(point.amplitude) for point in branch.special_points]
    assert [point.kind for point in branch.special_points] == ["fold", "fold"]
    assert folds == pytest.approx(sorted(forces, reverse=True), rel=2e-3)


def test_too_few_points_are_said_to_be_too_few():
    branch = along_force(DUFFING, 1.05 / (2 * np.pi), start=0.01, stop=1.0, most=20)
    assert branch.result == ij.RESULTS.not_converged
    assert branch.points.value.shape == (20,)
    words = f"NOT WHOLE: the search stopped at amplitude {float(branch.points.value[-1]):.5g}"
    assert words in repr(branch)
    assert words in ij.plot.branch(branch).axes[0].get_title("left")
    assert np.all(np.isfinite(branch.points.value))


@pytest.mark.slow
def test_fold_derivatives_are_central_differences():
    model = ij.paper.y_direction()

    def fold(model):
        return along_force(model, 4.3).special_points[0].amplitude

    slopes = jax.jacfwd(fold)(model)
    for name in ("mass", "abs_quadratic_stiffness.coefficient", "cubic_damping.coefficient"):
        value = model[name]

        def moved(share, name=name, value=value):
            return float(fold(model.replace(**{name.replace(".", "__"): value * (1.0 + share)})))

        coarse, fine = ((moved(h) - moved(-h)) / (2 * h * value) for h in (2e-3, 1e-3))
        assert float(slopes[name]) == pytest.approx(float((4 * fine - coarse) / 3), rel=1e-6)


@pytest.mark.slow
def test_derivatives_of_points_are_those_across_the_branch():
    # Of the linear answer X(F) = F |H| at fixed F the derivative is known; the points also slide along F.
    def response(model):
        branch = along_force(model, 3.0, start=1.0, stop=5.0)
        return branch.points.response, branch.points.value

    (slopes, slides), (size, force) = jax.jacfwd(response)(LINEAR), response(LINEAR)
    omega = 6.0 * np.pi
    answer = 1.0 / (800.0 - 2.0 * omega**2 + 3.0j * omega)
    by_mass = np.abs(answer) * np.real(answer * omega**2)
    corrected = slopes.mass - np.asarray(size / force) * slides.mass
    np.testing.assert_allclose(corrected, np.asarray(force) * by_mass, rtol=1e-5)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"parameter": "colour"}, "`parameter`"),
        ({"frequency": None}, "`frequency` must be given"),
        ({"amplitude": 3.0}, "`amplitude` must be omitted"),
        ({"stop": 1.0}, "`stop`"),
        ({"stop": np.inf}, "`stop`"),
        ({"frequency": 0.0}, "`frequency` must be a positive frequency"),
        ({"start_state": [1.0]}, "`start_state` must hold 2 states, but holds 1"),
        ({"step": 0.0}, "`step` must be positive, but is 0.0"),
        ({"most": 0}, "`most` must be positive"),
        ({"periods": 2, "symmetric": True}, "`symmetric` must be False"),
    ],
)
def test_bad_arguments_are_refused(options, words):
    asked = {"parameter": "amplitude", "frequency": 3.0, "start": 1.0, "stop": 5.0, **options}
    with pytest.raises(ValueError, match=words):
        ij.continue_branch(LINEAR, **asked)


def test_a_traced_model_is_refused():
    with pytest.raises(ValueError, match="`model` must hold known numbers"):
        jax.jit(lambda model: along_force(model, 3.0).points.value)(LINEAR)
