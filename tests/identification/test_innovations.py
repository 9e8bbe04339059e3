"""Records without dwells: coefficients and the sizes of the errors, by a filter's innovations."""

import sys
from pathlib import Path

import numpy as np
import pytest
import scipy
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from isojax import Isolator, is_successful, read_campaign
from isojax.elements import CoulombFriction, CubicStiffness, LinearDamping, LinearStiffness, MaxwellBranch
from isojax.identification import diagnose, fit
from isojax.identification.innovations import (
    Measured,
    RecordFilter,
    Sizes,
    _fit_errors,
    eliminate,
    first_sizes,
    fit_errors,
    fit_measured,
    free_squares,
    refined,
    squares_ahead,
)
from isojax.records import Record

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))

MASS, STIFFNESS, DAMPING, RATE = 3.0, 4000.0, 9.0, 200.0
FED = 150
"""Samples over which a filter follows a record between two predictions."""


def record(drive, output, name="one"):
    time = np.arange(drive.size) / RATE
    return Record(name, Path(name), time, RATE, drive, output, drive, output)


def linear(**more):
    return Isolator(MASS, (LinearStiffness(STIFFNESS), LinearDamping(DAMPING)), **more)


def smooth_noise(rng, size):
    """Noise without power near half the rate, so that a hold between samples hardly matters."""
    return scipy.signal.sosfiltfilt(scipy.signal.butter(4, 0.2, output="sos"), rng.standard_normal(size))


def there_and_back(rng, size):
    """Two records of unrelated drive and displacement: one, and the same from its end to its start."""
    drive, output = smooth_noise(rng, size), 1e-3 * smooth_noise(rng, size)
    return record(drive, output), record(drive[::-1], output[::-1], "two")


def kalman_deviance(drive, output, start, spread, force, noise, branch=None):
    """-2 log-likelihood but for a constant: the drive is straight between samples, its random force held.

    Beyond four standard deviations an innovation counts for so much. Last it gives how many do. `branch` is
    stiffness and time constant of a Maxwell branch, whose displacement is a third state.
    """
    rates = np.array([[0.0, 1.0], [-STIFFNESS / MASS, -DAMPING / MASS]])
    if branch is not None:
        rates = np.pad(rates, (0, 1))
        rates[1, 2], rates[2] = -branch[0] / MASS, [0.0, 1.0, -1.0 / branch[1]]
    size = len(rates)
    whole = np.zeros((size + 2, size + 2))
    whole[:size, :size], whole[1, size], whole[size, size + 1] = rates / RATE, 1.0 / MASS / RATE, 1.0
    whole = expm(whole)
    ahead, held, ramp = whole[:size, :size], whole[:size, size], whole[:size, size + 1]
    mean, covariance, deviance, spikes = start.copy(), np.diag(spread), 0.0, 0
    for k, measured in enumerate(output):
        variance = covariance[0, 0] + noise
        error, gain = measured - mean[0], covariance[:, 0] / variance
        if abs(error) > 4.0 * np.sqrt(variance):  # a spike
            spikes, gain = spikes + 1, gain * 4.0 * np.sqrt(variance) / abs(error)
        ratio = error**2 / variance
        deviance += np.log(variance) + (ratio if ratio < 16.0 else 16.0 + 16.0 * np.log(ratio / 16.0))
        mean, covariance = mean + gain * error, covariance - np.outer(gain, covariance[0])
        if k + 1 < output.size:
            mean = ahead @ mean + held * drive[k] + ramp * (drive[k + 1] - drive[k])
            covariance = ahead @ covariance @ ahead.T + force * np.outer(held, held)
    return deviance, spikes


