"""The experiment that separates look-alikes: found by simulation, and compared with the plant itself."""

import dataclasses

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import integrate, optimize

from isojax import rig
from isojax.elements import (
    AddedMass,
    CubicStiffness,
    InputGain,
    InputOffset,
    LinearDamping,
    LinearStiffness,
    QuadraticStiffness,
    SensorGain,
)
from isojax.identification import (
    Extension,
    Finding,
    Verdict,
    close_loop,
    find_separating_experiment,
    fit,
)
from isojax.identification.experiment._find_separation import with_separating_experiment
from isojax.models import Integrator, Isolator

LINEAR = rig.Plant((rig.LinearStiffness(1.08e6), rig.LinearDamping(1e4)))
START = Isolator(800.0, (LinearStiffness(1.05e6), LinearDamping(1.1e4)))
PLAN = rig.Multisine((40.0, 110.0), 2.0, 14.0, period=2.0, periods=3, lines="full")
NOISE = 5e-3
BENCH = rig.Bench(rate=250.0, noise=NOISE, drift=0.0, force_noise=0.0, anti_alias=False, tolerance=1e-7)
ONE_STEP = Integrator()


def _extension(campaign, start, effect, *rivals):
    """A finding made by hand, so that nothing but the separation is tested."""
    before = fit(start, campaign, integrator=ONE_STEP)
    after = fit(before.model.with_elements(effect), campaign, integrator=ONE_STEP)
    others = tuple(rival.name for rival in rivals)
    finding = Finding(effect.name, others, 0.0, 1.0, 1.0, (), "", rivals)
    verdict = Verdict("found", finding, (), others, 0.0, (), {}, after, "")
    return Extension(before, after, verdict)


@pytest.fixture(scope="module")
def heavier(simulated):
    """A linear isolator with 24 kg that nobody weighed."""
    campaign = simulated(
        LINEAR.plus(rig.AddedMass(24.0)),
        PLAN,
        7,
        BENCH,
        mass=800.0,
        stiffness=("linear",),
        damping=("linear",),
    )
    return _extension(campaign, START, AddedMass(10.0), InputGain(0.0), SensorGain(0.0))


CUBIC = rig.Plant((rig.LinearStiffness(1.08e6), rig.CubicStiffness(4e11), rig.LinearDamping(1e4)))


@pytest.fixture(scope="module")
def lopsided(simulated):
    """A hardening isolator with a spring that is softer one way than the other."""
    campaign = simulated(
        CUBIC.plus(rig.QuadraticStiffness(4e7)),
        PLAN,
        5,
        BENCH,
        stiffness=("linear", "cubic"),
        damping=("linear",),
    )
    start = Isolator(800.0, (LinearStiffness(1.05e6), CubicStiffness(3e11), LinearDamping(1.1e4)))
    return _extension(campaign, start, QuadraticStiffness(3e7), InputOffset(0.0))


def _named(found, name):
    return next(one for one in found.prospects if one.experiment.name == name)


def _steady(drive, rate, mass, stiffness, damping):
    """Acceleration under a periodic drive, by its spectrum."""
    omega = 2.0 * np.pi * np.fft.rfftfreq(drive.shape[-1], 1.0 / rate)
    motion = np.fft.rfft(drive) / (stiffness - mass * omega**2 + 1j * omega * damping)
    return np.fft.irfft(-(omega**2) * motion, drive.shape[-1])


def test_a_mass_error_is_parted_from_gains_by_a_known_mass_and_by_nothing_else(heavier):
    found = find_separating_experiment(heavier)
    assert found.best.experiment.name == "extra_mass"
    assert found.best.experiment.extra_mass == pytest.approx(80.0)
    assert found.best.gain > found.needed
    others = [one for one in found.prospects if one is not found.best]
    assert len(others) == 8
    assert max(max(one.gains) for one in others) < 0.1
    assert found.again.gain < 0.01


def test_a_known_mass_parts_a_mass_error_from_a_gain_as_far_as_promised(heavier):
    """Both laws fitted to the closed-form response, before and after 80 kg were bolted on."""
    drive = _named(find_separating_experiment(heavier), "extra_mass").experiment.drive
    length = drive.size / 250.0
    promised = _named(find_separating_experiment(heavier, seconds=length), "extra_mass").gains[0]
    tests = [(record.input[record.settle :], 0.0) for record in heavier.before.campaign.fit_records]
    tests += [(row, 80.0) for row in drive]

    def left(numbers):
        gain, stiffness, damping = numbers * [1.0, 1e6, 1e4]
        return np.concatenate(
            [
                _steady(force, 250.0, 824.0 + extra, 1.08e6, 1e4)
                - _steady(gain * force, 250.0, 800.0 + extra, stiffness, damping)
                for force, extra in tests
            ]
        )

    apart = 2.0 * optimize.least_squares(left, [0.97, 1.05, 1.0]).cost / NOISE**2
    assert promised > 50.0
    assert 0.5 < apart / promised < 2.0


