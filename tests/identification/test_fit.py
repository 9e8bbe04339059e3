"""The fit: its error bars, its errors, what it refuses, and how it says that it failed."""

import dataclasses
import itertools

import numpy as np
import pytest

from isojax import paper, rig
from isojax._parameters import list_parameters
from isojax._results import RESULTS, is_successful
from isojax.elements import (
    CoulombFriction,
    CubicStiffness,
    InputGain,
    LinearDamping,
    LinearStiffness,
    LugreFriction,
    MaxwellBranch,
)
from isojax.excitations import Sampled
from isojax.identification import fit, load_fit, scales
from isojax.identification.fitting._build_problem import build_problem
from isojax.identification.fitting._estimate import estimate
from isojax.identification.fitting._fit import simulator_for
from isojax.identification.fitting._fit_result import warnings_of
from isojax.identification.fitting._initial_states import find_initial_states
from isojax.identification.fitting._integration_steps import find_integrator, step_error
from isojax.identification.fitting._problem import Problem
from isojax.identification.fitting._search import Search
from isojax.identification.jacobian._batch import coordinate_motion
from isojax.identification.jacobian._segments import cut_segments
from isojax.models import Integrator, Isolator, simulate
from isojax.records import estimate_noise

LINEAR = rig.Plant((rig.LinearStiffness(1.08e6), rig.LinearDamping(1e4)))
START = Isolator(800.0, (LinearStiffness(1.0e6), LinearDamping(1.3e4)))
BROAD = rig.Multisine((80.0,), 2.0, 14.0, period=2.0, periods=3, lines="full")
ONE_STEP = Integrator()


def _bench(**changes):
    fields = {"rate": 250.0, "drift": 0.0, "force_noise": 0.0, "anti_alias": False, "tolerance": 1e-8}
    return rig.Bench(**{**fields, **changes})


@pytest.fixture(scope="module")
def linear(simulated):
    """One broadband record of a linear oscillator."""
    return simulated(LINEAR, BROAD, 4)


@pytest.fixture(scope="module")
def fitted(linear):
    return fit(START, linear, integrator=ONE_STEP)


def _moved(found, campaign, truth):
    return {
        name: (float(found.model[name]) - value) / found.standard_errors[name]
        for name, value in truth.items()
    }


def test_the_papers_horizontal_law_is_recovered_from_stepped_sine(simulated):
    plan = rig.SteppedSine(
        (60.0, 120.0, 180.0), (4.4, 4.9, 5.4, 5.9, 6.4), cycles=12, directions=("forward",)
    )
    campaign = simulated(rig.y_plant(), plan, 5)
    truth = {entry.name: float(entry.value) for entry in list_parameters(paper.y_direction())[1:]}
    start = paper.y_direction().replace(
        linear_stiffness__coefficient=1.15e6,
        cubic_stiffness__coefficient=2.0e11,
        linear_damping__coefficient=8e3,
    )
    found = fit(start, campaign)
    assert is_successful(found.result)
    assert found.free == tuple(truth)
    assert max(abs(z) for z in _moved(found, campaign, truth).values()) < 3.5
    assert found.errors["fit"].chi2_per_dof == pytest.approx(1.0, abs=0.05)
    assert found.errors["holdout"] is None


def test_covariance_is_the_same_from_three_starts(linear):
    covariances = []
    for stiffness, damping in ((9e5, 5e3), (1.25e6, 2e4), (1.08e6, 1e4)):
        start = START.replace(linear_stiffness__coefficient=stiffness, linear_damping__coefficient=damping)
        found = estimate(
            simulator_for(start, linear, estimate_noise(linear), ONE_STEP),
            start,
            (1, 2),
            Search(scales(linear), max_steps=40, tolerance=1e-12),
        )
        covariances.append(found.uncertainty.covariance)
    np.testing.assert_allclose(covariances[1], covariances[0], rtol=1e-6)
    np.testing.assert_allclose(covariances[2], covariances[0], rtol=1e-6)


def test_covariance_is_in_physical_units_and_in_closed_form(linear, fitted):
    """Derivatives of a periodic linear response are those of its receptance."""
    record = linear.records[0]
    last = record.input[record.settle :]
    frequency = 2 * np.pi * np.fft.rfftfreq(last.size, 1.0 / record.rate)
    force = np.fft.rfft(last)
    k, c = (float(fitted.model[f"linear_{word}.coefficient"]) for word in ("stiffness", "damping"))
    receptance = 1.0 / (k - 800.0 * frequency**2 + 1j * frequency * c)
    columns = [
        np.fft.irfft(frequency**2 * receptance**2 * force * factor, last.size)
        for factor in (1.0, 1j * frequency)
    ]
    design = np.stack(columns, axis=1) / 0.01
    expected = np.linalg.inv(design.T @ design)
    # The two initial states and the stiffness scale of a single record take next to nothing.
    np.testing.assert_allclose(np.diag(fitted.covariance), np.diag(expected), rtol=0.02)


