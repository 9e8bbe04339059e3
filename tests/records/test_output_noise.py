"""The noise estimate against noise that is known."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.signal
from made_campaign import campaign_of

from isojax import read_campaign
from isojax.records import Filter, Record, data_health, estimate_noise

RATE, SIGMA = 500.0, 0.013
EXAMPLES = ["quiet", "friction", "relaxation", "asymmetry"]


@pytest.mark.parametrize("example", EXAMPLES)
def test_noise_of_the_examples_is_found_within_three_per_cent(example: str, shared_data: Path) -> None:
    truth = json.loads((shared_data / "examples" / example / "truth.json").read_text())["noise"]
    noise = estimate_noise(read_campaign(shared_data / "examples" / example))
    assert noise.method == "cycle_scatter"
    assert noise.sigma == pytest.approx(truth, rel=0.03)
    np.testing.assert_allclose(noise.per_record, truth, rtol=0.05)


def response(force: np.ndarray, stiffness: float = 1500.0) -> np.ndarray:
    system = scipy.signal.StateSpace([[0, 1], [-stiffness, -1.5]], [[0], [1]], [[stiffness, 0]], [[0]])
    return scipy.signal.lsim(system, force, np.arange(force.size) / RATE)[1]


def record_of(name: str, force: np.ndarray, output: np.ndarray, **fields: object) -> Record:
    time = np.arange(force.size) / RATE
    return Record(name, Path(f"{name}.npz"), time, RATE, force, output, force, output, **fields)  # type: ignore[arg-type]


def low_passed(seed: int, size: int = 20000) -> np.ndarray:
    sections = scipy.signal.butter(4, 40.0, fs=RATE, output="sos")
    return 3.0 * scipy.signal.sosfilt(sections, np.random.default_rng(seed).normal(size=size))


def test_declared_noise_is_taken() -> None:
    force = low_passed(1)
    noise = estimate_noise(campaign_of(record_of("a", force, response(force)), noise=0.5))
    assert (noise.sigma, noise.method, noise.per_record) == (0.5, "declared", (0.5,))


def test_the_floor_of_a_broadband_record_is_its_noise() -> None:
    force = low_passed(1)
    output = response(force) + SIGMA * np.random.default_rng(2).normal(size=force.size)
    noise = estimate_noise(campaign_of(record_of("a", force, output)))
    assert noise.method == "high_frequency"
    assert noise.sigma == pytest.approx(SIGMA, rel=0.05)


@pytest.mark.parametrize("drift", [0.0, 0.002])
def test_repeats_show_the_noise_in_spite_of_drift_and_forcing_differences(drift: float) -> None:
    force, random = low_passed(1), np.random.default_rng(3)
    records = []
    for repeat in range(2):
        driven = force + 0.005 * low_passed(10 + repeat)
        output = response(driven, 1500.0 * (1.0 + drift * repeat)) + SIGMA * random.normal(size=force.size)
        measured = driven + 0.001 * random.normal(size=force.size)
        late = 37 * repeat
        records.append(record_of(f"r{repeat}", measured[late:], output[late:], level=1.0, repeat=repeat))
    noise = estimate_noise(campaign_of(*records))
    assert noise.method == "repeats"
    assert noise.sigma == pytest.approx(SIGMA, rel=0.05)


def test_periods_show_the_noise_though_the_first_is_a_transient() -> None:
    period = np.random.default_rng(4).normal(size=2000)
    force = np.tile(period, 5)
    output = response(force) + SIGMA * np.random.default_rng(5).normal(size=force.size)
    noise = estimate_noise(campaign_of(record_of("p", force, output, period=2000, kind="periodic")))
    assert noise.method == "periods"
    assert noise.sigma == pytest.approx(SIGMA, rel=0.03)


def test_one_period_takes_the_noise_that_the_others_show() -> None:
    period = np.random.default_rng(4).normal(size=2000)
    force = np.tile(period, 6)
    output = response(force) + SIGMA * np.random.default_rng(5).normal(size=force.size)
    fitted = record_of("p[4000:10000]", force[4000:10000], output[4000:10000], period=2000, kind="periodic")
    held = record_of(
        "p[10000:12000]", force[10000:], output[10000:], period=2000, kind="periodic", role="holdout"
    )
    noise = estimate_noise(campaign_of(fitted, held))
    assert noise.per_record == (noise.sigma, noise.sigma)
    assert noise.sigma == pytest.approx(SIGMA, rel=0.03)


def test_noise_that_a_filter_limits_is_noted() -> None:
    force = low_passed(1)
    record = record_of("a", force, response(force))
    noise = estimate_noise(campaign_of(record, noise=0.1, low=Filter("butterworth", 4, 60.0)))
    assert noise.bandwidth_hz == 60.0
    assert "band limited by the butterworth filter at 60 Hz" in noise.note


@pytest.mark.parametrize("harmonics", [1, 9])
def test_cycle_scatter_sees_no_harmonic_as_noise(harmonics: int, tmp_path: Path) -> None:
    random = np.random.default_rng(9)
    parts = []
    for frequency in (3.3, 4.1, 5.2, 6.7):
        time = np.arange(round(20 * RATE / frequency)) / RATE
        parts.append(sum(np.sin(2 * np.pi * k * frequency * time + k) / k for k in range(1, harmonics + 1)))
    clean = np.concatenate(parts)
    np.savez(tmp_path / "run.npz", force=clean, x=clean + SIGMA * random.normal(size=clean.size))
    (tmp_path / "campaign.toml").write_text(
        """
        campaign = { mass = 1.0 }
        input = { quantity = "force", column = "force", unit = "N" }
        output = { quantity = "displacement", column = "x", unit = "m" }
        sampling = { rate = 500.0 }
        [[record]]
        file = "run.npz"
        role = "fit"
        """
    )
    noise = estimate_noise(read_campaign(tmp_path))
    assert noise.method == "cycle_scatter"
    assert noise.sigma == pytest.approx(SIGMA, rel=0.05)


def test_noise_that_the_reader_filtered_is_what_the_filter_leaves(tmp_path: Path) -> None:
    random = np.random.default_rng(11)
    wave = np.concatenate(
        [np.sin(2 * np.pi * f * np.arange(round(40 * RATE / f)) / RATE) for f in (3.3, 4.1, 5.2, 6.7)]
    )
    noise = SIGMA * random.normal(size=wave.size)
    np.savez(tmp_path / "run.npz", force=wave, x=wave + noise)
    (tmp_path / "campaign.toml").write_text(
        """
        campaign = { mass = 1.0 }
        input = { quantity = "force", column = "force", unit = "N" }
        output = { quantity = "displacement", column = "x", unit = "m" }
        sampling = { rate = 500.0 }
        filter = { order = 6, cutoff_hz = 60.0, applied = false }
        [[record]]
        file = "run.npz"
        role = "fit"
        """
    )
    sections = scipy.signal.butter(6, 60.0, fs=RATE, output="sos")
    left = np.std(scipy.signal.sosfiltfilt(sections, noise))
    found = estimate_noise(read_campaign(tmp_path))
    assert found.method == "cycle_scatter"
    assert found.sigma == pytest.approx(left, rel=0.1)


def test_health_names_a_dwell_that_never_settles(shared_data: Path) -> None:
    campaign = read_campaign(shared_data / "examples" / "quiet")
    record = campaign.fit_records[0]
    dwell = record.dwells[7]
    time = (np.arange(dwell.start, dwell.stop) - dwell.start) / record.rate
    shaken = record.output.copy()
    shaken[dwell.start : dwell.stop] *= 1.0 + 0.2 * np.sin(2 * np.pi * dwell.frequency * time / 3.0)
    before = data_health(replace(campaign, records=(record,)))
    after = data_health(replace(campaign, records=(replace(record, output=shaken),)))
    assert before.unsettled == ()
    assert [one.dwell for one in after.unsettled] == [dwell]
    assert after.unsettled[0].change == pytest.approx(0.2 / np.sqrt(2), rel=0.3)


def test_repeats_of_the_examples_agree_within_a_per_cent(shared_data: Path) -> None:
    health = data_health(read_campaign(shared_data / "examples" / "quiet"))
    assert health.dwells == 14 * 16
    assert len(health.repeats) == 6
    assert 0.0 < health.repeatability < 0.02
    assert len(health.unsettled) < 10
