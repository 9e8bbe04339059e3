"""Every fault of a data file gives one ValueError that names the file, the column, the row and the fault."""

from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
import scipy.io

from isojax import read_campaign

Channels = dict[str, np.ndarray]
Tiny = Callable[..., Path]
WITH_TIME = ("rate = 200.0", 'time = "time"')


@pytest.mark.parametrize("column", ["force", "acceleration"])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_sample_that_is_not_finite_is_named_by_row(
    column: str, value: float, tiny: Tiny, channels: Channels
) -> None:
    channels[column][17] = value
    with pytest.raises(ValueError, match=rf"run\.csv: column `{column}` is {value} at row 18 \(index 17\)"):
        read_campaign(tiny(channels=channels))


def test_a_bad_sample_outside_the_record_does_not_matter(tiny: Tiny, channels: Channels) -> None:
    channels["force"][17] = np.nan
    campaign = read_campaign(tiny(('role = "fit"', 'role = "fit"\nstart = 18'), channels=channels))
    assert campaign.records[0].input.size == 1982


def test_text_in_a_number_column_is_named_with_its_row(tiny: Tiny) -> None:
    folder = tiny()
    lines = (folder / "run.csv").read_text().splitlines()
    lines[18] = "0.085,overload,0.1"
    (folder / "run.csv").write_text("\n".join(lines))
    with pytest.raises(ValueError, match=r"column `force` holds the text 'overload' at row 18 \(index 17\)"):
        read_campaign(folder)


@pytest.mark.parametrize(
    ("row", "value", "message"),
    [
        (40, 0.1995, r"runs backwards at row 42 \(index 41\)|runs backwards at row 41 \(index 40\)"),
        (40, 0.195, r"time column `time` repeats at row 41 \(index 40\): 0.195 s follows 0.195 s"),
        (40, -1.0, r"runs backwards at row 41 \(index 40\)"),
        (40, np.nan, r"time column `time` is nan at row 41 \(index 40\)"),
    ],
)
def test_time_must_increase(row: int, value: float, message: str, tiny: Tiny, channels: Channels) -> None:
    channels["time"][row] = value
    if value == 0.1995:
        channels["time"][row + 1] = 0.199
    with pytest.raises(ValueError, match=message):
        read_campaign(tiny(WITH_TIME, channels=channels))


def test_a_gap_in_the_time_column_is_named_by_row(tiny: Tiny, channels: Channels) -> None:
    gapped = {name: np.delete(samples, slice(100, 102)) for name, samples in channels.items()}
    with pytest.raises(ValueError, match=r"has a gap at row 101 \(index 100\): 0.51 s follows 0.495 s"):
        read_campaign(tiny(WITH_TIME, channels=gapped))


def test_a_clock_that_changes_its_rate_is_refused(tiny: Tiny, channels: Channels) -> None:
    channels["time"][1000:] += 0.2 * (channels["time"][1000:] - channels["time"][999])
    with pytest.raises(ValueError, match="is not uniform"):
        read_campaign(tiny(WITH_TIME, channels=channels))


def test_a_rate_that_contradicts_the_time_column_is_refused(tiny: Tiny) -> None:
    with pytest.raises(
        ValueError, match=r"\[sampling\] rate says 100 Hz, but time column `time` says 200 Hz"
    ):
        read_campaign(tiny(("rate = 200.0", 'rate = 100.0\ntime = "time"')))


def test_a_time_column_written_with_few_digits_is_accepted(tiny: Tiny, channels: Channels) -> None:
    channels["time"] = np.round(np.arange(2000) / 610.3515625, 3)
    assert read_campaign(tiny(WITH_TIME, channels=channels)).rate == pytest.approx(610.3515625, rel=1e-3)


@pytest.mark.parametrize(("column", "value"), [("force", 3.0), ("acceleration", 3.0), ("acceleration", 0.0)])
def test_a_constant_channel_is_refused(column: str, value: float, tiny: Tiny, channels: Channels) -> None:
    channels[column][:] = value
    with pytest.raises(ValueError, match=rf"column `{column}` is constant \({value:g} in SI throughout\)"):
        read_campaign(tiny(channels=channels))