@pytest.mark.slow
def test_intervals_cover_the_truth_as_often_as_they_say(simulated):
    exact = simulated(LINEAR, BROAD, 4, _bench(noise=0.0), output={"noise": 0.01})
    record = exact.records[0]
    rng = np.random.default_rng(12)
    inside = []
    for _ in range(60):
        noisy = record.output + 0.01 * rng.standard_normal(record.output.size)
        campaign = dataclasses.replace(exact, records=(dataclasses.replace(record, output=noisy),))
        found = fit(START, campaign, integrator=ONE_STEP)
        truth = {"linear_stiffness.coefficient": 1.08e6, "linear_damping.coefficient": 1e4}
        inside += [abs(z) < 1.96 for z in _moved(found, campaign, truth).values()]
    assert 0.90 <= np.mean(inside) <= 0.99


def test_free_runs_are_simulated_from_the_state_of_the_first_second(linear, fitted):
    record = linear.records[0]
    run = fitted.free_runs[0]
    heading = int(record.settle)
    drive = Sampled(record.input, record.rate)

    def respond(state):
        return np.asarray(
            simulate(
                fitted.model,
                drive,
                duration=(record.output.size - 1) / record.rate,
                rate=record.rate,
                initial_state=state,
            ).reading
        )

    forced = respond((0.0, 0.0))
    basis = np.stack([respond((1e-3, 0.0)) - forced, respond((0.0, 1e-2)) - forced], axis=1)
    state = np.linalg.lstsq(basis[:heading], (record.output - forced)[:heading], rcond=None)[0]
    wanted = forced + basis @ state
    np.testing.assert_allclose(run.simulated, wanted, rtol=0.0, atol=5e-4 * np.std(wanted))
    left = (record.output - wanted)[record.settle :]
    errors = fitted.errors["fit"]
    assert errors.rmse == pytest.approx(np.sqrt(np.mean(left**2)), rel=1e-4)
    measured = record.output[record.settle :]
    assert errors.nrmse == pytest.approx(errors.rmse / np.std(measured), rel=1e-9)
    assert fitted.nrmse == errors.nrmse


def test_settle_samples_set_the_state_and_count_in_no_error(linear, fitted):
    record = linear.records[0]
    assert record.settle > 0
    for run in (fitted.free_runs[0], fitted.restarts.runs[0]):
        assert not run.counted[: record.settle].any()
        assert run.counted[record.settle :].all()
        assert not run.residual[: record.settle].any()
    assert fitted.stats.samples == record.output.size - record.settle


def test_internal_states_begin_a_free_run_at_rest(linear):
    model = START.with_elements(MaxwellBranch(2e5, 0.05))
    problem = build_problem(
        linear.records,
        model,
        quantity="acceleration",
        hold="band_limited",
        noise=(0.01,),
        integrator=ONE_STEP,
    )
    state = find_initial_states(problem, model)
    assert state.shape == (3, 1)
    assert state[2, 0] == 0.0
    assert np.any(state[:2])


def test_held_out_records_never_move_a_coefficient(simulated):
    plan = rig.Multisine((80.0, 50.0), 2.0, 14.0, period=2.0, periods=3, lines="full", holdout_levels=(65.0,))
    campaign = simulated(LINEAR, plan, 4, output={"noise": None})
    spoiled = tuple(
        dataclasses.replace(
            record, output=record.output + np.random.default_rng(1).standard_normal(record.output.size)
        )
        if record.role == "holdout"
        else record
        for record in campaign.records
    )
    first = fit(START, campaign, integrator=ONE_STEP)
    second = fit(START, dataclasses.replace(campaign, records=spoiled), integrator=ONE_STEP)
    for name in first.free:
        assert float(first.model[name]) == float(second.model[name])
    np.testing.assert_array_equal(first.covariance, second.covariance)
    assert first.errors["fit"] == second.errors["fit"]
    assert second.errors["holdout"].rmse > 10 * first.errors["holdout"].rmse