@pytest.mark.parametrize("force", [1.0, 10.0])
def test_the_likelihood_is_that_of_a_kalman_filter(force):
    rng = np.random.default_rng(3)
    records = there_and_back(rng, 900)
    own = RecordFilter(linear(), Measured(records, "displacement", "linear", np.full(2, 1.0)), 4)
    force, noise = force**2, 2e-5**2
    way = own.follow((), np.zeros((7, 0)), Sizes(np.log(force), -30.0, np.log(np.full(2, noise))).around())
    for place, one in enumerate(records):
        start, spread = own.starts[:, place], own.spread[:, place]
        wanted, spikes = kalman_deviance(one.input, one.output, start, spread, force, noise)
        assert (spikes > 100) == (force == 1.0)
        # The covariance goes on by an exponential that is cut off after its fourth term.
        assert way.deviance[0, place] == pytest.approx(wanted, rel=1e-4)


def test_the_likelihood_holds_for_a_state_that_follows_within_a_sample():
    rng = np.random.default_rng(5)
    records = there_and_back(rng, 900)
    branch = 800.0, 0.12 / RATE
    model = linear().with_elements(MaxwellBranch(*branch))
    own = RecordFilter(model, Measured(records, "displacement", "linear", np.full(2, 1.0)), 16)
    own.spread[2] = 1e-8
    force, noise = 10.0**2, 2e-5**2
    way = own.follow((), np.zeros((7, 0)), Sizes(np.log(force), -30.0, np.log(np.full(2, noise))).around())
    for place, one in enumerate(records):
        start, spread = own.starts[:, place], own.spread[:, place]
        wanted, _ = kalman_deviance(one.input, one.output, start, spread, force, noise, branch)
        assert way.deviance[0, place] == pytest.approx(wanted, rel=1e-3)


def test_slopes_with_the_sizes_are_those_of_the_likelihood():
    rng = np.random.default_rng(4)
    drive, output = smooth_noise(rng, 600), 1e-3 * smooth_noise(rng, 600)
    measured = Measured(
        (record(drive, output), record(2.0 * drive, output, "two")), "displacement", "linear", np.full(2, 1.0)
    )
    own = RecordFilter(linear(), measured, 2)

    def deviance(force, memory, noise):
        sizes = Sizes(force, memory, np.array([noise, -21.0]))
        return own.follow((), np.zeros((7, 0)), sizes.around())

    at, step = (np.log(100.0), 1.0, -20.0), 1e-3
    slope = deviance(*at).slope
    for size in range(3):
        up, down = (tuple(a + sign * step * (i == size) for i, a in enumerate(at)) for sign in (1.0, -1.0))
        change = (deviance(*up).deviance[0] - deviance(*down).deviance[0]) / (4.0 * step)
        assert slope[size, 0] == pytest.approx(change[0], rel=2e-3)


def driven_cubic(seed, level, noise, cubic=4e7):
    """An oscillator with a cubic spring under a sum of sines, by SciPy: force and noisy acceleration."""
    rng = np.random.default_rng(seed)
    count = 2000
    frequencies = np.arange(1.0, 9.0, 0.13)
    phases = rng.uniform(0.0, 2.0 * np.pi, frequencies.size)
    time = np.arange(count) / RATE

    def force(t):
        return (
            level
            * np.sqrt(2.0 / frequencies.size)
            * np.sin(2.0 * np.pi * np.multiply.outer(t, frequencies) + phases).sum(axis=-1)
        )

    def rates(t, z):
        return [z[1], (force(t) - STIFFNESS * z[0] - cubic * z[0] ** 3 - DAMPING * z[1]) / MASS]

    z = solve_ivp(rates, (0.0, time[-1]), [0.0, 0.0], t_eval=time, rtol=1e-9, atol=1e-13, method="DOP853").y
    a = (force(time) - STIFFNESS * z[0] - cubic * z[0] ** 3 - DAMPING * z[1]) / MASS
    return record(force(time), a + noise * rng.standard_normal(count), f"{level:g}")


