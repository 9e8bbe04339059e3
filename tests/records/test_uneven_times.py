"""Times that scatter, lose samples or step are found at the door, and resampled on request."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

from isojax import read_campaign
from isojax.records import draft_campaign, inspect_file
from isojax.records.formats import last_digit, time_jitter
from isojax.records.reading._resample import on_even_grid
from isojax.reporting import inspection_summary, render_text

Channels = dict[str, np.ndarray]
Tiny = Callable[..., Path]
WITH_TIME = ("rate = 200.0", 'time = "time"')
RESAMPLED = ("rate = 200.0", 'time = "time"\nresample = true')
RATE, SIZE = 200.0, 2000


def scattered(channels: Channels, reach: float, seed: int = 3) -> Channels:
    """The channels with times drawn evenly from a share of a step to either side."""
    away = np.random.default_rng(seed).uniform(-reach, reach, SIZE) / RATE
    return {**channels, "time": np.arange(SIZE) / RATE + 1.0 + away}


@pytest.mark.parametrize("reach", [0.05, 0.1, 0.3, 0.45])
def test_scattered_times_are_refused_with_the_figure(reach: float, tiny: Tiny, channels: Channels) -> None:
    with pytest.raises(ValueError, match=r"run\.csv: the times of column `time` scatter by") as refused:
        read_campaign(tiny(WITH_TIME, channels=scattered(channels, reach)))
    said = float(str(refused.value).partition("grid, ")[2].partition(" %")[0])
    assert said == pytest.approx(100.0 * reach / np.sqrt(3.0), rel=0.05)
    assert "expected at most 2 %" in str(refused.value)
    assert "resample = true" in str(refused.value)


def test_a_little_scatter_is_taken_as_even_and_stands_with_the_rate(tiny: Tiny, channels: Channels) -> None:
    read = read_campaign(tiny(WITH_TIME, channels=scattered(channels, 0.02)))
    assert read.records[0].output.size == SIZE
    assert "taken as even from times that scatter by 1.2 % of a step" in read.timing


@pytest.mark.parametrize("form", ["%.6g", "%.4f", "%.3f", "single"])
def test_rounded_times_are_even(form: str) -> None:
    time = np.arange(3000) / 512.0 + 7.0
    written = time.astype(np.float32).astype(float) if form == "single" else None
    if written is None:
        written = np.array([float(form % one) for one in time])
    assert time_jitter(written) == 0.0
    assert time_jitter(time) == 0.0


def test_last_digits_are_those_that_were_written() -> None:
    values = np.random.default_rng(1).normal(size=400)
    np.testing.assert_allclose(last_digit(np.round(values, 3)), 1e-3)
    short = np.array([float(f"{one:.4g}") for one in values])
    np.testing.assert_allclose(
        last_digit(short), 10.0 ** (np.floor(np.log10(np.abs(short))) - 3.0), rtol=1e-9
    )
    assert not np.any(last_digit(values))
    assert not np.any(last_digit(1e-5 * values))  # far below the last digit that they could end in


@pytest.mark.parametrize("lost", [1, 3])
@pytest.mark.parametrize("reach", [0.0, 0.1, 0.45])
def test_lost_samples_are_found_under_scatter(
    lost: int, reach: float, tiny: Tiny, channels: Channels
) -> None:
    spoiled = scattered(channels, reach)
    spoiled = {name: np.delete(one, slice(1200, 1200 + lost)) for name, one in spoiled.items()}
    with pytest.raises(ValueError, match=r"missing") as refused:
        read_campaign(tiny(RESAMPLED, channels=spoiled))
    row = int(str(refused.value).partition("row ")[2].partition(" ")[0])
    assert abs(row - 1201) <= (5 if reach else 0)


@pytest.mark.parametrize("by", [0.3, -0.6, 0.5])
@pytest.mark.parametrize("reach", [0.0, 0.05])
def test_a_clock_step_is_found(by: float, reach: float, tiny: Tiny, channels: Channels) -> None:
    spoiled = scattered(channels, reach)
    spoiled["time"][700:] += by / RATE
    with pytest.raises(ValueError, match=r"the clock steps about row|has a gap at row") as refused:
        read_campaign(tiny(WITH_TIME, channels=spoiled))
    row = int(str(refused.value).partition("row ")[2].partition(" ")[0])
    assert abs(row - 701) <= (5 if reach else 1)


def test_a_clock_that_slowly_runs_fast_is_even(tiny: Tiny, channels: Channels) -> None:
    channels["time"] = channels["time"] + 0.4 / RATE * np.sin(np.arange(SIZE) / 400.0)
    assert read_campaign(tiny(WITH_TIME, channels=channels)).records[0].output.size == SIZE


@pytest.mark.parametrize(("share", "error"), [(0.1, 1e-5), (0.2, 2e-3), (0.25, 1e-2)])
def test_resampled_sines_are_those_of_the_even_grid(share: float, error: float) -> None:
    """The page of campaign.toml states these errors; SciPy's sine at the grid is the truth."""
    time = np.arange(SIZE) + np.random.default_rng(8).uniform(-0.45, 0.45, SIZE)
    first, (even,) = on_even_grid(time / RATE, RATE, np.sin(2.0 * np.pi * share * time))
    phase = float(np.mean(time - np.arange(SIZE)))
    wanted = np.sin(2.0 * np.pi * share * (np.arange(first, first + even.size) + phase))
    inner = slice(20, -20)
    assert np.sqrt(2.0 * np.mean((even - wanted)[inner] ** 2)) < error
    taken = np.sin(2.0 * np.pi * share * time)[first : first + even.size]
    assert np.sqrt(2.0 * np.mean((taken - wanted)[inner] ** 2)) > 0.1