def test_fixed_and_free_names_decide_what_is_fitted(linear):
    held = fit(START, linear, fixed=("linear_damping.coefficient",), integrator=ONE_STEP)
    assert held.free == ("linear_stiffness.coefficient",)
    assert float(held.model["linear_damping.coefficient"]) == 1.3e4
    only = fit(START, linear, free=("c1",), integrator=ONE_STEP)
    assert only.free == ("linear_damping.coefficient",)
    assert float(only.model["linear_stiffness.coefficient"]) == 1.0e6


@pytest.mark.parametrize("argument", ["free", "fixed"])
def test_unknown_names_are_refused(linear, argument):
    with pytest.raises(ValueError, match=rf"`{argument}` must be one of .*linear_stiffness.*'stiffness'"):
        fit(START, linear, **{argument: ("stiffness",)})


def test_nothing_left_to_fit_is_refused(linear):
    with pytest.raises(ValueError, match="at least one coefficient"):
        fit(START, linear, fixed=("linear_stiffness.coefficient", "linear_damping.coefficient"))


def test_a_model_that_is_driven_otherwise_is_refused(linear):
    with pytest.raises(ValueError, match=r"`model` must have excitation \"force\""):
        fit(Isolator(800.0, START.elements, "base_acceleration"), linear)


def test_records_of_different_rates_are_refused(linear):
    record = linear.records[0]
    other = dataclasses.replace(record, name="slow", rate=200.0)
    with pytest.raises(ValueError, match=r"share one sampling rate.*250 Hz and slow 200 Hz"):
        fit(START, dataclasses.replace(linear, records=(record, other)), integrator=ONE_STEP)


def test_a_bound_holds_and_an_absent_effect_stays_small(linear):
    found = fit(START.with_elements(CoulombFriction(1.0, 5e-4)), linear, integrator=ONE_STEP)
    friction = float(found.model["coulomb_friction.force_level"])
    assert 0.0 <= friction < 4.0 * found.standard_errors["coulomb_friction.force_level"]


def test_a_start_that_runs_away_is_taken_up_again_from_its_linear_part(linear):
    found = fit(START.with_elements(CubicStiffness(-1e15)), linear, integrator=ONE_STEP)
    assert is_successful(found.result)
    name = "cubic_stiffness.coefficient"
    assert abs(float(found.model[name])) < 4.0 * found.standard_errors[name]  # the bench has none


def test_a_start_that_runs_away_gives_no_number(linear):
    start = START.with_elements(CubicStiffness(-1e15))
    # Held, the spring stays in the linear part too.
    found = fit(start, linear, integrator=ONE_STEP, fixed=("cubic_stiffness.coefficient",))
    assert found.result == RESULTS.not_finite
    assert np.isnan(found.errors["fit"]).all()
    assert np.isnan(found.covariance).all()
    assert all(np.isnan(error) for error in found.standard_errors.values())
    assert np.isnan(found.nrmse)
    assert all(np.isnan(run.simulated).all() for run in (*found.free_runs, *found.restarts.runs))
    assert any("left every bound" in line for line in warnings_of(found))


def test_a_start_that_grows_without_overflow_gives_no_number_either(linear):
    found = fit(START.replace(linear_stiffness__coefficient=-3e8), linear, integrator=ONE_STEP)
    assert not is_successful(found.result)
    assert np.isnan(found.errors["fit"]).all()


def test_a_search_cut_short_says_so_and_gives_no_error_bar(linear, tmp_path):
    found = fit(START, linear, integrator=ONE_STEP, max_steps=1)
    stats = found.stats
    assert np.all(np.isnan([stats.chi2, stats.aic, stats.bic, stats.stiffness_scatter]))
    found.save(tmp_path / "fit.json")
    assert np.isnan(load_fit(tmp_path / "fit.json").stats.chi2)
    assert found.result == RESULTS.not_converged
    assert np.isnan(found.errors["fit"]).all()
    assert all(np.isnan(error) for error in found.standard_errors.values())


def test_long_records_are_cut_into_windows_that_cover_them(simulated):
    plan = rig.Multisine((80.0,), 2.0, 14.0, period=4.0, periods=8, lines="full")
    campaign = simulated(LINEAR, plan, 4)
    segments = cut_segments(campaign.records, START)
    assert len(segments) >= 4
    assert segments[0].start <= campaign.records[0].settle
    assert segments[-1].stop == campaign.records[0].output.size
    assert all(one.stop == two.start for one, two in itertools.pairwise(segments))
    found = fit(START, campaign, integrator=ONE_STEP)
    truth = {"linear_stiffness.coefficient": 1.08e6, "linear_damping.coefficient": 1e4}
    assert max(abs(z) for z in _moved(found, campaign, truth).values()) < 3.5