def test_no_force_at_all_is_refused_unless_the_output_decays(tiny: Tiny, channels: Channels) -> None:
    channels["force"][:] = 0.0
    with pytest.raises(ValueError, match="column `force` is 0 throughout, and the output does not decay"):
        read_campaign(tiny(channels=channels))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", r"run\.csv is empty"),
        ("\n\n", r"run\.csv is empty"),
        ("force,acceleration\n", r"has a heading but no rows"),
        (
            "force,acceleration\n1,2\n3,4,5\n",
            r"run\.csv is no table of 2 columns: row 2 .*, line 3 of the file, has 3 .*cause: a decimal",
        ),
        ("force,acceleration\ntrue,2\nfalse,3\n", r"column `force` holds the text 'true' at row 1"),
        ("force,force,acceleration\n1,2,3\n", r"2 channels are called `force`; rename them"),
        ("force,acceleration\n1,2\n", r"column `force` has the shape \(1,\)"),
    ],
)
def test_a_csv_without_a_table_is_refused(content: str, message: str, tiny: Tiny) -> None:
    folder = tiny()
    (folder / "run.csv").write_text(content)
    with pytest.raises(ValueError, match=message):
        read_campaign(folder)


@pytest.mark.parametrize("ending", [".npz", ".mat", ".h5", ".hdf5", ".uff", ".unv", ".tdms"])
@pytest.mark.parametrize("content", [b"", b"no such thing\n" * 40])
def test_a_broken_file_is_refused(ending: str, content: bytes, tiny: Tiny) -> None:
    folder = tiny(("run.csv", f"run{ending}"))
    (folder / f"run{ending}").write_bytes(content)
    with pytest.raises(ValueError, match=rf"run{ending}.*(empty|cannot be read|holds no dataset)"):
        read_campaign(folder)


def _write_npz(file: Path, held: dict) -> None:
    np.savez(file, **held)


def _write_mat(file: Path, held: dict) -> None:
    scipy.io.savemat(file, held)


def _write_h5(file: Path, held: dict) -> None:
    with h5py.File(file, "w") as handle:
        for name, values in held.items():
            handle[name] = values


WRITERS = {".npz": _write_npz, ".mat": _write_mat, ".h5": _write_h5}


@pytest.mark.parametrize("ending", WRITERS)
@pytest.mark.parametrize(
    ("spoilt", "message"),
    [
        (np.ones((1000, 2)), r"column `force` has the shape \(1000, 2\)"),
        (
            np.ones(7),
            r"(`force` has 7 samples, but `acceleration`|`acceleration` has 2000 samples, but `force`) has",
        ),
        (np.ones(2000) * 1j, r"column `force` holds complex numbers"),
        (3.0, r"column `force` has the shape .*; expected one row or column"),
        (None, r"has no column `force`; it has .*`acceleration`"),
    ],
)
def test_an_array_of_the_wrong_shape_is_refused(
    ending: str, spoilt: object, message: str, tiny: Tiny, channels: Channels
) -> None:
    held = {name: samples for name, samples in channels.items() if name != "force"}
    if spoilt is not None:
        held["force"] = np.asarray(spoilt)
    folder = tiny(("run.csv", f"run{ending}"))
    WRITERS[ending](folder / f"run{ending}", held)
    with pytest.raises(ValueError, match=message):
        read_campaign(folder)


@pytest.mark.parametrize(
    ("value", "message"),
    [("text", "holds text"), ({"a": np.ones(5)}, "holds (a structure|objects)")],
)
def test_a_mat_variable_that_is_no_array_is_refused(
    value: object, message: str, tiny: Tiny, channels: Channels
) -> None:
    folder = tiny(("run.csv", "run.mat"))
    scipy.io.savemat(folder / "run.mat", {**channels, "force": value})
    with pytest.raises(ValueError, match=rf"run\.mat: column `force` {message}"):
        read_campaign(folder)


