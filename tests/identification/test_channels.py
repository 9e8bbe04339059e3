"""Signals made from a record beside its drive, and the effects that follow them."""

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
from scipy import signal, stats
from scipy.integrate import solve_ivp

from isojax import rig
from isojax.elements import (
    CubicStiffness,
    DriveHarmonics,
    InputHold,
    LinearDamping,
    LinearStiffness,
    MainsHum,
)
from isojax.identification import diagnose, fit, scales
from isojax.identification.diagnosis._score import chosen_phase_law, score_test
from isojax.identification.fitting import Search
from isojax.identification.jacobian._channels import channel_table, drive_harmonic, output_line
from isojax.models import Integrator, Isolator
from isojax.records import Record

RATE = 50.0
MASS, STIFFNESS, DAMPING = 800.0, 1.1e6, 9e3
BASE = Isolator(MASS, (LinearStiffness(1.05e6), LinearDamping(1e4)))


def record(drive, output, name="one", **fields) -> Record:
    time = np.arange(drive.size) / RATE
    return Record(name, Path(f"{name}.npz"), time, RATE, drive, output, drive, output, **fields)


def multisine(seed: int, periods: int = 3, size: int = 400) -> np.ndarray:
    """Random phases up to a quarter of the sampling rate."""
    rng = np.random.default_rng(seed)
    spectrum = np.zeros(size // 2 + 1, complex)
    spectrum[8 : size // 4] = np.exp(2j * np.pi * rng.random(size // 4 - 8))
    one = np.fft.irfft(spectrum, size)
    return np.tile(150.0 * one / np.std(one), periods)


def displacements(noise: float) -> dict[str, object]:
    """How the output channel is declared."""
    return {"quantity": "displacement", "column": "y", "unit": "m", "noise": noise}


def solve(field, size: int) -> np.ndarray:
    """Displacement at the samples, let go at rest two seconds before, by SciPy."""
    times = np.arange(size) / RATE
    return solve_ivp(
        field, (-2.0, times[-1]), [0.0, 0.0], t_eval=times, method="DOP853", rtol=1e-9, atol=1e-12
    ).y[0]


def oscillator() -> tuple[np.ndarray, np.ndarray]:
    return np.array([[0.0, 1.0], [-STIFFNESS / MASS, -DAMPING / MASS]]), np.array([[0.0], [1.0 / MASS]])


def held_response(drive: np.ndarray, kind: str) -> np.ndarray:
    """Displacement of the oscillator, by SciPy's exact discretisation of a hold."""
    matrix, push = oscillator()
    system = signal.cont2discrete((matrix, push, [[1.0, 0.0]], [[0.0]]), 1.0 / RATE, method=kind)
    # Periodic: three periods before the record.
    _, y, _ = signal.dlsim((*system[:4], 1.0 / RATE), np.tile(drive, 2)[:, None])
    return y[drive.size :, 0]


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "order"), [("zoh", 0.0), ("foh", 1.0)])
def test_a_hold_other_than_declared_is_named_with_a_share_of_one(campaign_of, kind, order):
    rng = np.random.default_rng(1)
    noise = 2e-7
    drives = [multisine(seed) for seed in (1, 2)]
    records = tuple(
        record(drive, held_response(drive, kind) + noise * rng.standard_normal(drive.size), f"r{place}")
        for place, drive in enumerate(drives)
    )
    declared = {"zoh": "linear", "foh": "band_limited"}[kind]
    campaign = campaign_of(
        records,
        input={"hold": declared},
        output=displacements(noise),
    )
    verdict = diagnose(fit(BASE, campaign))
    assert verdict.finding is not None
    assert verdict.finding.effect == "input_hold"
    assert float(verdict.refit.model["input_hold.order"]) == order
    share = float(verdict.refit.model["input_hold.share"])
    place = verdict.refit.names.index("input_hold.share")
    assert abs(share - 1.0) < 4.0 * float(verdict.refit.uncertainty.standard_error[place]) + 2e-3


def test_harmonics_of_a_sine_are_cosines_of_multiples_of_its_phase():
    phase = 2 * np.pi * 3.0 * np.arange(500) / RATE + 0.4
    found = [
        drive_harmonic(record(7.0 * np.cos(phase), phase), order, part)
        for order in (2, 3)
        for part in ("cosine", "sine")
    ]
    expected = [7.0 * law(order * phase) for order in (2, 3) for law in (np.cos, np.sin)]
    np.testing.assert_allclose(np.array(found), np.array(expected), atol=1e-9)