def test_a_mass_without_a_spring_is_left_in_one_piece(simulated):
    campaign = simulated(LINEAR, rig.Multisine((80.0,), 2.0, 14.0, period=4.0, periods=8, lines="full"), 4)
    assert len(cut_segments(campaign.records, Isolator(800.0, (LinearDamping(1e4),)))) == 1


def test_base_excitation_is_fitted_in_the_relative_coordinate(simulated, campaign_of):
    """Above its resonance the mass hardly moves: the coordinate is nearly the base's motion."""
    driven = simulated(LINEAR, rig.Multisine((80.0,), 8.0, 30.0, period=2.0, periods=4, lines="full"), 6)
    record = driven.records[0]
    base = -record.input / 800.0
    felt = dataclasses.replace(record, input=base, output=record.output + base)
    campaign = campaign_of(
        (felt,), input={"quantity": "base_acceleration", "unit": "m/s^2"}, output={"noise": 0.01}
    )
    found = fit(Isolator(800.0, START.elements, "base_acceleration"), campaign, integrator=ONE_STEP)
    assert is_successful(found.result)
    truth = {"linear_stiffness.coefficient": 1.08e6, "linear_damping.coefficient": 1e4}
    assert max(abs(z) for z in _moved(found, campaign, truth).values()) < 3.5
    assert found.errors["fit"].chi2_per_dof == pytest.approx(1.0, abs=0.1)
    moved = simulate(found.model, Sampled(base, record.rate), duration=7.0, rate=record.rate)
    starts = coordinate_motion(felt, "acceleration", based=True)
    middle = slice(750, 1250)
    for seen, exact in zip(starts, (moved.displacement, moved.velocity), strict=True):
        away = seen[middle] - np.asarray(exact)[middle]
        assert np.std(away) < 0.3 * np.std(np.asarray(exact)[middle])


def test_a_free_mass_is_found(simulated):
    campaign = simulated(LINEAR, BROAD, 4, mass_free=True)
    found = fit(START.replace(mass=700.0), campaign, integrator=ONE_STEP)
    assert "mass" in found.free
    assert abs(float(found.model.mass) - 800.0) < 3.5 * found.standard_errors["mass"]


def test_a_mass_and_a_gain_cannot_be_told_apart_and_it_is_said(simulated):
    campaign = simulated(LINEAR, BROAD, 4, mass_free=True)
    found = fit(START.with_elements(InputGain(0.0)), campaign, integrator=ONE_STEP)
    assert np.isnan(found.standard_errors["mass"])
    assert np.isnan(found.standard_errors["input_gain.deviation"])
    assert any("not determined apart" in line for line in warnings_of(found))


def test_progress_is_told_a_line_a_step(linear):
    lines = []
    found = fit(START, linear, integrator=ONE_STEP, progress=lines.append)
    steps = [line for line in lines if line.startswith("step")]
    assert len(steps) == found.stats.steps
    assert all("chi2/dof" in line for line in steps)


def _stiff_problem(simulated, model) -> Problem:
    """A resonance at a twelfth of the sampling rate, where one Runge-Kutta step a sample is coarse."""
    plant = rig.Plant((rig.LinearStiffness(1.4e7), rig.LinearDamping(2e4)))
    campaign = simulated(plant, rig.Multisine((500.0,), 5.0, 40.0, period=1.0, periods=2, lines="full"), 4)
    return build_problem(
        campaign.records,
        model,
        quantity="acceleration",
        hold="band_limited",
        noise=(1e-3,),
        integrator=ONE_STEP,
    )


def test_the_steps_are_halved_until_their_error_is_small_beside_the_noise(simulated):
    model = Isolator(800.0, (LinearStiffness(1.4e7), LinearDamping(2e4)))
    problem = _stiff_problem(simulated, model)
    coarse, fine = step_error(problem, model, 1), step_error(problem, model, 2)
    assert coarse / fine == pytest.approx(16.0, rel=0.35)
    chosen = find_integrator(problem, model).integrator
    assert chosen.substeps > 1
    assert (
        step_error(problem, model, chosen.substeps) <= 0.05 < step_error(problem, model, chosen.substeps // 2)
    )


def test_an_element_with_a_sharp_law_keeps_its_own_steps(simulated):
    model = START.with_elements(LugreFriction(1.0, 1e-3, 0.0, 1e-2, 1e-3))
    problem = _stiff_problem(simulated, model)._replace(noise=(1e3,))
    assert find_integrator(problem, model).integrator.substeps == LugreFriction.substeps
    # Dry friction is split at its reversals instead.
    model = START.with_elements(CoulombFriction(1.0, 1.0))
    assert find_integrator(problem, model).integrator.substeps == 1
