"""The floor of a spectrum against white noise that was put in, over many draws."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.signal
from jaxtyping import Float
from made_campaign import campaign_of

from isojax.records import (
    Campaign,
    Filter,
    Record,
    brief_blows,
    data_health,
    estimate_noise,
)
from isojax.records._record import ExcitationKind
from isojax.records.spectrum._filter import compensate_butterworth
from isojax.records.spectrum._noise_band import NoiseBand

RATE, SIGMA, SEEDS = 500.0, 0.013, 24
LOW = Filter("butterworth", 4, 60.0, applied=True)


def found_in(output: Float[np.ndarray, " time"], low: Filter | None = None) -> float:
    noise = estimate_noise(made_of(output, np.sin(np.arange(output.size) / RATE), "broadband", low))
    assert noise.method == "high_frequency"
    return noise.sigma


def made_of(
    output: Float[np.ndarray, " time"],
    drive: Float[np.ndarray, " time"],
    kind: ExcitationKind,
    low: Filter | None = None,
) -> Campaign:
    time = np.arange(output.size) / RATE
    record = Record("a", Path("a.npz"), time, RATE, drive, output, drive, output, kind=kind)
    return campaign_of(record, low=low)


def signal_of(kind: str, seed: int, size: int) -> Float[np.ndarray, " time"]:
    time = np.arange(size) / RATE
    if kind == "silent":
        return np.zeros(size)
    if kind == "swept":
        return 5.0 * scipy.signal.chirp(time, 3.0, time[-1], 8.0)
    if kind == "decay":
        return 2.0 * np.exp(-time / 2.0) * np.cos(2 * np.pi * 5.0 * time)
    # broadband: the response fills the band up to the named share of half the rate
    sections = scipy.signal.butter(8, float(kind) * 0.5 * RATE, fs=RATE, output="sos")
    return scipy.signal.sosfilt(sections, np.random.default_rng(1000 + seed).normal(size=size))


@pytest.mark.parametrize("size", [2500, 10000, 40000])
@pytest.mark.parametrize("kind", ["silent", "swept", "decay", "0.1", "0.3"])
def test_the_floor_is_unbiased(kind: str, size: int) -> None:
    found = np.array(
        [
            found_in(signal_of(kind, seed, size) + SIGMA * np.random.default_rng(seed).normal(size=size))
            for seed in range(SEEDS)
        ]
    )
    error = np.std(found) / np.sqrt(SEEDS)
    assert abs(np.mean(found) - SIGMA) < 0.01 * SIGMA + 2.0 * error
    if size > 2500:
        assert np.mean(found) == pytest.approx(SIGMA, rel=0.012)


def test_a_response_that_fills_the_lower_parts_is_no_noise() -> None:
    found = [
        found_in(signal_of("0.5", seed, 20000) + SIGMA * np.random.default_rng(seed).normal(size=20000))
        for seed in range(SEEDS)
    ]
    # the skirt of the response is really there: up to three standard errors of a part, 2 % here, may pass
    assert 0.995 * SIGMA < np.mean(found) < 1.035 * SIGMA


def test_noise_that_a_bench_filtered_is_what_the_filter_left() -> None:
    sections = scipy.signal.butter(LOW.order, LOW.cutoff_hz, fs=RATE, output="sos")
    made, found = [], []
    for seed in range(SEEDS):
        noise = scipy.signal.sosfilt(sections, SIGMA * np.random.default_rng(seed).normal(size=20000))
        made.append(np.std(noise))
        found.append(found_in(signal_of("swept", seed, 20000) + noise, LOW))
    assert np.mean(found) == pytest.approx(np.mean(made), rel=0.015)


@pytest.mark.parametrize("applied", [True, False], ids=["bench", "reader"])
def test_power_gain_is_that_of_the_filter(applied: bool) -> None:
    frequency = np.linspace(0.0, 0.49 * RATE, 60)
    sections = scipy.signal.butter(LOW.order, LOW.cutoff_hz, fs=RATE, output="sos")
    gain = np.abs(scipy.signal.sosfreqz(sections, frequency, fs=RATE)[1]) ** (2 if applied else 4)
    band = NoiseBand(RATE, Filter("butterworth", LOW.order, LOW.cutoff_hz, applied))
    np.testing.assert_allclose(band.power_gain(frequency), gain, atol=1e-12)
    noise = np.random.default_rng(1).normal(size=400_000)
    left = (scipy.signal.sosfilt if applied else scipy.signal.sosfiltfilt)(sections, noise)
    assert band.share == pytest.approx(np.mean(left**2) / np.mean(noise**2), rel=0.01)


def test_noise_is_white_again_as_far_as_a_filter_is_taken_out() -> None:
    sections = scipy.signal.butter(LOW.order, LOW.cutoff_hz, fs=RATE, output="sos")
    noise = np.random.default_rng(1).normal(size=400_000)
    filed = scipy.signal.sosfilt(sections, noise)
    left = compensate_butterworth(filed, RATE, LOW.order, LOW.cutoff_hz)
    band = NoiseBand(RATE, replace(LOW, compensate=True))
    assert band.share == pytest.approx(np.mean(left**2) / np.mean(noise**2), rel=0.01)
    assert band.as_filed.share == pytest.approx(np.mean(filed**2) / np.mean(noise**2), rel=0.01)
    np.testing.assert_array_equal(band.power_gain(np.linspace(0.0, 0.9 * LOW.cutoff_hz, 9)), 1.0)


def blow(width: int, size: int = 3000) -> tuple[Float[np.ndarray, " time"], Float[np.ndarray, " time"]]:
    """Acceleration and force of 40 kg at 6 Hz and 3 %, hit twice by half-sines of so many samples."""
    force = np.zeros(size)
    for start in (50, 200):
        force[start : start + width + 1] = 700.0 * np.sin(np.pi * np.arange(width + 1) / width)
    w = 2.0 * np.pi * 6.0
    system = scipy.signal.StateSpace(
        [[0, 1], [-w * w, -0.06 * w]], [[0], [1 / 40]], [[-w * w, -0.06 * w]], [[1 / 40]]
    )
    return scipy.signal.lsim(system, force, np.arange(size) / RATE)[1], force


@pytest.mark.parametrize("width", [3, 6, 25])
def test_a_blow_is_no_noise(width: int) -> None:
    output, force = blow(width)
    found = []
    for seed in range(SEEDS):
        noisy = output + SIGMA * np.random.default_rng(seed).normal(size=output.size)
        noise = estimate_noise(made_of(noisy, force, "impulse"))
        assert noise.method == "high_frequency"
        found.append(noise.sigma)
    assert np.mean(found) == pytest.approx(SIGMA, rel=0.01 + 2.0 * np.std(found) / SIGMA / np.sqrt(SEEDS))


def test_the_jump_of_a_release_is_no_noise() -> None:
    time = np.arange(3000) / RATE - 0.5
    motion = np.where(time < 0.0, 0.0, 8.0 * np.exp(-np.maximum(time, 0.0)) * np.cos(2 * np.pi * 5.0 * time))
    found = [
        estimate_noise(
            made_of(
                motion + SIGMA * np.random.default_rng(seed).normal(size=time.size),
                np.zeros(time.size),
                "free_decay",
            )
        ).sigma
        for seed in range(SEEDS)
    ]
    assert np.mean(found) == pytest.approx(SIGMA, rel=0.01 + 2.0 * np.std(found) / SIGMA / np.sqrt(SEEDS))


@pytest.mark.parametrize(("width", "seen"), [(3, 2), (4, 3), (5, 4), (25, 24)])
def test_a_blow_of_fewer_than_four_samples_is_named(width: int, seen: int) -> None:
    output, force = blow(width)
    noisy = force + np.random.default_rng(0).normal(size=force.size)
    campaign = made_of(output, noisy, "impulse")
    expected = [("a", seen)] if seen < 4 else []
    assert [(one.record, one.samples) for one in brief_blows(campaign)] == expected
    assert data_health(campaign).brief_blows == brief_blows(campaign)
    assert brief_blows(made_of(output, noisy, "broadband")) == ()
