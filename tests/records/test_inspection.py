"""What `inspect` finds in files of known content, and that a campaign reads its drafts."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import scipy.signal

from isojax import read_campaign
from isojax.demo import campaign_folder
from isojax.records import draft_campaign, find_data_files, find_period, inspect_file
from isojax.records.inspection._arrangement import arrange
from isojax.records.inspection._guess import guess_quantity
from isojax.records.inspection._inertia_of_records import guess_mass
from isojax.records.noise import clipped_share
from isojax.rig import Bench, LinearDamping, LinearStiffness, Multisine, Plant, SteppedSine, write_campaign

RATE = 500.0
TIME = np.arange(12000) / RATE


def demo_csv(folder: Path, heading: tuple[str, str, str] = ("t [ms]", "F [N]", "acc (m/s^2)")) -> list[Path]:
    """The records of the demo as another program writes them: semicolons, decimal commas, milliseconds."""
    files = []
    for source in sorted(campaign_folder().glob("*.npz")):
        with np.load(source) as held:
            time = 1e3 * np.arange(held["force"].size) / RATE
            frame = pd.DataFrame(dict(zip(heading, (time, held["force"], held["acceleration"]), strict=True)))
        files.append(folder / f"{source.stem}.csv")
        frame.to_csv(files[-1], sep=";", decimal=",", index=False)
    return files


def test_the_draft_of_the_demo_is_the_campaign_of_the_demo(tmp_path: Path) -> None:
    files = [inspect_file(file) for file in demo_csv(tmp_path)]
    (tmp_path / "campaign.toml").write_text(draft_campaign(files, tmp_path), encoding="utf-8")
    drafted, demo = read_campaign(tmp_path), read_campaign(campaign_folder())
    assert (drafted.input.quantity, drafted.output.quantity) == ("force", "acceleration")
    assert (drafted.rate, drafted.input.unit, drafted.output.unit) == (demo.rate, "N", "m/s^2")
    assert drafted.mass == pytest.approx(demo.mass, rel=0.25)
    truth = {record.name: record for record in demo.records}
    for record in drafted.records:
        own = truth[record.name]
        assert (record.kind, record.level, record.direction, record.role) == (
            own.kind, own.level, own.direction, own.role,
        )  # fmt: skip
        found = [dwell.frequency for dwell in record.dwells]
        np.testing.assert_allclose(found, [dwell.frequency for dwell in own.dwells], rtol=2e-3)
        np.testing.assert_allclose(record.output, own.output, atol=1e-6)


def test_a_draft_marks_what_it_guessed_and_no_more(tmp_path: Path) -> None:
    files = [inspect_file(file) for file in demo_csv(tmp_path)]
    lines = draft_campaign(files, tmp_path).splitlines()
    field = {line.split(" = ")[0]: line for line in lines if " = " in line}
    for guessed in ("mass", "stiffness", "level", "direction", "role"):
        assert "# guessed: " in field[guessed]
    for stated in ("column", "unit", "time", "file"):
        assert "#" not in field[stated]
    bare = demo_csv(tmp_path, ("t", "force", "acceleration"))
    text = draft_campaign([inspect_file(file) for file in bare], tmp_path)
    assert text.count("# guessed: the file states none") == 2
    assert text.count("# guessed: the name") == 2


def test_schedules_in_a_folder_belong_to_their_records(tmp_path: Path) -> None:
    files, schedules = find_data_files([campaign_folder()])
    assert len(files) == len(schedules) == 6
    assert all(schedule.name == f"{file.stem}_schedule.csv" for file, schedule in schedules.items())
    draft = draft_campaign([inspect_file(file, RATE) for file in files], tmp_path, schedules)
    (tmp_path / "campaign.toml").write_text(draft, encoding="utf-8")
    assert all(len(record.dwells) == 9 for record in read_campaign(tmp_path).records)


@pytest.mark.parametrize("rate", [500.0, 750.0])
def test_the_period_of_a_multisine_is_found_in_its_noise(rate: float, tmp_path: Path) -> None:
    plant = Plant((LinearStiffness(4e4), LinearDamping(300.0)), mass=40.0)
    write_campaign(
        tmp_path,
        plant,
        Multisine((20.0,), 2.0, 40.0, period=4.0),
        5,
        "multisine",
        Bench(rate=rate, noise=0.05),
    )
    declared = read_campaign(tmp_path)
    found = inspect_file(declared.records[0].file, rate)
    assert (found.kind, found.period) == ("periodic", declared.records[0].period)


def test_noise_and_a_sweep_have_no_period() -> None:
    random = np.random.default_rng(1)
    assert find_period(random.normal(size=8000)) is None
    assert find_period(scipy.signal.chirp(TIME, 2.0, TIME[-1], 20.0)) is None
    assert find_period(np.tile(random.normal(size=777), 4)[:2500]) == 777
    assert find_period(np.zeros(500)) is None


def run(force: np.ndarray, acceleration: np.ndarray) -> dict[str, np.ndarray]:
    return {"t [s]": TIME, "F [N]": force, "a [g]": acceleration}


def test_each_kind_of_excitation_is_named() -> None:
    random = np.random.default_rng(2)
    noise = random.normal(size=TIME.size)
    up = scipy.signal.chirp(TIME, 2.0, TIME[-1], 30.0)
    swept = inspect_file("sweep", data=run(up, 0.1 * up + 0.001 * noise))
    assert (swept.kind, swept.direction) == ("swept", "forward")
    assert inspect_file("back", data=run(up[::-1], 0.1 * up[::-1] + 0.001 * noise)).direction == "backward"
    assert inspect_file("random", data=run(noise, 0.1 * noise)).kind == "broadband"
    decay = np.exp(-TIME) * np.cos(2 * np.pi * 6.0 * TIME)
    assert inspect_file("release", data=run(1e-3 * noise, decay)).kind == "free_decay"


def test_the_state_of_a_channel_is_measured() -> None:
    noise = np.random.default_rng(3).normal(size=TIME.size)
    sine = np.sin(2 * np.pi * 7.3 * TIME)
    channel = inspect_file("run", data=run(sine, np.clip(sine, -2.0, 0.8) + 0.0)).channel("a [g]")
    assert channel.clipped == pytest.approx(np.arccos(0.8) / np.pi, rel=0.02)
    channel = inspect_file("run", data=run(sine, sine + 0.01 * noise + 0.1 * TIME / TIME[-1])).channel(
        "a [g]"
    )
    assert channel.noise == pytest.approx(0.01, rel=0.1)
    assert channel.drift * channel.rms == pytest.approx(0.075, rel=0.02)
    assert (channel.clipped, channel.missing, channel.spikes) == (0.0, 0, 0)
    spoilt = sine.copy()
    spoilt[[500, 900]] += 3.0
    spoilt[100] = np.nan
    channel = inspect_file("run", data=run(sine, spoilt)).channel("a [g]")
    assert (channel.missing, channel.spikes) == (1, 2)


@pytest.mark.parametrize("step", [1e-3, 1e-2, 5e-2])
def test_the_steps_of_a_converter_are_no_clipping(step: float) -> None:
    sine = np.sin(2 * np.pi * 7.3 * TIME)
    assert clipped_share(np.round(sine / step) * step) == 0.0
    assert clipped_share(np.round(np.clip(sine, -0.7, 0.7) / step) * step) > 0.4


def test_a_gap_in_the_time_is_said_and_the_time_left_out_of_the_draft(tmp_path: Path) -> None:
    random = np.random.default_rng(4)
    held = run(random.normal(size=TIME.size), random.normal(size=TIME.size))
    frame = pd.DataFrame(held).drop(index=[700, 701])
    frame.to_csv(tmp_path / "run.csv", index=False)
    found = inspect_file(tmp_path / "run.csv")
    assert found.rate == pytest.approx(RATE)
    assert "has a gap at row 701" in found.time_fault
    (tmp_path / "campaign.toml").write_text(draft_campaign([found], tmp_path), encoding="utf-8")
    assert read_campaign(tmp_path).rate == pytest.approx(RATE)


@pytest.mark.parametrize(
    ("name", "unit", "quantity"),
    [
        ("anything", "kN", "force"),
        ("anything", "mm", "displacement"),
        ("Acc_table_X", None, "acceleration"),
        ("load cell", "V", "force"),
        ("U", "mV", "command"),
        ("V1", None, "command"),
        ("v", None, "velocity"),
        ("ch1", None, None),
        ("Beschleunigung", None, "acceleration"),
    ],
)
def test_what_a_channel_measures_comes_from_unit_and_name(
    name: str, unit: str | None, quantity: str | None
) -> None:
    assert guess_quantity(name, unit) == quantity


def test_a_mass_on_a_spring_is_weighed_by_its_inertia() -> None:
    random = np.random.default_rng(6)
    force = np.convolve(random.normal(size=60000), np.ones(5) / 5, mode="same")
    mass, damping, stiffness = 12.0, 60.0, 12.0 * (2 * np.pi * 10.0) ** 2
    system = scipy.signal.cont2discrete(([1.0, 0.0, 0.0], [mass, damping, stiffness]), 1 / RATE, "foh")
    answer = scipy.signal.lfilter(np.ravel(system[0]), system[1], force)
    assert guess_mass(force, answer, RATE, "acceleration") == pytest.approx(mass, rel=0.05)


def test_levels_come_from_the_drive_where_no_name_has_them() -> None:
    sine = np.sin(2 * np.pi * 5.0 * TIME)
    files = [
        inspect_file(name, data=run(size * sine, 0.1 * size * sine))
        for name, size in (("a", 10.0), ("b", 20.0), ("c", 20.3), ("d", 40.0), ("e", 9.9))
    ]
    places = arrange(files)
    assert [place.role for place in places] == ["fit", "holdout", "holdout", "fit", "fit"]
    assert places[1].level == places[2].level
    assert places[0].level == places[4].level


def test_files_that_differ_in_channels_or_lack_a_rate_are_no_campaign(tmp_path: Path) -> None:
    sine = np.sin(2 * np.pi * 5.0 * TIME)
    first = inspect_file("first", data=run(sine, sine))
    other = inspect_file("other", data={"t [s]": TIME, "force [N]": sine, "a [g]": sine})
    with pytest.raises(ValueError, match=r"other seems to have the drive `force \[N\]`.*but first `F \[N\]`"):
        draft_campaign([first, other], tmp_path)
    with pytest.raises(ValueError, match=r"does not state its sampling rate.*--rate"):
        draft_campaign([inspect_file("bare", data={"F [N]": sine, "a [g]": sine})], tmp_path)


def test_a_given_rate_must_be_that_of_the_file() -> None:
    held = run(np.sin(TIME), np.cos(TIME))
    assert inspect_file("run", RATE, data=held).rate_from == "given, and time column `t [s]`"
    with pytest.raises(ValueError, match=r"run: the given rate is 400 Hz, but 500 Hz by .*time column"):
        inspect_file("run", 400.0, data=held)


def test_the_steps_and_sweeps_of_simulated_campaigns_are_seen(tmp_path: Path) -> None:
    plant = Plant((LinearStiffness(4e4), LinearDamping(300.0)), mass=40.0)
    plan = SteppedSine((20.0,), (3.0, 4.0, 5.0), cycles=12, holdout_levels=())
    write_campaign(tmp_path, plant, plan, 7, "steps", Bench(rate=400.0, noise=0.01), file_format="csv")
    declared = read_campaign(tmp_path)
    for record in declared.records:
        found = inspect_file(record.file, 400.0)
        assert (found.kind, found.direction) == ("stepped_sine", record.direction)
        assert len(found.dwells) == len(record.dwells) == 3


@pytest.mark.parametrize("shape", ["tall", "wide"])
def test_the_time_of_a_nameless_array_is_the_column_that_increases_evenly(tmp_path: Path, shape: str) -> None:
    force = np.sin(2 * np.pi * 5.0 * TIME)
    table = np.stack([force, 0.1 * force, np.round(TIME, 3)], axis=1)
    np.savez(tmp_path / "run.npz", data=table if shape == "tall" else table.T)
    found = inspect_file(tmp_path / "run.npz")
    names = [f"data[:, {i}]" if shape == "tall" else f"data[{i}, :]" for i in range(3)]
    assert (found.drive, found.response, found.time, found.rate) == (*names, RATE)
    draft = draft_campaign([found], tmp_path)
    assert f'time = "{names[2]}"      # guessed: it increases evenly' in draft
    (tmp_path / "campaign.toml").write_text(draft, encoding="utf-8")
    assert read_campaign(tmp_path).rate == RATE
    np.savez(tmp_path / "run.npz", data=table[:, :2])
    assert inspect_file(tmp_path / "run.npz").time is None