@pytest.mark.slow
def test_a_start_that_is_far_off_is_not_lost():
    records = tuple(driven_cubic(seed, level, 0.01) for seed, level in enumerate((4.0, 10.0)))
    measured = Measured(records, "acceleration", "band_limited", np.full(2, 0.1))
    start = Isolator(
        MASS, (LinearStiffness(1.5 * STIFFNESS), CubicStiffness(0.0), LinearDamping(4.0 * DAMPING))
    )
    sizes = (STIFFNESS, 1e7, DAMPING)
    found = refined(fit_measured(start, (1, 2, 3), sizes, measured), sizes)
    errors = np.sqrt(np.diag(np.linalg.inv(found.information)))
    assert np.all(np.abs(found.values - [STIFFNESS, 4e7, DAMPING]) < 4.0 * errors)
    assert np.all(errors < [4.0, 4e5, 0.1])
    assert found.is_noise_of_output
    np.testing.assert_allclose(np.exp(0.5 * found.sizes.noise), 0.01, rtol=0.05)


def test_a_search_leaves_the_first_states_of_the_fit_that_it_starts_from():
    records = tuple(driven_cubic(seed, level, 0.01) for seed, level in enumerate((4.0, 10.0)))
    own = RecordFilter(linear(), Measured(records, "acceleration", "band_limited", np.full(2, 0.1)), 2)
    before = own.starts.copy(), own.spread.copy()
    sizes = Sizes(0.0, 1.0, np.full(2, -4.0))
    found = fit_errors(own, (1, 2), (STIFFNESS, DAMPING), sizes, loudest=np.zeros(2), rough=True)
    np.testing.assert_array_equal((own.starts, own.spread), before)
    assert np.all(found.filter.spread < own.spread)


def test_a_ranked_search_goes_on_while_it_may_overtake_the_best(monkeypatch):
    monkeypatch.setattr(_fit_errors, "_USUAL_SCORINGS", 5)
    records = tuple(driven_cubic(seed, level, 0.01) for seed, level in enumerate((4.0, 10.0)))
    measured = Measured(records, "acceleration", "band_limited", np.full(2, 0.1))
    start = Isolator(MASS, (LinearStiffness(1.5 * STIFFNESS), CubicStiffness(0.0), LinearDamping(DAMPING)))

    def search(rival):
        own, places = RecordFilter(start, measured, 4), (1, 2, 3)
        sizes, loudest = first_sizes(own), measured.loudest
        scales = (STIFFNESS, 1e7, DAMPING)
        return fit_errors(own, places, scales, sizes, loudest=loudest, rough=True, rival=rival)

    whole = search(np.inf)
    assert is_successful(whole.result)
    np.testing.assert_allclose(whole.values, [STIFFNESS, 4e7, DAMPING], rtol=0.02)
    # What falls by thousands a step goes on beyond the usual ones, unless nothing could bring it so low.
    for rival in (-np.inf, whole.deviance.sum() - 1e7):
        assert search(rival).steps == 6
    assert search(whole.deviance.sum() + 1e3).steps > 6


@pytest.mark.parametrize("ahead", [40, 400])
def test_the_error_of_predictions_is_that_of_the_motion_that_starts_where_the_filter_stands(ahead):
    rng = np.random.default_rng(6)
    records = there_and_back(rng, 1800)
    own = RecordFilter(linear(), Measured(records, "displacement", "linear", np.full(2, 1.0)), 4)
    sizes = Sizes(np.log(10.0**2), -30.0, np.log(np.full(2, 2e-5**2)))
    way = own.follow((), np.zeros((7, 0)), sizes.around())
    squares, counts = squares_ahead(own, (), np.zeros(0), way, ahead, FED)
    rates = np.array([[0.0, 1.0], [-STIFFNESS / MASS, -DAMPING / MASS]])
    plant = rates, [[0.0], [1.0 / MASS]], [[1.0, 0.0]], [[0.0]]
    windows = range(FED, 1800 - ahead + 1, FED + ahead)
    for place, one in enumerate(records):
        trace = way.traces[place]  # a lane a batch
        assert counts[place] == len(windows) * ahead
        expected = 0.0
        for begin in windows:
            # The filter's last correction before it is let go is at the sample before.
            state = _kept_on(one, own, trace, begin, FED + ahead)
            time = np.arange(ahead) / RATE
            free = scipy.signal.lsim(plant, one.input[begin : begin + ahead], time, state)[1]
            expected += np.sum((one.output[begin : begin + ahead] - free) ** 2)
        assert squares[place] == pytest.approx(expected, rel=1e-4)