@pytest.mark.parametrize("matlab", ["char", "cell"])
def test_a_mat_73_variable_that_is_no_array_is_refused(matlab: str, tiny: Tiny, channels: Channels) -> None:
    folder = tiny(("run.csv", "run.mat"))
    with h5py.File(folder / "run.mat", "w", userblock_size=512) as handle:
        handle["force"] = np.arange(5, dtype=np.uint16)
        handle["force"].attrs["MATLAB_class"] = np.bytes_(matlab)
        handle["acceleration"] = channels["acceleration"]
    with pytest.raises(ValueError, match=rf"`force` is a MATLAB {matlab}; expected"):
        read_campaign(folder)


def test_a_mat_73_struct_is_refused_with_its_fields(tiny: Tiny, channels: Channels) -> None:
    folder = tiny(("run.csv", "run.mat"))
    with h5py.File(folder / "run.mat", "w", userblock_size=512) as handle:
        handle["force/value"] = channels["force"]
        handle["acceleration"] = channels["acceleration"]
    with pytest.raises(ValueError, match=r"`force` holds a structure; name one of .*`force/value`"):
        read_campaign(folder)


def test_objects_in_an_archive_are_refused(tiny: Tiny, channels: Channels) -> None:
    folder = tiny(("run.csv", "run.npz"))
    np.savez(folder / "run.npz", **{**channels, "force": np.array([{}], dtype=object)})
    with pytest.raises(ValueError, match=r"run\.npz: array `force` cannot be read as numbers"):
        read_campaign(folder)


SCHEDULES = {
    "wrong headings": (
        "start,frequency_hz,cycles\n0,5,20\n",
        r"`start_s` is not among .*did you mean `start`",
    ),
    "backwards": (
        "start_s,frequency_hz,cycles\n4,5,5\n0,6,5\n",
        r"increase strictly, but 0 at row 2 .* follows 4",
    ),
    "past the end": (
        "start_s,frequency_hz,cycles\n0,5,20\n4,5,60\n",
        r"row 2 .* past the end of the record at 10 s",
    ),
    "starts past the end": ("start_s,frequency_hz,cycles\n0,5,20\n11,5,1\n", r"row 2 .* past the end"),
    "overlapping": (
        "start_s,frequency_hz,cycles\n0,5,20\n2,6,5\n",
        r"row 1 .* lasts until 4 s, but the next starts",
    ),
    "no frequency": ("start_s,frequency_hz,cycles\n0,0,20\n", r"frequency_hz = 0 at row 1 .* above 0"),
    "too fast": (
        "start_s,frequency_hz,cycles\n0,100,20\n",
        r"frequency_hz = 100 .* half the sampling rate, 100 Hz",
    ),
    "negative start": ("start_s,frequency_hz,cycles\n-1,5,20\n", r"start_s = -1 at row 1"),
    "text": ("start_s,frequency_hz,cycles\n0,five,20\n", r"`frequency_hz` holds the text 'five' at row 1"),
    "empty": ("", r"schedule\.csv is empty"),
    "another record's": (
        "start_s,frequency_hz,cycles\n0,5,20\n",
        r"does not fit its record: a sine of 5 Hz explains",
    ),
}


@pytest.mark.parametrize("fault", SCHEDULES)
def test_a_faulty_schedule_is_refused(fault: str, tiny: Tiny) -> None:
    content, message = SCHEDULES[fault]
    folder = tiny(('role = "fit"', 'role = "fit"\nschedule = "schedule.csv"'))
    (folder / "schedule.csv").write_text(content)
    with pytest.raises(ValueError, match=message) as caught:
        read_campaign(folder)
    assert "schedule.csv" in str(caught.value)


def test_records_at_different_rates_are_refused(tiny: Tiny, channels: Channels) -> None:
    more = 'role = "fit"\n[[record]]\nfile = "slow.npz"\nrole = "fit"\n'
    folder = tiny(WITH_TIME, ('role = "fit"', more))
    np.savez(folder / "slow.npz", **{**channels, "time": 2.0 * channels["time"]})
    with pytest.raises(ValueError, match=r"slow\.npz is sampled at 100 Hz, but .*run\.csv at 200 Hz"):
        read_campaign(folder)