def test_a_resampled_record_is_that_of_the_even_clock(tiny: Tiny, channels: Channels) -> None:
    """Channels below a tenth of the rate, sampled unevenly: read, they are what an even clock gives."""
    smooth = {
        name: make_interp_spline(channels["time"][::10] + 1.0, channels[name][::10], k=5) for name in channels
    }
    spoiled = scattered(channels, 0.4)
    for name in ("force", "acceleration"):
        spoiled[name] = smooth[name](np.clip(spoiled["time"], 1.0, None))
    read = read_campaign(tiny(RESAMPLED, channels=spoiled))
    (record,) = read.records
    assert record.resampled
    assert record.rate == pytest.approx(RATE, rel=1e-5)
    assert record.output.size in (SIZE, SIZE - 1, SIZE - 2)
    assert "resampled from times that scatter by 24 % of a step" in read.timing
    even = 1.0 + (np.arange(record.output.size) + record.start) / RATE
    inner = slice(100, -100)
    for name, channel in (("force", record.input), ("acceleration", record.output)):
        wanted = smooth[name](even)
        assert np.std((channel - wanted)[inner]) < 0.01 * np.std(wanted)


def test_even_times_are_not_resampled(tiny: Tiny, channels: Channels) -> None:
    (record,) = read_campaign(tiny(RESAMPLED, channels=channels)).records
    assert not record.resampled
    assert record.output.size == SIZE


def test_resampling_needs_times(tiny: Tiny) -> None:
    with pytest.raises(ValueError, match=r"\[sampling\] resample = true needs the field `time`"):
        read_campaign(tiny(("rate = 200.0", "rate = 200.0\nresample = true")))


def test_inspection_shows_the_scatter_and_drafts_what_is_read(tmp_path: Path, channels: Channels) -> None:
    file, spoiled = tmp_path / "run.csv", scattered(channels, 0.3)
    table = np.column_stack(list(spoiled.values()))
    np.savetxt(file, table, delimiter=",", header="time,force [N],acc [g]", comments="", fmt="%.9g")
    found = inspect_file(file)
    assert found.time_jitter * RATE == pytest.approx(0.3 / np.sqrt(3.0), rel=0.05)
    assert "the times scatter by 0.89 ms rms, 18 % of a step" in render_text(inspection_summary([found]))
    (tmp_path / "campaign.toml").write_text(draft_campaign([found], tmp_path))
    assert read_campaign(tmp_path).records[0].resampled
