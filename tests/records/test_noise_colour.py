"""The colour of the noise against autoregressive noise that was put in."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from jaxtyping import Float
from made_campaign import campaign_of
from scipy.signal import butter, lfilter, sosfilt

from isojax.records import Dwell, Filter, Record, estimate_noise

RATE, SIGMA = 250.0, 0.01
FREQUENCIES = (4.0, 4.4, 4.9, 5.3, 5.7, 6.2)


def noise_of(draw: np.random.Generator, count: int, share: float) -> Float[np.ndarray, " time"]:
    """Draw `n_t = share n_(t-1) + e_t` of rms `SIGMA`."""
    white = draw.standard_normal(count + 500) * np.sqrt(1.0 - share**2)
    return SIGMA * np.asarray(lfilter([1.0], [1.0, -share], white))[500:]


def stepped(name: str, seed: int, share: float) -> Record:
    """Dwells with twelve harmonics, all of them far above the noise."""
    parts, dwells, start = [], [], 0
    for frequency in FREQUENCIES:
        size = round(20 * RATE / frequency)
        angle = 2.0 * np.pi * frequency * np.arange(size) / RATE
        parts.append(sum(np.cos(order * angle + order) / order for order in range(1, 13)))
        dwells.append(Dwell(start, start + size, frequency, 20.0))
        start += size
    drive = np.concatenate(parts)
    output = drive + noise_of(np.random.default_rng(seed), drive.size, share)
    time = np.arange(drive.size) / RATE
    held = drive, output, drive, output
    return Record(name, Path(name), time, RATE, *held, dwells=tuple(dwells), kind="stepped_sine")


def periodic(seed: int, share: float) -> Record:
    drive = np.tile(np.random.default_rng(99).standard_normal(1000), 8)
    output = drive + noise_of(np.random.default_rng(seed), drive.size, share)
    held = drive, output, drive, output
    return Record(
        "p", Path("p"), np.arange(drive.size) / RATE, RATE, *held, period=1000, settle=0, kind="periodic"
    )


def density_of(law: tuple[float, ...], innovation: float, frequency: np.ndarray) -> np.ndarray:
    turns = np.exp(-2j * np.pi * np.outer(frequency / RATE, np.arange(1, len(law) + 1)))
    return innovation**2 / np.abs(1.0 + turns @ np.array(law)) ** 2


@pytest.mark.parametrize("share", [0.5, 0.9, -0.6])
@pytest.mark.parametrize("kind", ["dwells", "periods"])
def test_the_density_is_that_of_the_noise_though_harmonics_were_removed(kind: str, share: float) -> None:
    frequency = np.linspace(2.0, 120.0, 60)
    true = SIGMA * np.sqrt(1.0 - share**2)
    ratios = []
    for seed in range(6):
        made = (
            [periodic(seed, share)]
            if kind == "periods"
            else [stepped(f"r{k}", 10 * seed + k, share) for k in (1, 2)]
        )
        noise = estimate_noise(campaign_of(*made))
        assert noise.colour is not None
        assert noise.colour.innovation == pytest.approx(true, rel=0.06)
        assert noise.sigma == pytest.approx(SIGMA, rel=0.25)
        found = density_of(noise.law, noise.colour.innovation, frequency)
        ratios.append(found / density_of((-share,), true, frequency))
    # Two records of six dwells hold some 2000 samples of noise each time.
    assert np.all(np.abs(np.mean(ratios, axis=0) - 1.0) < 0.15)


def test_density_that_falls_as_one_over_f_is_followed_over_the_band_of_the_dwells() -> None:
    lines = np.arange(1, 2**15 + 1)
    frequency = np.geomspace(3.0, 120.0, 12)
    ratios = []
    for seed in range(4):
        draw = np.random.default_rng(seed)
        records = []
        for name in ("1", "2", "3", "4"):
            record = stepped(name, 0, 0.0)
            spectrum = np.fft.rfft(draw.standard_normal(2**16))
            spectrum[1:] /= np.sqrt(lines / lines[-1])
            spectrum[0] = 0.0
            noise = SIGMA * np.fft.irfft(spectrum)[: record.output.size]
            records.append(replace(record, output=record.input + noise))
        noise = estimate_noise(campaign_of(*records))
        assert noise.colour is not None
        found = density_of(noise.law, noise.colour.innovation, frequency)
        ratios.append(found / (SIGMA**2 * 0.5 * RATE / frequency))
    assert np.all(np.abs(np.log(np.mean(ratios, axis=0))) < 0.3)


@pytest.mark.parametrize("share", [0.5, 0.9, -0.6])
def test_no_band_is_trusted_more_than_under_white_noise_of_the_same_rms(share: float) -> None:
    noise = estimate_noise(campaign_of(*(stepped(f"r{k}", k, share) for k in (1, 2, 3))))
    assert noise.colour is not None
    frequency = np.linspace(0.0, 0.5 * RATE, 2001)
    weighing = density_of(noise.whitening, noise.white, frequency)
    own = density_of(noise.law, noise.colour.innovation, frequency)
    assert np.min(weighing) > 0.85 * noise.sigma**2
    assert np.mean(np.abs(np.log(weighing / np.maximum(own, noise.sigma**2)))) < 0.05
    # What noise leaves of a sample behind the filter, from noise that was drawn by its true law.
    drawn = noise_of(np.random.default_rng(9), 400_000, share)
    left = np.asarray(lfilter([1.0, *noise.whitening], [1.0], drawn)) / noise.white
    assert np.mean(left**2) == pytest.approx(noise.share, rel=0.1)
    assert noise.share < 0.7


def test_noise_behind_a_filter_that_is_not_declared_keeps_weight_off_nothing_beyond_its_edge() -> None:
    record, low = stepped("a", 5, 0.0), butter(4, 60.0, fs=RATE, output="sos")
    noise = estimate_noise(campaign_of(replace(record, output=np.asarray(sosfilt(low, record.output)))))
    assert noise.colour is not None
    weighing = density_of(noise.whitening, noise.white, np.linspace(80.0, 120.0, 50))
    own = density_of(noise.law, noise.colour.innovation, np.linspace(80.0, 120.0, 50))
    assert np.all(own < 0.1 * noise.sigma**2)
    assert np.all(weighing > 0.8 * noise.sigma**2)


def test_white_noise_is_rarely_called_coloured() -> None:
    found = [estimate_noise(campaign_of(stepped("a", seed, 0.0))) for seed in range(60)]
    # BIC takes one coefficient of white noise by chance with probability below 1e-3, given these samples.
    assert sum(noise.colour is not None for noise in found) <= 1
    white = [noise for noise in found if noise.colour is None]
    assert all(noise.white == noise.sigma and noise.note == "" for noise in white)


def test_short_windows_whose_fundamentals_lie_side_by_side_show_no_peak_there() -> None:
    # Between them the removed fundamentals and their drifts take nearly all of the noise from 4.6 to 6.4 Hz.
    for seed in range(20):
        draw, parts, dwells, start = np.random.default_rng(seed), [], [], 0
        for frequency in np.arange(4.6, 6.5, 0.3):
            size = round(15 * 500.0 / frequency)
            parts.append(np.cos(2.0 * np.pi * frequency * np.arange(size) / 500.0))
            dwells.append(Dwell(start, start + size, float(frequency), 15.0))
            start += size
        drive = np.concatenate(parts)
        records = []
        for name in ("a", "b"):
            output = drive + SIGMA * draw.standard_normal(drive.size)
            held = drive, output, drive, output
            time = np.arange(drive.size) / 500.0
            own = {"dwells": tuple(dwells), "kind": "stepped_sine"}
            records.append(Record(name, Path(name), time, 500.0, *held, **own))
        noise = estimate_noise(replace(campaign_of(*records), rate=500.0))
        assert noise.colour is None
        assert noise.sigma == pytest.approx(SIGMA, rel=0.05)


def test_declared_and_filtered_noise_count_as_white() -> None:
    record = stepped("a", 1, 0.9)
    declared = estimate_noise(campaign_of(record, noise=0.02))
    filtered = estimate_noise(campaign_of(record, low=Filter("butterworth", 4, 60.0)))
    assert declared.colour is filtered.colour is None


def test_a_dwell_that_never_settles_does_not_colour_the_noise() -> None:
    record = stepped("a", 3, 0.0)
    dwell = record.dwells[2]
    own = slice(dwell.start, dwell.stop)
    size = dwell.stop - dwell.start
    beat = 20 * SIGMA * np.sin(2 * np.pi * 1.37 * dwell.frequency * np.arange(size) / RATE)
    output = record.output.copy()
    output[own] += beat
    noise = estimate_noise(campaign_of(replace(record, output=output)))
    assert noise.colour is None
