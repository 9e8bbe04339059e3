"""Filter, harmonics, receptance and integration against closed forms."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.signal

from isojax import read_campaign
from isojax.records import (
    Campaign,
    Dwell,
    Filter,
    InputChannel,
    OutputChannel,
    Record,
    compare_filtered_receptance,
    dwell_harmonics,
    integrate_acceleration,
    measured_state,
    receptance,
    zero_phase_butterworth,
)
from isojax.records.spectrum._filter import compensate_butterworth, unsure_samples

RATE = 1000.0


def record_of(drive: np.ndarray, response: np.ndarray, dwells: tuple[Dwell, ...] = ()) -> Record:
    time = np.arange(drive.size) / RATE
    kind = "stepped_sine" if dwells else "broadband"
    return Record(
        "made", Path("made.npz"), time, RATE, drive, response, drive, response, dwells=dwells, kind=kind
    )


def campaign_of(
    record: Record,
    drive: str = "force",
    response: str = "acceleration",
    mass: float = 3.0,
    low: Filter | None = None,
) -> Campaign:
    return Campaign(
        title="made",
        file=Path("campaign.toml"),
        mass=mass,
        mass_free=False,
        input=InputChannel(drive, "f", "N"),  # type: ignore[arg-type]
        output=OutputChannel(response, "a", "m/s^2"),  # type: ignore[arg-type]
        filter=low,
        rate=RATE,
        stiffness=(),
        damping=(),
        elements=(),
        records=(record,),
    )


def test_the_filter_has_the_gain_of_two_butterworths_and_no_phase() -> None:
    time = np.arange(20000) / RATE
    for frequency in (5.0, 20.0, 40.0):
        filtered = zero_phase_butterworth(np.sin(2 * np.pi * frequency * time), RATE, 3, 20.0)
        # bilinear transform: the analogue frequency is the warped one
        warped = np.tan(np.pi * frequency / RATE) / np.tan(np.pi * 20.0 / RATE)
        expected = np.sin(2 * np.pi * frequency * time) / (1.0 + warped**6)
        np.testing.assert_allclose(filtered[3000:-3000], expected[3000:-3000], atol=1e-9)


@pytest.mark.parametrize("order", [1, 2, 4, 8])
def test_what_a_filter_took_is_given_back(order: int) -> None:
    time = np.arange(8000) / RATE
    draw = np.random.default_rng(order)
    tones = zip(draw.uniform(0.5, 45.0, 12), draw.uniform(0.0, 6.0, 12), strict=True)
    signal = sum(np.sin(2 * np.pi * frequency * time + phase) for frequency, phase in tones)
    sections = scipy.signal.butter(order, 50.0, fs=RATE, output="sos")
    filtered = scipy.signal.sosfilt(sections, signal)
    unsure = unsure_samples(RATE, order, 50.0)
    inside = slice(unsure, -unsure)
    assert np.std((filtered - signal)[inside]) > 0.1
    found = compensate_butterworth(filtered, RATE, order, 50.0)
    np.testing.assert_allclose(found[inside], signal[inside], rtol=0.0, atol=5e-4 * np.max(np.abs(signal)))


@pytest.mark.parametrize(("order", "cutoff"), [(0, 20.0), (3, 500.0), (3, 0.0)])
def test_an_impossible_filter_is_refused(order: int, cutoff: float) -> None:
    with pytest.raises(ValueError, match=r"Argument `(order|cutoff_hz)` must"):
        zero_phase_butterworth(np.zeros(1000), RATE, order, cutoff)


def test_harmonics_of_a_sum_of_sines_are_exact_where_a_cycle_is_no_whole_number_of_samples() -> None:
    frequency, random = 6.37, np.random.default_rng(5)
    drive_true = random.normal(size=8) + 1j * random.normal(size=8)
    response_true = random.normal(size=8) + 1j * random.normal(size=8)
    drive_true[0], response_true[0] = 0.3, -0.7
    start, stop = 137, 3391
    time = (np.arange(4000) - start) / RATE
    waves = np.exp(2j * np.pi * np.arange(8)[:, None] * frequency * time)
    dwell = Dwell(start, stop, frequency, (stop - start) * frequency / RATE)
    record = record_of((drive_true @ waves).real, (response_true @ waves).real, (dwell,))
    found = dwell_harmonics(record, dwell)
    np.testing.assert_allclose(found.input, drive_true, atol=1e-11)
    np.testing.assert_allclose(found.output, response_true, atol=1e-11)
    assert found.output_residual < 1e-11


def test_harmonics_above_half_the_rate_are_zero() -> None:
    dwell = Dwell(0, 1000, 130.0, 130.0)
    wave = np.cos(2 * np.pi * 130.0 * np.arange(1000) / RATE)
    np.testing.assert_allclose(dwell_harmonics(record_of(wave, wave, (dwell,)), dwell).output[4:], 0.0)


def test_a_dwell_too_short_for_its_harmonics_is_refused() -> None:
    dwell = Dwell(0, 12, 5.0, 0.06)
    record = record_of(np.arange(100.0), np.arange(100.0), (dwell,))
    with pytest.raises(ValueError, match="must leave more than 15 settled samples"):
        dwell_harmonics(record, dwell)


MASS, DAMPING, STIFFNESS = 3.0, 8.0, 2500.0


def steady_dwells(quantity: str, base: bool = False) -> Record:
    """A linear oscillator in the steady state of three dwells; with base excitation the input is its
    acceleration.
    """
    drives, responses, dwells, start = [], [], [], 0
    for frequency in (3.1, 4.7, 6.3):
        w = 2.0 * np.pi * frequency
        samples = round(24 * RATE / frequency)
        wave = np.exp(1j * w * np.arange(samples) / RATE)
        force = 5.0 * np.exp(0.4j)
        relative = force / (STIFFNESS - MASS * w**2 + 1j * w * DAMPING)
        ground = -force / MASS
        if base:
            drive, response = ground, -(w**2) * relative + ground
        else:
            drive, response = (
                force,
                relative * (1j * w) ** ("displacement", "velocity", "acceleration").index(quantity),
            )
        drives.append((drive * wave).real)
        responses.append((response * wave).real)
        dwells.append(Dwell(start, start + samples, frequency, samples * frequency / RATE))
        start += samples
    return record_of(np.concatenate(drives), np.concatenate(responses), tuple(dwells))


@pytest.mark.parametrize(
    ("quantity", "drive"),
    [
        ("displacement", "force"),
        ("velocity", "force"),
        ("acceleration", "force"),
        ("acceleration", "base_acceleration"),
    ],
)
def test_receptance_of_a_linear_oscillator_is_the_closed_form(quantity: str, drive: str) -> None:
    record = steady_dwells(quantity, drive == "base_acceleration")
    found = receptance(campaign_of(record, drive, quantity, MASS), record)
    w = 2.0 * np.pi * found.frequency
    np.testing.assert_allclose(
        found.receptance, 1.0 / (STIFFNESS - MASS * w**2 + 1j * w * DAMPING), rtol=1e-9
    )
    np.testing.assert_allclose(np.abs(found.force), 5.0, rtol=1e-9)


def test_receptance_needs_dwells() -> None:
    record = record_of(np.arange(100.0), np.arange(100.0))
    with pytest.raises(ValueError, match="must be a stepped sine with dwells, but made is broadband"):
        receptance(campaign_of(record), record)


def test_a_filter_on_both_channels_leaves_the_receptance() -> None:
    record = steady_dwells("acceleration")
    campaign = campaign_of(record, mass=MASS, low=Filter("butterworth", 1, 30.0, applied=True))
    both = compare_filtered_receptance(campaign, record)
    np.testing.assert_allclose(both.filtered.receptance, both.raw.receptance, rtol=3e-3)
    assert abs(both.filtered.force[2]) == pytest.approx(5.0 / (1.0 + (6.3 / 30.0) ** 2), rel=0.003)
    with pytest.raises(ValueError, match=r"must be given"):
        compare_filtered_receptance(replace(campaign, filter=None), record)


def test_the_reader_filters_where_the_bench_did_not(tiny: Callable[..., Path]) -> None:
    low = "[filter]\norder = 4\ncutoff_hz = 20.0\napplied = {}\n[model]"
    raw = read_campaign(tiny((r"\[model\]", low.format("true")))).records[0]
    assert raw.input is raw.raw_input
    filtered = read_campaign(tiny((r"\[model\]", low.format("false")))).records[0]
    np.testing.assert_array_equal(filtered.raw_output, raw.output)
    np.testing.assert_allclose(
        filtered.output, zero_phase_butterworth(raw.output, 200.0, 4, 20.0), rtol=1e-12
    )
    assert np.std(filtered.input) < 0.9 * np.std(raw.input)


@pytest.mark.parametrize("edge", [0, 1])
def test_integration_of_sines_is_exact_away_from_the_ends(edge: int) -> None:
    time = np.arange(30000) / RATE
    parts = [(0.02, 3.3, 0.2), (0.01, 5.71, 1.3), (0.003, 17.2, 2.0)]
    x = sum(a * np.sin(2 * np.pi * f * time + p) for a, f, p in parts)
    v = sum(a * 2 * np.pi * f * np.cos(2 * np.pi * f * time + p) for a, f, p in parts)
    a = -sum(a * (2 * np.pi * f) ** 2 * np.sin(2 * np.pi * f * time + p) for a, f, p in parts)
    velocity, displacement = integrate_acceleration(a + edge * 0.05, RATE, 2.0)
    inner = slice(3000, -3000)
    assert np.max(np.abs(velocity - v)[inner]) < 1e-3 * np.std(v)
    assert np.max(np.abs(displacement - x)[inner]) < 1e-3 * np.std(x)
    # the ends do not wrap around: two periods of the lowest frequency in, the error is some per cent
    assert np.max(np.abs(displacement - x)[1000:-1000]) < 0.05 * np.std(x)


def test_integration_does_not_drift_under_noise_and_offset() -> None:
    random = np.random.default_rng(6)
    time = np.arange(60000) / RATE
    a = np.sin(2 * np.pi * 5 * time)
    _, displacement = integrate_acceleration(a + 0.3 + 0.02 * random.normal(size=time.size), RATE, 2.5)
    expected = -a / (2 * np.pi * 5) ** 2
    # white noise of density 2 sigma^2 / rate, integrated twice, from half of the lowest frequency up
    most = np.sqrt(2.0 * 0.02**2 / RATE / (3.0 * (2.0 * np.pi) ** 4 * 1.25**3))
    assert np.sqrt(np.mean((displacement - expected)[4000:-4000] ** 2)) < most


@pytest.mark.parametrize("lowest", [0.0, 0.01, 600.0])
def test_an_impossible_lowest_frequency_is_refused(lowest: float) -> None:
    with pytest.raises(ValueError, match="Argument `lowest_frequency` must lie between"):
        integrate_acceleration(np.zeros(2000), RATE, lowest)


@pytest.mark.parametrize("quantity", ["displacement", "velocity", "acceleration"])
def test_the_state_comes_from_whatever_was_measured(quantity: str) -> None:
    random, time = np.random.default_rng(8), np.arange(20000) / RATE
    w = 2 * np.pi * 4.3
    state = {
        "displacement": np.sin(w * time),
        "velocity": w * np.cos(w * time),
        "acceleration": -w * w * np.sin(w * time),
    }
    measured = state[quantity] + 1e-4 * np.std(state[quantity]) * random.normal(size=time.size)
    record = record_of(np.cos(w * time), measured, (Dwell(0, 20000, 4.3, 86.0),))
    found = measured_state(record, quantity)  # type: ignore[arg-type]
    for name, values in zip(state, found, strict=True):
        error = (values - state[name])[3000:-3000]
        assert np.sqrt(np.mean(error**2)) < 3e-3 * np.std(state[name]), name
    assert found[list(state).index(quantity)] is record.output


@pytest.mark.parametrize("start", [0.3, 1.7])
def test_a_periodic_acceleration_gives_its_first_state_in_the_middle_of_a_motion(start):
    period, lines = 1000, np.array([3, 5, 8, 13])
    frequency = 2.0 * np.pi * lines * RATE / period
    time = np.arange(4 * period) / RATE
    phases = frequency[:, None] * time + start * lines[:, None] ** 2
    size = 1.0 / lines[:, None]
    acceleration = np.sum(-size * frequency[:, None] ** 2 * np.cos(phases), axis=0)
    record = record_of(acceleration, acceleration)
    x, v, _ = measured_state(replace(record, kind="periodic", period=period), "acceleration")
    truth = np.sum(size * np.cos(phases), axis=0)
    speed = np.sum(-size * frequency[:, None] * np.sin(phases), axis=0)
    for place in (0, -1):
        assert abs(x[place] - truth[place]) < 0.02 * np.std(truth)
        assert abs(v[place] - speed[place]) < 0.02 * np.std(speed)


def test_an_acceleration_that_rings_down_at_its_start_is_not_continued_by_its_period():
    period = 500
    time = np.arange(6 * period) / RATE
    steady = np.cos(2.0 * np.pi * 10.0 * time)
    record = record_of(steady, steady + 5.0 * np.exp(-3.0 * time) * np.sin(2.0 * np.pi * 7.0 * time))
    declared = replace(record, kind="periodic", period=period)
    np.testing.assert_array_equal(
        measured_state(declared, "acceleration")[0], measured_state(record, "acceleration")[0]
    )
