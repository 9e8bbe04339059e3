"""The next record: what it is expected to do, against closed forms, simulation and refits of the rig."""

import dataclasses
import tomllib

import jax.numpy as jnp
import numpy as np
import pytest

from identification.test_scatter_mixture import PRIOR, UNIT, mean_of, reduced_of
from isojax import plot, rig
from isojax.elements import AddedMass, CubicStiffness, DahlFriction, LinearDamping, LinearStiffness
from isojax.identification import fit, next_test
from isojax.identification.experiment._test_plan import plan_of
from isojax.identification.fitting._scatter_mixture import expect_uncertainty
from isojax.models import Integrator, Isolator

K, K3 = "linear_stiffness.coefficient", "cubic_stiffness.coefficient"
PLANT = rig.Plant((rig.LinearStiffness(1.08e6), rig.CubicStiffness(4e11), rig.LinearDamping(1e4)))
START = Isolator(800.0, (LinearStiffness(1.05e6), CubicStiffness(3e11), LinearDamping(1.1e4)))
FREQUENCIES = tuple(np.linspace(4.0, 7.0, 6).tolist())
PLAN = rig.SteppedSine((60.0, 110.0), FREQUENCIES, 8, ("forward",))
BENCH = rig.Bench(
    rate=250.0,
    noise=5e-3,
    drift=0.0,
    force_noise=0.0,
    shaker=rig.IDEAL_SHAKER,
    anti_alias=False,
    tolerance=1e-7,
)
DECLARED = {"mass": 800.0, "stiffness": ("linear", "cubic"), "damping": ("linear",)}


def _expected(readings, noise, spread, repeats=1.0, planned_noise=None):
    """Standard error of a mean with one reading more [UNIT]."""
    columns = np.full((len(readings), 1, 1), 1.0 / noise)
    present = reduced_of(columns, columns[..., 0], np.array(readings)[:, None] / noise, spread)
    one = np.full((1, 1, 1), 1.0 / (noise if planned_noise is None else planned_noise))
    planned, _ = reduced_of(one, one[..., 0], np.zeros((1, 1)), spread)
    return float(expect_uncertainty(*present, planned, repeats, 1.0).standard_error[0])


def test_of_noise_alone_a_further_record_weighs_as_its_length():
    """Of so noisy readings that no scatter shows, the error of the mean is noise / sqrt(n + repeats)."""
    readings, noise = [0.0, 400.0, -400.0, 100.0], 1e3
    for repeats in (1.0, 4.0):
        expected = noise / np.sqrt(4.0 + repeats)
        assert _expected(readings, noise, 1e-5, repeats) == pytest.approx(expected, rel=2e-3)


def test_the_expected_error_is_that_of_readings_drawn_from_what_the_others_predict():
    """Scatter drawn from its posterior by weights, then a reading, and the error with it: its mean square."""
    readings, noise = np.array([0.3, -0.5, 0.1]), 0.05
    draw = np.random.default_rng(3)
    scatter = np.geomspace(1e-2, 50.0, 400)
    variance = noise**2 + scatter**2
    squares = np.sum((readings - readings.mean()) ** 2)
    density = variance ** (-0.5 * (readings.size - 1)) * np.exp(-0.5 * squares / variance)
    density *= scatter / (1.0 + (scatter * UNIT / PRIOR) ** 2)
    drawn = draw.choice(scatter, 400, p=density / density.sum())
    error = drawn * np.sqrt(1.0 + 1.0 / readings.size)
    further = readings.mean() + error * draw.standard_normal(400)
    found = [
        float(mean_of([*readings, one], noise, 0.4 * UNIT).standard_error[0])
        for one in further[np.abs(further) < 20.0 * np.median(error)]
    ]
    assert _expected(readings, noise, 0.4 * UNIT) == pytest.approx(
        np.sqrt(np.mean(np.square(found))), rel=0.1
    )


@pytest.fixture(scope="module")
def fitted(simulated):
    return fit(START, simulated(PLANT, PLAN, 3, BENCH, **DECLARED), integrator=Integrator())


@pytest.fixture(scope="module")
def found(fitted):
    return next_test(fitted, levels=(40.0, 75.0, 300.0), bands=((4.0, 7.0), (4.5, 6.0)))