def test_a_line_is_found_beside_a_large_drive_with_amplitude_and_phase():
    time = np.arange(6000) / 250.0
    output = 3.0 * np.cos(2 * np.pi * 4.7 * time) + 2e-3 * np.cos(2 * np.pi * 50.0 * time + 0.7)
    line = output_line(dataclasses.replace(record(output, output), rate=250.0), 50.0)
    assert abs(line) == pytest.approx(2e-3, rel=1e-3)
    assert np.angle(line) == pytest.approx(0.7, abs=1e-3)


def test_the_clock_runs_through_a_record_from_its_beginning_to_its_end():
    one = record(np.arange(100.0), np.arange(100.0), clock=(0.25, 0.5))
    table = channel_table("clock", one, "band_limited", 1, 0.0)
    assert table.shape == (100, 3)
    np.testing.assert_allclose(table[[0, 50, 99], 0], [0.25, 0.375, 0.25 + 0.25 * 0.99])
    np.testing.assert_allclose(table[:-1, 2], table[1:, 0])


def test_an_unknown_signal_is_refused():
    with pytest.raises(ValueError, match="must name a signal of a record, but is 'tide'"):
        channel_table("tide", record(np.arange(9.0), np.arange(9.0)), "linear", 1, 0.0)


def driven(seed: int, noise: float, *, stiffer=0.0, damper=0.0, begin=0.0, share=0.5) -> np.ndarray:
    """Displacement of the oscillator with a drifting stiffness or damping, by SciPy."""
    drive = multisine(seed)
    size = drive.size
    lines = np.fft.rfft(drive) / size
    places = np.flatnonzero(np.abs(lines) > 1e-9 * np.abs(lines).max())
    omega = 2 * np.pi * places * RATE / size

    def force(t):
        return 2.0 * np.sum((lines[places] * np.exp(1j * omega * t)).real)

    def field(t, z):
        clock = begin + share * max(t, 0.0) * RATE / size
        stiffness, damping = STIFFNESS + stiffer * clock, DAMPING + damper * clock
        return z[1], (force(t) - stiffness * z[0] - damping * z[1]) / MASS

    rng = np.random.default_rng(100 + seed)
    return solve(field, size) + noise * rng.standard_normal(size)


@pytest.mark.parametrize(
    ("name", "drift"), [("stiffness_drift", {"stiffer": 1.2e4}), ("damping_drift", {"damper": -900.0})]
)
def test_what_drifts_over_two_records_is_named(campaign_of, name, drift):
    noise = 2e-7
    records = tuple(
        record(
            multisine(seed),
            driven(seed, noise, begin=begin, **drift),
            f"r{seed}",
            clock=(begin, begin + 0.5),
        )
        for seed, begin in ((1, 0.0), (2, 0.5))
    )
    campaign = campaign_of(records, output=displacements(noise))
    verdict = diagnose(fit(BASE, campaign))
    assert verdict.finding is not None
    assert verdict.finding.effect == name
    change = float(verdict.refit.model[f"{name}.change"])
    error = float(verdict.refit.uncertainty.standard_error[verdict.refit.names.index(f"{name}.change")])
    (truth,) = drift.values()
    assert abs(change - truth) < 4.0 * error


def test_the_score_of_a_chosen_phase_is_normal_where_there_is_only_noise():
    # Six records of noise, each projected on a cosine whose phase is that of its own windowed line.
    rng = np.random.default_rng(5)
    angle = 2.0 * np.pi * 12.0 * np.arange(512) / RATE

    def share(values):
        cosine = np.cos(angle + np.angle(output_line(record(values, values), 12.0)))
        return values @ cosine / np.linalg.norm(cosine)

    sums = np.array([sum(map(share, rng.standard_normal((6, 512)))) for _ in range(1500)]) / math.sqrt(6.0)
    mean, deviation = chosen_phase_law([512] * 6)
    scores = (sums - mean) / deviation
    assert stats.kstest(scores, "norm").pvalue > 1e-3
    assert abs(np.mean(scores)) < 0.1
    assert abs(np.std(scores) - 1.0) < 0.06