def test_a_free_run_begins_at_the_state_from_which_it_is_best():
    rng = np.random.default_rng(8)
    drive = smooth_noise(rng, 900)
    rates = np.array([[0.0, 1.0], [-STIFFNESS / MASS, -DAMPING / MASS]])
    plant, time = (rates, [[0.0], [1.0 / MASS]], [[1.0, 0.0]], [[0.0]]), np.arange(900) / RATE
    begun = [np.array([2e-3, -0.05]), np.array([-1e-3, 0.08])]
    outputs = [scipy.signal.lsim(plant, drive, time, own)[1] + 1e-4 * smooth_noise(rng, 900) for own in begun]
    records = tuple(record(drive, one, name) for one, name in zip(outputs, ("one", "two"), strict=True))
    own = RecordFilter(linear(), Measured(records, "displacement", "linear", np.full(2, 1.0)), 4)
    own.starts[:] = 0.0  # far from where the motions began
    sizes = Sizes(np.log(10.0**2), -30.0, np.log(np.full(2, 2e-5**2)))
    way = own.follow((), np.zeros((7, 0)), sizes.around())
    squares = free_squares(own, (), np.zeros(0), way)
    driven = scipy.signal.lsim(plant, drive, time)[1]
    decays = np.stack([scipy.signal.lsim(plant, 0.0 * drive, time, unit)[1] for unit in np.eye(2)], axis=1)
    for place, output in enumerate(outputs):
        best = np.linalg.lstsq(decays, output - driven, rcond=None)[1][0]
        assert squares[place] == pytest.approx(best, rel=0.02)
    np.testing.assert_array_equal(own.starts, 0.0)


def _kept_on(one, own, trace, begin, both):
    """The state at a sample, by the filter's gains where it is fed and by a bare motion elsewhere."""
    rates = np.array([[0.0, 1.0], [-STIFFNESS / MASS, -DAMPING / MASS]])
    whole = np.zeros((4, 4))
    whole[:2, :2], whole[1, 2], whole[2, 3] = rates / RATE, 1.0 / MASS / RATE, 1.0
    whole = expm(whole)
    place = 0 if one.name == "one" else 1
    state, gains = own.starts[:, place].copy(), np.array([np.asarray(gain)[:, 0] for gain in trace.gains[:2]])
    pushes = np.asarray(trace.gains[2])[:, 0]
    for k in range(begin):
        fed = k % both < FED
        error = one.output[k] - state[0]
        state = state + fed * gains[:, k] * error
        push = fed * pushes[k] * error
        slope = one.input[k + 1] - one.input[k]
        state = whole[:2, :2] @ state + whole[:2, 2] * (one.input[k] + push) + whole[:2, 3] * slope
    return state


@pytest.mark.slow
def test_records_that_start_in_a_large_motion_and_do_not_repeat_are_followed():
    # A spring force of several times the linear one, recorded from the middle of the motion on.
    whole = [driven_cubic(seed, level, 0.01, cubic=1e9) for seed, level in enumerate((10.0, 30.0))]
    records = tuple(record(one.input[700:], one.output[700:], one.name) for one in whole)
    measured = Measured(records, "acceleration", "band_limited", np.full(2, 5.0))
    start = Isolator(
        MASS, (LinearStiffness(1.1 * STIFFNESS), CubicStiffness(0.95e9), LinearDamping(1.2 * DAMPING))
    )
    sizes = (STIFFNESS, 1e9, DAMPING)
    found = refined(fit_measured(start, (1, 2, 3), sizes, measured), sizes)
    errors = np.sqrt(np.diag(np.linalg.inv(found.information)))
    assert np.all(np.abs(found.values / [STIFFNESS, 1e9, DAMPING] - 1.0) < 0.01)
    assert np.all(np.abs(found.values - [STIFFNESS, 1e9, DAMPING]) < 5.0 * errors)