@pytest.mark.slow
def test_a_lopsided_spring_is_parted_from_an_offset_by_a_mean_as_far_as_promised(
    lopsided, simulated, campaign_of
):
    """The chosen test on the true law by SciPy, both models fitted to it."""
    first = find_separating_experiment(lopsided)
    assert first.best.experiment.name == "dc_sensor"
    plan = first.best.experiment
    found = find_separating_experiment(lopsided, seconds=plan.seconds)
    promised = found.best.gain
    assert promised > 100.0 * found.again.gain

    outputs = []
    for row in plan.drive:
        lines = np.fft.rfft(row) / row.size * 2.0
        held = np.abs(lines) > 1e-6 * np.abs(lines).max()
        omega, lines = 2.0 * np.pi * np.flatnonzero(held) * plan.rate / row.size, lines[held]

        def rates(t, z, omega=omega, lines=lines):
            force = np.sum((lines * np.exp(1j * omega * t)).real)
            law = 1.08e6 * z[0] + 4e7 * z[0] ** 2 + 4e11 * z[0] ** 3 + 1e4 * z[1]
            return [z[1], (force - law) / 800.0]

        time = np.arange(row.size) / plan.rate
        run = integrate.solve_ivp(rates, (-3.0, time[-1]), [0.0, 0.0], "DOP853", time, rtol=1e-8, atol=1e-12)
        outputs.append(run.y[0])
    old = lopsided.before.campaign.fit_records
    noise = NOISE * np.std(outputs) / np.std([record.output[record.settle :] for record in old])
    records = tuple(
        dataclasses.replace(
            old[0],
            name=f"new_{level}",
            time=np.arange(row.size) / plan.rate,
            input=row,
            output=output,
            raw_input=row,
            raw_output=output,
            level=float(level),
            period=row.size,
            settle=0,
        )
        for level, (row, output) in enumerate(zip(plan.drive, outputs, strict=True))
    )
    campaign = campaign_of(
        records,
        output={"quantity": "displacement", "noise": noise},
        stiffness=("linear", "cubic"),
        damping=("linear",),
    )
    chi2 = [
        fit(lopsided.before.model.with_elements(law), campaign, integrator=ONE_STEP).estimate.chi2
        for law in (QuadraticStiffness(3e7), InputOffset(0.0))
    ]
    assert 0.5 < (chi2[1] - chi2[0]) / promised < 2.0


def test_a_test_in_which_the_motion_runs_away_is_left_out_with_the_reason(heavier):
    """A softening spring that the campaign's levels do not overcome, but one and a half times the top."""
    softening = heavier.before.model.with_elements(CubicStiffness(-1.5e12))
    estimate = heavier.before.estimate._replace(model=softening)
    before = heavier.before._replace(model=softening, estimate=estimate)
    found = find_separating_experiment(heavier._replace(before=before))
    away = _named(found, "higher_level")
    assert away.gains == ()
    assert "diverges" in away.reason
    assert [bool(one.gains) for one in found.prospects] == sorted(
        (bool(one.gains) for one in found.prospects), reverse=True
    )
    assert found.best.experiment.name == "extra_mass"


def test_a_load_under_which_a_memory_would_have_to_settle_is_left_out(heavier):
    """An attached mass hangs on the isolator, wherever that rests."""
    verdict = heavier.verdict
    finding = verdict.finding._replace(indistinguishable=("second_mode",), rivals=())
    found = find_separating_experiment(heavier._replace(verdict=verdict._replace(finding=finding)))
    assert "settle" in _named(found, "static_load").reason
    assert len(found.again.gains) == 1


def test_the_finding_says_what_to_do_and_what_it_promises(heavier, lopsided):
    words = with_separating_experiment(heavier).verdict.finding.separating_experiment
    assert words.startswith("Bolt a known 80 kg onto the isolator")
    assert "(repeating the same test: 0.0)" in words
    finding = with_separating_experiment(lopsided).verdict.finding
    assert (
        f"expected chi2 {finding.separation.best.gain:.3g} apart after 8 s" in finding.separating_experiment
    )


def test_gains_of_two_channels_no_test_parts_and_the_words_say_so(heavier):
    verdict = heavier.verdict
    finding = verdict.finding._replace(
        effect="input_gain",
        indistinguishable=("sensor_gain",),
        separating_experiment="Calibrate.",
        rivals=(SensorGain(0.0),),
    )
    after = heavier.fit.estimate._replace(
        model=Isolator(
            heavier.before.model.mass,
            (
                *heavier.before.model.elements,
                eqx.tree_at(lambda e: e.deviation, InputGain(0.0), jnp.asarray(-0.03)),
            ),
        )
    )
    gained = heavier.fit._replace(model=after.model, estimate=after)
    told = with_separating_experiment(
        Extension(heavier.before, gained, verdict._replace(finding=finding))
    ).verdict.finding
    assert told.separating_experiment.startswith("No test that was simulated separates them")
    assert told.separating_experiment.endswith("Calibrate.")
    assert told.separation.best.gain < 0.1


def test_without_a_finding_or_look_alikes_there_is_nothing_to_part(heavier):
    alone = heavier.verdict.finding._replace(indistinguishable=(), rivals=())
    none = heavier._replace(verdict=heavier.verdict._replace(finding=alone))
    assert find_separating_experiment(none).prospects == ()
    assert with_separating_experiment(none) is none
    with pytest.raises(ValueError, match="finding"):
        find_separating_experiment(heavier._replace(verdict=heavier.verdict._replace(finding=None)))
    with pytest.raises(ValueError, match="seconds"):
        find_separating_experiment(heavier, seconds=-1.0)


@pytest.mark.slow
def test_the_loop_ends_with_the_test_that_parts_what_it_found(heavier):
    loop = close_loop(heavier.before.campaign)
    (finding,) = loop.findings
    assert {finding.effect, *finding.indistinguishable} >= {"added_mass", "input_gain", "sensor_gain"}
    assert finding.separation.best.experiment.name == "extra_mass"
    assert "kg onto the isolator" in finding.separating_experiment