def test_the_best_record_measured_and_refitted_shrinks_the_errors_as_predicted(fitted, found, simulated):
    """On the rig, which shares no code with the model."""
    stepped = [one for one in found.proposals if one.experiment.waveform == "stepped sine" and not one.reason]
    best = stepped[0]
    rows = [row.split(",") for row in best.schedule.split()[1:]]
    pieces = tuple(
        rig.IDEAL_SHAKER.sine(
            best.level, float(frequency), float(start), float(start) + found.seconds / len(rows)
        )
        for start, frequency, _ in rows
    )

    class Suggested(rig.Plan):
        def trials(self, shaker, seed):
            schedule = tuple(tuple(map(float, row)) for row in rows)
            return (
                rig.Trial(
                    "next",
                    pieces,
                    best.experiment.seconds,
                    best.level,
                    "forward",
                    0,
                    "fit",
                    schedule=schedule,
                ),
            )

    errors = []
    for seed in range(4):
        further = simulated(PLANT, Suggested(), 20 + seed, BENCH, **DECLARED)
        records = (*fitted.campaign.records, *further.records)
        refit = fit(
            fitted.model, dataclasses.replace(fitted.campaign, records=records), integrator=Integrator()
        )
        errors.append(refit.estimate.uncertainty.standard_error)
    predicted = best.standard_errors
    refitted = np.sqrt(np.mean(np.square(errors), axis=0))
    np.testing.assert_allclose(refitted[1:], predicted[1:], rtol=0.15)
    # The rig's stiffness does not scatter at all, which two records leave open.
    assert 0.6 * predicted[0] < refitted[0] < predicted[0]
    assert np.all(predicted < fitted.estimate.uncertainty.standard_error)


def test_a_record_that_runs_away_or_too_far_is_left_out_with_the_reason(fitted, found):
    left = [one for one in found.proposals if one.reason]
    assert {one.reason for one in left} == {"it moves farther than argument `farthest` allows"}
    assert all(one.reason for one in found.proposals if "300 N" in one.experiment.words)
    assert list(found.proposals[-len(left) :]) == left
    softening = START.replace(cubic_stiffness__coefficient=-8e11)
    moved = fitted._replace(model=softening, estimate=fitted.estimate._replace(model=softening))
    away = next_test(moved, levels=(20.0, 600.0), bands=((4.0, 7.0), (4.0, 130.0)), farthest=np.inf)
    reasons = {one.experiment.words.partition(" of ")[2]: one.reason for one in away.proposals}
    assert "the motion diverges" in reasons["600 N rms, 4 to 7 Hz, upwards"]
    assert "sampling rate" in reasons["20 N rms, 4 to 130 Hz"]
    assert reasons["20 N rms, 4 to 7 Hz"] == ""


def test_of_a_quantity_the_error_counts_that_its_gradient_gives(fitted, found):
    def twice(model):
        return jnp.stack([2.0 * model[K3], 3.0 * model[K]])

    asked = next_test(fitted, twice, levels=(40.0, 75.0), bands=((4.0, 7.0), (4.5, 6.0)))
    order = [fitted.free.index(K3), fitted.free.index(K)]
    for one in asked.proposals:
        np.testing.assert_allclose(one.quantity_errors, one.standard_errors[order] * [2.0, 3.0], rtol=1e-9)
    means = [np.prod(one.quantity_errors) for one in asked.proposals]
    assert means == sorted(means)
    assert asked.quantity[0] == pytest.approx(2.0 * float(fitted.model[K3]))
    assert found.best.quantity_errors.size == 0


def test_the_declaration_is_one_of_campaign_toml(found):
    for one in found.proposals:
        (record,) = tomllib.loads(one.declaration)["record"]
        assert record["role"] == "fit"
        assert ("schedule" in record) == (one.experiment.waveform == "stepped sine") == bool(one.schedule)
    assert {one.schedule.count("\n") - 1 for one in found.proposals} == {-1, 3, 6, 12}
    stepped = next(one for one in found.proposals if one.experiment.waveform == "stepped sine")
    # The drive of the campaign is a sine of its nominal level.
    assert stepped.level == pytest.approx(np.sqrt(2.0) * np.std(stepped.experiment.drive), rel=2e-3)
    rows = np.array([[float(one) for one in row.split(",")] for row in stepped.schedule.split()[1:]])
    np.testing.assert_allclose(rows[1:, 0], np.cumsum(rows[:-1, 2] / rows[:-1, 1]), atol=1e-4)


def test_a_gain_is_separated_from_a_mass_error_by_no_drive_of_a_linear_isolator(simulated):
    """Mass, stiffness and damping scale alike with the gain of the drive."""
    linear = rig.Plant((rig.LinearStiffness(1.08e6), rig.LinearDamping(1e4), rig.AddedMass(24.0)))
    campaign = simulated(linear, PLAN, 7, BENCH, mass=800.0, stiffness=("linear",), damping=("linear",))
    heavier = fit(
        Isolator(800.0, (LinearStiffness(1.05e6), LinearDamping(1.1e4), AddedMass(20.0))),
        campaign,
        integrator=Integrator(),
    )
    asked = next_test(heavier, rivals=("added_mass", "input_gain"), bands=((4.0, 7.0),))
    assert asked.rivals == ("added_mass", "input_gain")
    assert max(one.chi2 for one in asked.proposals if not one.reason) < 0.5
    assert 0.0 <= asked.chi2_now < 0.5
    words = f"the present records alone: chi2 {asked.chi2_now:.3g} between added_mass and input_gain"
    assert words in repr(asked)
    with pytest.raises(ValueError, match="begin with an effect of the model"):
        next_test(heavier, rivals=("coulomb_friction", "input_gain"))
    with pytest.raises(ValueError, match="a name of the catalogue"):
        next_test(heavier, rivals=("added_mass", "gain"))