@pytest.mark.slow
def test_a_cubic_spring_is_still_a_cubic_spring(campaign_of):
    # The effects that follow a record's signals take nothing from the laws of the motion.
    drive = multisine(3)
    size = drive.size
    lines = np.fft.rfft(drive) / size
    places = np.flatnonzero(np.abs(lines) > 1e-9 * np.abs(lines).max())
    omega = 2 * np.pi * places * RATE / size

    def field(t, z):
        force = 2.0 * np.sum((lines[places] * np.exp(1j * omega * t)).real)
        return z[1], (force - STIFFNESS * z[0] - 3e11 * z[0] ** 3 - DAMPING * z[1]) / MASS

    noise = 2e-7
    output = solve(field, size) + noise * np.random.default_rng(9).standard_normal(size)
    campaign = campaign_of(
        (record(drive, output),),
        output=displacements(noise),
    )
    verdict = diagnose(fit(BASE, campaign))
    assert verdict.finding is not None
    assert verdict.finding.effect == CubicStiffness.name


def steady_record(name: str, law, *, frequency=5.0, hum=0.0) -> Record:
    """Whole cycles of a sine in the steady state, by the closed form of the linear oscillator's response."""
    rate, noise = 250.0, 1e-7
    time = np.arange(int(4.0 * rate)) / rate
    theta = 2 * np.pi * frequency * time
    amplitude = 120.0
    answer = np.zeros(time.size)
    for order, part, phase in law:
        omega = 2 * np.pi * order * frequency
        receptance = 1.0 / (STIFFNESS - MASS * omega**2 + 1j * DAMPING * omega)
        answer += amplitude * part * (receptance * np.exp(1j * (order * theta + phase))).real
    output = answer + hum * np.cos(2 * np.pi * 50.0 * time + len(name))
    output = output + noise * np.random.default_rng(len(name)).standard_normal(time.size)
    drive = amplitude * np.cos(theta)
    return Record(name, Path(f"{name}.npz"), time, rate, drive, output, drive, output)


def fitted_value(campaign_of, records, element, name: str) -> tuple[float, float]:
    """A coefficient of an effect beside the oscillator, and its error."""
    campaign = campaign_of(records, output=displacements(1e-7))
    found = fit(Isolator(MASS, (*BASE.elements, element)), campaign)
    place = found.estimate.names.index(name)
    return float(found.model[name]), float(found.estimate.uncertainty.standard_error[place])


def test_a_third_harmonic_of_the_drive_is_recovered(campaign_of):
    law = ((1, 1.0, 0.0), (3, 0.04, 0.6))
    records = tuple(steady_record(f"at {f} Hz", law, frequency=f) for f in (4.5, 5.5, 7.0))
    start = DriveHarmonics(0.01, 0.0, 3.0)
    share, error = fitted_value(campaign_of, records, start, "drive_harmonics.share")
    assert abs(share - 0.04) < 4.0 * error + 1e-4


def test_hum_of_two_records_is_recovered(campaign_of):
    records = tuple(
        steady_record(f"{f:.2f} Hz" + "." * place, ((1, 1.0, 0.0),), frequency=f, hum=4e-6)
        for place, f in enumerate((4.5, 5.5, 7.0))
    )
    amplitude, error = fitted_value(campaign_of, records, MainsHum(1e-6, 50.0), "mains_hum.amplitude")
    assert abs(amplitude - 4e-6) < 4.0 * error + 4e-8


def test_a_held_drive_is_scored_with_its_share_where_one_step_spans_a_sample(simulated):
    # Both courses agree at every sample: what is between them must count.
    plant = rig.Plant((rig.LinearStiffness(STIFFNESS), rig.LinearDamping(DAMPING)), MASS)
    bench = rig.Bench(
        rate=250.0, output="displacement", noise=1e-7, force_noise=0.0, drift=0.0, anti_alias=False
    )
    plan = rig.Multisine((60.0,), 2.0, 12.0, 4.0, 3)
    campaign = simulated(plant.plus(rig.InputHold(0.0)), plan, bench=bench)
    truth = Isolator(MASS, (LinearStiffness(STIFFNESS), LinearDamping(DAMPING)))
    found = fit(truth, campaign, integrator=Integrator())
    (score,) = score_test(found.estimate, Search(scales(campaign)), (InputHold(0.0, 0.0),)).scores
    assert score.strength == pytest.approx(1.0, abs=0.05)
    # Of the noise alone: what the declared course leaves enlarges this error as it does those of a fit.
    assert score.error / found.estimate.inflation**0.5 < 0.02
