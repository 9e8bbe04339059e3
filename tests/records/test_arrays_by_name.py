"""Structs, matrices, sheets, tables and data in memory: every format gives the arrays that were written."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pandas as pd
import pytest
import scipy.io
import xarray

from isojax import read_campaign
from isojax.records import inspect_file
from isojax.records.formats import (
    columns_of,
    read_hdf5_columns,
    read_lvm_columns,
    read_mat_columns,
    read_npz_columns,
    read_parquet_columns,
    read_sheet_columns,
)

RANDOM = np.random.default_rng(3)
TALL = RANDOM.normal(size=(40, 3))
FORCE, ACCELERATION = RANDOM.normal(size=40), RANDOM.normal(size=40)
Tiny = Callable[..., Path]


def matlab_73(file: Path, arrays: dict[str, np.ndarray]) -> None:
    """Arrays, and fields of structs, as MATLAB writes them: transposed, with the class of each."""
    with h5py.File(file, "w", userblock_size=512) as handle:
        for path, array in arrays.items():
            node = handle.create_dataset(path, data=np.atleast_2d(array).T)
            node.attrs["MATLAB_class"] = np.bytes_("double")
            if node.parent.name != "/":
                node.parent.attrs["MATLAB_class"] = np.bytes_("struct")


@pytest.mark.parametrize("version", ["5", "7.3"])
@pytest.mark.parametrize("name", ["run.force", "run/force"])
def test_a_field_of_a_struct_is_named_by_its_path(version: str, name: str, tmp_path: Path) -> None:
    file = tmp_path / "run.mat"
    if version == "5":
        scipy.io.savemat(file, {"run": {"force": FORCE, "deep": {"acc": ACCELERATION}}, "data": TALL})
    else:
        matlab_73(file, {"run/force": FORCE, "run/deep/acc": ACCELERATION, "data": TALL})
    columns = read_mat_columns(file, [name, "run.deep.acc", "data[:, 2]", "data[:,0]"])
    np.testing.assert_array_equal(columns[name].samples, FORCE)
    np.testing.assert_array_equal(columns["run.deep.acc"].samples, ACCELERATION)
    np.testing.assert_array_equal(columns["data[:, 2]"].samples, TALL[:, 2])
    np.testing.assert_array_equal(columns["data[:,0]"].samples, TALL[:, 0])
    assert set(read_mat_columns(file, None)) == {
        "run.force", "run.deep.acc", "data[:, 0]", "data[:, 1]", "data[:, 2]",
    }  # fmt: skip


def test_structs_of_an_array_are_counted_from_zero(tmp_path: Path) -> None:
    file = tmp_path / "run.mat"
    kind = [("f", object), ("name", object)]
    runs = np.array([(FORCE, "up"), (ACCELERATION, "down")], dtype=kind)
    scipy.io.savemat(file, {"runs": runs})
    np.testing.assert_array_equal(read_mat_columns(file, ["runs[1].f"])["runs[1].f"].samples, ACCELERATION)
    with h5py.File(tmp_path / "new.mat", "w") as handle:
        hidden = [
            handle.create_dataset(f"#refs#/{i}", data=one[None]) for i, one in enumerate((FORCE, FORCE + 1))
        ]
        handle["runs/f"] = np.array([one.ref for one in hidden], dtype=h5py.ref_dtype)[:, None]
        handle["runs"].attrs["MATLAB_class"] = np.bytes_("struct")
    found = read_mat_columns(tmp_path / "new.mat", ["runs[1].f"])["runs[1].f"]
    np.testing.assert_array_equal(found.samples, FORCE + 1)


def test_matrices_of_archives_and_hdf5_are_indexed_alike(tmp_path: Path) -> None:
    np.savez(tmp_path / "run.npz", data=TALL, flat=TALL.T, cube=TALL.reshape(40, 3, 1))
    with h5py.File(tmp_path / "run.h5", "w") as handle:
        handle["bench/data"] = TALL
        handle["bench/flat"] = TALL.T
        handle["bench/data"].attrs["units"] = "mm"
    archive = read_npz_columns(tmp_path / "run.npz", ["data[:, 1]", "flat[2, :]", "cube[:, 1, 0]"])
    np.testing.assert_array_equal(archive["data[:, 1]"].samples, TALL[:, 1])
    np.testing.assert_array_equal(archive["flat[2, :]"].samples, TALL[:, 2])
    np.testing.assert_array_equal(archive["cube[:, 1, 0]"].samples, TALL[:, 1])
    held = read_hdf5_columns(tmp_path / "run.h5", ["/bench/data[:, 1]", "bench/flat[2, :]"])
    np.testing.assert_array_equal(held["/bench/data[:, 1]"].samples, TALL[:, 1])
    np.testing.assert_array_equal(held["bench/flat[2, :]"].samples, TALL[:, 2])
    assert held["/bench/data[:, 1]"].unit == "mm"


@pytest.mark.parametrize(
    ("name", "message"),
    [
        (
            "data",
            r"has the shape \(40, 3\).*one of them is named `data\[:, 0\]` to `data\[:, 2\]`, counted from 0",
        ),
        ("data[:, 3]", r"`data` has the shape \(40, 3\), so there is no `data\[:, 3\]`; places count from 0"),
        ("data[1]", r"has no column `data\[1\]`; it has `data`"),
    ],
)
def test_a_wrong_index_is_refused_with_the_right_one(name: str, message: str, tmp_path: Path) -> None:
    np.savez(tmp_path / "run.npz", data=TALL)
    with pytest.raises(ValueError, match=message):
        read_npz_columns(tmp_path / "run.npz", [name])


FRAME = pd.DataFrame(
    {"time [s]": np.arange(40) / 8.0, "force [kN]": FORCE, "a (g)": ACCELERATION, "note": "x"}
)


def test_a_sheet_gives_what_pandas_wrote(tmp_path: Path) -> None:
    file = tmp_path / "run.xlsx"
    with pd.ExcelWriter(file, engine="openpyxl") as book:
        pd.DataFrame({"about": ["bench", "2026"]}).to_excel(book, sheet_name="Info", index=False)
        FRAME.to_excel(book, sheet_name="Data", index=False, startrow=3)
    columns = read_sheet_columns(file, ["force", "Data/a (g)", "time"])
    # openpyxl writes 16 digits.
    np.testing.assert_allclose(columns["force"].samples, FORCE, rtol=1e-15)
    np.testing.assert_allclose(columns["Data/a (g)"].samples, ACCELERATION, rtol=1e-15)
    assert [one.unit for one in columns.values()] == ["kN", "g", "s"]
    with pytest.raises(
        ValueError, match=r"`note` holds the text 'x' at row 1 \(index 0\), row 5 of the sheet `Data`"
    ):
        read_sheet_columns(file, ["note"])


def test_a_parquet_file_gives_what_pandas_wrote(tmp_path: Path) -> None:
    FRAME.to_parquet(tmp_path / "run.parquet")
    columns = read_parquet_columns(tmp_path / "run.parquet", ["force", "a (g)"])
    np.testing.assert_array_equal(columns["force"].samples, FORCE)
    assert columns["a (g)"].unit == "g"


LVM = (
    "LabVIEW Measurement\t\nWriter_Version\t2\nSeparator\tTab\nDecimal_Separator\t,\nX_Columns\tOne\n"
    "***End_of_Header***\t\n\t\n"
)


def lvm_segment(start: float, rows: np.ndarray, rate: float = 8.0) -> str:
    head = f"Channels\t2\t\nSamples\t{len(rows)}\t{len(rows)}\nY_Unit_Label\tkN\tg\n"
    head += f"X0\t{start}\t{start}\nDelta_X\t{1 / rate}\t{1 / rate}\n".replace(".", ",")
    head += "***End_of_Header***\t\t\nX_Value\tforce\tacc\tComment\n"
    times = start + np.arange(len(rows)) / rate
    lines = [
        "\t".join(repr(float(one)) for one in (time, *row)) for time, row in zip(times, rows, strict=True)
    ]
    return head + "\n".join(lines).replace(".", ",") + "\n"


def test_segments_of_a_labview_file_follow_each_other(tmp_path: Path) -> None:
    rows = np.stack([FORCE, ACCELERATION], axis=1)
    file = tmp_path / "run.lvm"
    file.write_text(LVM + lvm_segment(0.0, rows[:30]) + "\n" + lvm_segment(3.75, rows[30:]))
    columns = read_lvm_columns(file, ["force", "acc", "X_Value"])
    np.testing.assert_array_equal(columns["force"].samples, FORCE)
    np.testing.assert_array_equal(columns["acc"].samples, ACCELERATION)
    assert (columns["force"].rate, columns["force"].unit, columns["acc"].unit) == (8.0, "kN", "g")
    file.write_text(LVM + lvm_segment(0.0, rows[:30]) + "\n" + lvm_segment(5.0, rows[30:]))
    with pytest.raises(ValueError, match=r"segment 2 starts 10 samples after the end of segment 1"):
        read_lvm_columns(file, ["force"])


def sep005() -> list[dict[str, Any]]:
    return [
        {"name": "force", "data": FORCE, "fs": 8.0, "unit_str": "kN"},
        {"name": "acc", "data": ACCELERATION, "time": np.arange(40) / 8.0, "unit_str": "g"},
    ]


def labelled() -> xarray.Dataset:
    dataset = xarray.Dataset(
        {"force": ("time", FORCE), "acc": ("time", ACCELERATION)}, {"time": np.arange(40) / 8.0}
    )
    dataset["force"].attrs["units"], dataset["acc"].attrs["units"] = "kN", "g"
    return dataset


MEMORY = {
    "mapping": {"force [kN]": FORCE, "acc (g)": ACCELERATION.tolist()},
    "nested": {"run": {"force [kN]": FORCE}, "acc [g]": ACCELERATION},
    "frame": pd.DataFrame({"force [kN]": FORCE, "acc [g]": ACCELERATION}),
    "sep005": sep005(),
    "xarray": labelled(),
    "structured": np.array(
        list(zip(FORCE, ACCELERATION, strict=True)), dtype=[("force [kN]", float), ("acc [g]", float)]
    ),
}


@pytest.mark.parametrize("kind", MEMORY)
def test_data_in_memory_give_the_same_columns(kind: str) -> None:
    force = "run.force [kN]" if kind == "nested" else "force"
    columns = columns_of(MEMORY[kind], Path("run"), [force, "acc"])
    np.testing.assert_array_equal(columns[force].samples, FORCE)
    np.testing.assert_array_equal(columns["acc"].samples, ACCELERATION)
    assert [one.unit for one in columns.values()] == ["kN", "g"]
    assert columns["acc"].rate == (8.0 if kind == "sep005" else None)


def test_a_time_index_is_a_column_in_seconds() -> None:
    index = pd.Timestamp("2026-01-01") + pd.to_timedelta(np.arange(40) * 125, unit="ms")
    frame = pd.DataFrame({"force": FORCE}, index=pd.DatetimeIndex(index, name="clock"))
    columns = columns_of(frame, Path("run"), ["clock", "force"])
    np.testing.assert_allclose(columns["clock"].samples, np.arange(40) / 8.0, atol=1e-12)
    assert columns["clock"].unit == "s"


def test_a_plain_array_is_named_by_place() -> None:
    np.testing.assert_array_equal(columns_of(TALL, Path("run"), ["[:, 2]"])["[:, 2]"].samples, TALL[:, 2])


@pytest.mark.parametrize("data", [3.0, "run.csv", [], [{"name": "force"}], object()])
def test_other_data_are_refused(data: Any) -> None:
    with pytest.raises(ValueError, match=r"run: (data of the type|channel 1 lacks the field `data`)"):
        columns_of(data, Path("run"), ["force"])


DECLARED: dict[str, Any] = {
    "campaign": {"mass": np.float64(2.0), "title": None},
    "input": {"quantity": "force", "column": "force"},
    "output": {"quantity": "acceleration", "column": "acceleration", "unit": "g"},
    "sampling": {"rate": 200.0},
    "record": [{"file": "one", "role": "fit", "stop": np.int64(900)}, {"file": "two", "role": "holdout"}],
}


def test_a_campaign_in_memory_is_that_of_the_files(tiny: Tiny, channels: dict[str, np.ndarray]) -> None:
    named = {"force [N]": channels["force"], "acceleration": channels["acceleration"]}
    data = {"one": named, "two": pd.DataFrame(named).iloc[::-1].reset_index(drop=True)}
    held = read_campaign(DECLARED, data=data)
    folder = tiny((r'unit = "m/s\^2"', 'unit = "g"'), ('role = "fit"', 'role = "fit"\nstop = 900'))
    pd.DataFrame(channels).to_csv(folder / "run.csv", index=False)
    filed = read_campaign(folder)
    np.testing.assert_array_equal(held.records[0].output, filed.records[0].output)
    np.testing.assert_array_equal(held.records[0].input, filed.records[0].input)
    assert (held.input.unit, held.records[0].kind, held.mass) == ("N", filed.records[0].kind, 2.0)
    assert [record.name for record in held.records] == ["one", "two"]


@pytest.mark.parametrize(
    ("section", "change", "message"),
    [
        (
            "campaign",
            {"mass": -2.0},
            r"declaration: \[campaign\] mass = -2.0 must be a finite number above 0",
        ),
        (
            "input",
            {"colum": "f"},
            r"declaration: \[input\] has an unknown field `colum`; did you mean `column`",
        ),
        ("output", {"unit": "N"}, r'declaration: \[output\] unit = "N" .*does not measure an acceleration'),
        ("output", {"column": "acc"}, r"one has no column `acc`; it has `force \[N\]`, `acceleration`"),
    ],
)
def test_a_mapping_is_checked_as_a_file_is(section: str, change: dict, message: str) -> None:
    data = {"force [N]": FORCE, "acceleration": ACCELERATION}
    declared = {
        **DECLARED,
        section: {**DECLARED[section], **change},
        "record": [{"file": "one", "role": "fit"}],
    }
    with pytest.raises(ValueError, match=message):
        read_campaign(declared, data={"one": data})


def test_a_record_that_the_data_lack_is_named() -> None:
    with pytest.raises(
        ValueError, match=r'number 2 has file = "two", but argument `data` has `one`, `tow` only'
    ):
        read_campaign(DECLARED, data={"one": {}, "tow": {}})


def test_one_record_under_two_names_is_refused(channels: dict[str, np.ndarray]) -> None:
    named = {"force [N]": channels["force"], "acceleration": channels["acceleration"]}
    with pytest.raises(
        ValueError, match=r"share samples 0:900 of two.*held-out samples must not be used to fit"
    ):
        read_campaign(DECLARED, data={"one": named, "two": pd.DataFrame(named)})


def test_measured_files_are_listed_whole(shared_data: Path) -> None:
    beam = read_mat_columns(shared_data / "brb" / "ForcedFrequencyResponses.mat", None)
    assert len([name for name in beam if name.startswith("FRdata")]) > 20
    fighter = inspect_file(shared_data / "f16" / "F16Data_FullMSine_Level1.mat", rate=400.0)
    assert (fighter.drive, fighter.response) == ("Force", "Acceleration[0, :]")
    assert (fighter.kind, fighter.period) == ("periodic", 8192)
    box = inspect_file(shared_data / "silverbox" / "SNLS80mV_multisine.mat", rate=610.3516)
    assert (box.drive, box.response) == ("V1", "V2")