@pytest.mark.slow
def test_dry_friction_as_large_as_the_spring_is_found_from_far_off_and_among_spikes():
    from _simulated_motion import FINE, Oscillator, simulate
    from strong_effects import driven

    # In units of the linear oscillator; the simulator of the benchmarks shares no code with the models.
    plant, rng, size = (
        Oscillator(0.03, law="coulomb_friction", numbers=(0.4,)),
        np.random.default_rng(8),
        2400,
    )
    records = []
    for level in (1.0, 2.0):
        fine = driven(np.random.default_rng(int(level)), "random", level)[0][: (size - 1) * FINE + 1]
        output = simulate(plant, fine).acceleration
        output = output + 0.004 * output.std() * rng.standard_normal(size)
        output[rng.integers(100, size, 5)] += 10.0 * output.std()
        time, drive = np.arange(size) * 2.0 * np.pi / 40.0, fine[::FINE]
        name = f"{level:g}"
        records.append(Record(name, Path(name), time, 40.0 / (2.0 * np.pi), drive, output, drive, output))
    measured = Measured(tuple(records), "acceleration", "band_limited", np.full(2, 0.3))
    start = Isolator(1.0, (LinearStiffness(1.3), LinearDamping(0.3), CoulombFriction(0.1, 0.01)))
    found = fit_measured(start, (1, 2, 3), (1.0, 0.1, 1.0), measured)
    errors = np.sqrt(np.diag(np.linalg.inv(found.information)))
    assert np.all(np.abs(found.values - [1.0, 0.06, 0.4]) < 4.0 * errors)
    assert np.all(errors < [1e-3, 1e-3, 1e-3])
    assert found.is_noise_of_output


BUILDING = """\
[campaign]
title = "building on rubber bearings"
mass = 1.0
[input]
quantity = "base_acceleration"
column = "u"
unit = "m/s^2"
[output]
quantity = "displacement"
column = "d1"
unit = "m"
[sampling]
rate = 200.0
[model]
stiffness = ["linear"]
damping = ["linear"]
"""


@pytest.mark.slow
def test_a_measured_building_on_rubber_bearings_has_hysteresis(shared_data, tmp_path):
    records = [("ICA50", "fit"), ("ICA100", "fit"), ("CNP100", "holdout")]
    declared = "".join(
        f'[[record]]\nfile = "{(shared_data / "building" / name).as_posix()}.npz"\nrole = "{role}"\n'
        for name, role in records
    )
    (tmp_path / "campaign.toml").write_text(BUILDING + declared, encoding="utf-8")
    verdict = diagnose(fit(read_campaign(tmp_path)))
    assert verdict.finding.effect in ("dahl_friction", "bouc_wen")
    assert verdict.after.errors["fit"].nrmse <= 0.28  # a linear model: 0.50 by least squares
    assert verdict.after.errors["holdout"].nrmse <= 0.37
    shares = [one.held_out_share for one in verdict.ranking if np.isfinite(one.held_out_share)]
    assert len(shares) >= 3  # the finding and the next two
    assert shares[0] == verdict.finding.transfer > 0.0
    assert "Hz" in verdict.reason


def test_what_a_record_tells_of_its_first_state_is_counted_once():
    """A filter's innovations hold the variance with which it began: again and again the same comes out."""
    told, prior, given = 50.0, 4.0, 3.0  # information of the record alone, variance before, of the filter
    for _ in range(30):
        seen = 1.0 / (given + 1.0 / told)
        products = np.array([[1.0, 0.0, 0.0], [0.0, seen, 0.0], [0.0, 0.0, 1.0]])[:, :, None]
        one = np.zeros((1, 1))
        first = eliminate(products, one, one, one + prior, np.zeros(1), one + given)
        given = float(first.spread[0, 0])
        assert given == pytest.approx(1.0 / (told + 1.0 / prior), rel=1e-6)