def test_a_rival_that_the_records_refute_already_says_so(fitted):
    """No spring stands in for the damping: what the records hold alone is most of what one more would add."""
    asked = next_test(fitted, rivals=("linear_damping", "quintic_stiffness"), bands=((4.0, 7.0),), dwells=6)
    assert asked.chi2_now > 1e4
    best = asked.best.chi2
    assert asked.chi2_now < best < 4.0 * asked.chi2_now


def test_a_rival_that_diverges_along_the_records_is_refused(fitted):
    """A loop of a nanometre cannot be followed at the steps of the records."""
    with pytest.raises(ValueError, match="stays finite along the motion of the records, but dahl_friction"):
        next_test(fitted, rivals=("linear_damping", DahlFriction(0.0, 1e-9)))


def test_the_picture_has_a_bar_for_each_record_that_could_be_simulated(found):
    drawn = plot.next_test(found).axes[0]
    widths = [patch.get_width() for patch in drawn.patches]
    possible = [one.shrinkage for one in found.proposals if not one.reason]
    np.testing.assert_allclose(widths, possible[: len(widths)])
    assert len(widths) == min(12, len(possible))
    assert repr(found).startswith(f"NextTest: {found.best.experiment.words}")
    with pytest.raises(ValueError, match="could be simulated"):
        plot.next_test(found._replace(proposals=tuple(one for one in found.proposals if one.reason)))


@pytest.mark.slow
def test_a_further_record_makes_nothing_less_certain_where_three_show_too_small_a_scatter(tmp_path):
    laws = rig.base_laws(1.0805e6, -6.974e8, 2.51667e11, 1.027e4, -3.6880e5, 5.3753e6)
    plan = rig.SteppedSine((60.0, 120.0, 150.0), (4.0, 4.3, 4.6, 4.9, 5.2, 5.6), 10, ("forward",))
    declared = tuple(law.name for law in laws)
    bench = rig.Bench(rate=200.0, drift=5e-4)
    fitted = fit(rig.write_campaign(tmp_path / "c", rig.Plant(laws), plan, 7, "c", bench, declared=declared))
    assert fitted.stats.stiffness_scatter < 0.1 * bench.drift
    asked = next_test(fitted, levels=(80.0, 100.0), bands=((4.4, 5.2), (4.0, 4.8)))
    for proposal in asked.proposals:
        assert proposal.reason or np.all(proposal.standard_errors < asked.standard_errors)


def test_one_level_band_or_number_of_dwells_may_stand_alone():
    assert plan_of(2.0, 60.0, (4.0, 6.0), 3, 1.2) == plan_of(2.0, [60.0], [(4.0, 6.0)], (3,), 1.2)


def test_mistakes_are_refused(fitted, unchecked):
    with pytest.raises(ValueError, match="`seconds` must be positive"):
        next_test(fitted, seconds=0.0)
    with pytest.raises(ValueError, match="`levels` must hold positive"):
        next_test(fitted, levels=())
    with pytest.raises(ValueError, match="0 < lowest < highest"):
        next_test(fitted, bands=((7.0, 4.0),))
    with pytest.raises(ValueError, match="`dwells` must hold divisors of 12"):
        next_test(fitted, dwells=(5,))
    for given, words in (
        ({"bands": [(1.0, 2.0), (3.0,)]}, "0 < lowest < highest"),
        ({"bands": 5.0}, "0 < lowest < highest"),
        ({"dwells": 2.4}, "`dwells` must hold divisors of 12, but is 2.4"),
        ({"levels": "60"}, "`levels` must hold positive numbers, but is '60'"),
        ({"rivals": ("linear_damping",)}, "`rivals` must be a pair"),
        ({"rivals": ("linear_damping", "linear_damping")}, "`rivals` must be a pair"),
        ({"rivals": ("linear_damping", 3)}, "`rivals` must end with an element .* of type int"),
        (
            {"rivals": ("linear_damping", "cubic_stiffness")},
            "effect that the model lacks, .* has cubic_stiff",
        ),
    ):
        with pytest.raises(ValueError, match=words):
            next_test(fitted, **given)
    with pytest.raises(ValueError, match="`quantity` must depend on the fitted coefficients"):
        next_test(fitted, lambda model: 3.0)
    with pytest.raises(ValueError, match="`farthest` must be positive"):
        next_test(fitted, farthest=0.0)
    with pytest.raises(ValueError, match="finite real numbers"):
        next_test(fitted, lambda model: jnp.nan * model[K])
