"""Bad declarations and bad files through the command line: each is refused in one line that helps.

A row is a name, the command, what spoils a campaign that is right, and what the message must say. Every one
ends with exit code 2 before anything is fitted or written, names the file, and shows no message of a library.
"""

import io
import re
import struct
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import h5py
import numpy as np
import openpyxl
import pandas as pd
import pyarrow
import pyarrow.parquet
import pytest
import scipy.io
from test_bad_campaign import MISTAKES
from test_bad_data import SCHEDULES

from isojax._cli import main

Spoil = Callable[[Path], None]
LIBRARIES = "Traceback|tokenizing|Errno|codec|NoneType|object at 0x|<class|numpy\\.|expected str"


class Case(NamedTuple):
    """What a user may have; `said` are regular expressions that the message must match."""

    command: str
    spoil: Spoil
    said: tuple[str, ...]


def campaign(spoil: Spoil, *said: str) -> Case:
    return Case("fit", spoil, said)


def file(name: str, spoil: Callable[[Path], None], *said: str) -> Case:
    """A data file on its own."""
    return Case(f"inspect {name}", lambda folder: spoil(folder / name), (re.escape(name), *said))


def text(content: str | bytes) -> Callable[[Path], None]:
    return lambda path: path.write_bytes(content if isinstance(content, bytes) else content.encode()) and None


def replace(pattern: str, new: str) -> Spoil:
    """Changes the declaration."""

    def change(folder: Path) -> None:
        path = folder / "campaign.toml"
        changed, count = re.subn(pattern, new, path.read_text(encoding="utf-8"), count=1, flags=re.M)
        assert count == 1, pattern
        path.write_text(changed, encoding="utf-8")

    return change


def cells(change: Callable[[pd.DataFrame], pd.DataFrame | None], **options: object) -> Spoil:
    """Changes the table of run.csv."""

    def rewrite(folder: Path) -> None:
        table = pd.read_csv(folder / "run.csv")
        changed = change(table)
        (table if changed is None else changed).to_csv(folder / "run.csv", index=False, **options)

    return rewrite


def at(row: int, column: str, value: object) -> Spoil:
    def change(table: pd.DataFrame) -> pd.DataFrame:
        return table.astype({column: object}).assign(
            **{column: lambda one: one[column].where(one.index != row, value)}
        )

    return cells(change)


def timed(change: Callable[[np.ndarray], np.ndarray]) -> Spoil:
    """Changes the time column, and declares it in place of the rate."""

    def both(folder: Path) -> None:
        cells(lambda table: table.assign(time=change(table["time"].to_numpy(copy=True))))(folder)
        replace("rate = 200.0", 'time = "time"')(folder)

    return both


def cut(writer: Callable[[Path], None], share: float = 0.6) -> Callable[[Path], None]:
    """Writes a file and cuts it short."""

    def write(path: Path) -> None:
        writer(path)
        raw = path.read_bytes()
        path.write_bytes(raw[: int(share * len(raw))])

    return write


def sheet(path: Path, *entries: tuple[str, object]) -> None:
    book = openpyxl.Workbook()
    page = book.worksheets[0]
    for place, value in (("A1", "acceleration"), ("B1", "F"), *entries):
        page[place] = value
    for i in range(30):
        page.cell(i + 2, 1, 0.01 * i)
        if i or not entries:
            page.cell(i + 2, 2, float(i % 7))
    book.save(path)


def parquet(path: Path, rows: int = 40, pages: int = 1) -> None:
    table = pyarrow.table({"F": np.zeros(rows), "a": np.zeros(rows)})
    with pyarrow.parquet.ParquetWriter(path, table.schema) as writer:
        for _ in range(pages):
            writer.write_table(table)


def header(shape: tuple[int, ...]) -> bytes:
    buffer = io.BytesIO()
    np.lib.format.write_array_header_1_0(buffer, {"descr": "<f8", "fortran_order": False, "shape": shape})
    return buffer.getvalue()


def archive_of_zeros(path: Path) -> None:
    """An archive that announces 8 GB."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("force.npy", header((10**9,)))
        archive.writestr("a.npy", header((16,)) + bytes(128))
    announced = struct.pack("<I", len(header((10**9,))))
    path.write_bytes(path.read_bytes().replace(announced, struct.pack("<I", 4_000_000_000)))


def array_of_nothing(path: Path) -> None:
    """An array that ends after its header."""
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("acceleration.npy", header((16,)) + bytes(128))
        archive.writestr("force.npy", header((10**7,)))


def many_cells(path: Path) -> None:
    cells = np.empty(20000, object)
    cells[:] = [np.ones(1)] * 20000
    scipy.io.savemat(path, {"c": cells, "F": np.arange(50.0)}, do_compression=True)


def element(kind: int, content: bytes) -> bytes:
    return struct.pack("<II", kind, len(content)) + content + bytes(-len(content) % 8)


def mat(path: Path, *elements: bytes) -> None:
    head = b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack("<H", 0x0100) + b"IM"
    path.write_bytes(head + b"".join(elements))


def array_element(rows: int, announced: int) -> bytes:
    flags, name = element(6, struct.pack("<II", 6, 0)), element(1, b"force")
    shape = element(5, struct.pack("<ii", rows, 1))
    body = flags + shape + name + struct.pack("<II", 9, announced) + bytes(64)
    return struct.pack("<II", 14, max(announced, len(body))) + body


def packed(content: bytes) -> bytes:
    squeezed = zlib.compress(content)
    return struct.pack("<II", 15, len(squeezed)) + squeezed


def nested_mat(path: Path, levels: int = 3000) -> None:
    inner = element(14, element(6, struct.pack("<II", 6, 0)) + element(5, struct.pack("<ii", 1, 1)))
    parts, size = [inner], len(inner)
    for _ in range(levels):
        part = element(6, struct.pack("<II", 2, 0)) + element(5, struct.pack("<ii", 1, 1)) + element(1, b"")
        part += struct.pack("<HHI", 5, 4, 8) + element(1, b"s".ljust(8, b"\0"))
        size += len(part)
        parts.append(struct.pack("<II", 14, size) + part)
        size += 8
    mat(path, packed(b"".join(reversed(parts))))


def nested_groups(path: Path) -> None:
    with h5py.File(path, "w") as handle:
        handle["g/" * 100 + "force"] = np.arange(20.0)


def huge_dataset(path: Path) -> None:
    with h5py.File(path, "w") as handle:
        handle.create_dataset("force", (10**12,), chunks=(1000,), dtype="f8")


def many_groups(path: Path) -> None:
    """Two links from each level to the next: as many paths as 2 to the power of the levels."""
    with h5py.File(path, "w") as handle:
        below = handle.create_group("last")
        for i in range(40):
            group = handle.create_group(f"level{i}")
            group["one"], group["other"], below = below, below, group


def matlab_table(path: Path) -> None:
    """A table as MATLAB v7.3 writes it: numbers that refer to objects."""
    with h5py.File(path, "w", userblock_size=512) as handle:
        handle["acceleration"] = np.arange(6.0)
        handle["T"] = np.arange(6, dtype=np.uint32)
        handle["T"].attrs.update(MATLAB_class=np.bytes_("table"), MATLAB_object_decode=3)


def data_in(name: str, write: Callable[[Path], None]) -> Spoil:
    """Declares another data file."""

    def both(folder: Path) -> None:
        replace(r"run\.csv", name)(folder)
        write(folder / name)

    return both


CLOCK = "\n".join(f"12:03:{4 + 0.125 * i:06.3f},{i % 7},{i % 5}" for i in range(40))

CASES = {
    # Declarations, beside those of test_bad_campaign.
    "no campaign at all": campaign(
        lambda f: (f / "campaign.toml").unlink(), r"campaign\.toml does not exist; exp"
    ),
    "an empty declaration": campaign(lambda f: text("")(f / "campaign.toml"), "is empty; expected sections"),
    "broken TOML": campaign(replace("mass = 2.0", "mass = "), "not valid TOML", "line 3"),
    "a declaration in UTF-16": campaign(
        lambda f: text("[campaign]".encode("utf-16"))(f / "campaign.toml"), "is not UTF-8 text", "must be"
    ),
    "an image called campaign.toml": campaign(
        lambda f: text(b"\x89PNG\r\n\x1a\n" + bytes(range(256)))(f / "campaign.toml"), "is not UTF-8 text"
    ),
    "a section twice": campaign(replace(r"\[model\]", "[campaign]\n[model]"), "not valid TOML"),
    "an effect that is not in the catalogue": campaign(
        replace(r'\["linear"\]', '["kubic"]'),
        "must name effects of the catalogue, but has 'kubic'; nearest: 'cubic'",
    ),
    "an element that follows a floor nobody measured": campaign(
        replace(r"\[model\]", '[model]\nelements = ["floor_motion"]'), r"section \[floor\], .* is missing"
    ),
    "a number too large for the field": campaign(
        replace("mass = 2.0", "mass = 99999999999999999999999"), "mass = 9+ must be a finite number above 0"
    ),
    "held-out samples that are fitted": campaign(
        replace('role = "fit"', 'role = "fit"\n[[record]]\nfile = "run.csv"\nrole = "holdout"'),
        "share samples 0:2000",
        "held-out samples must not be used to fit",
    ),
    "a filter that is taken out and never was": campaign(
        replace(
            r"\[model\]", "[filter]\norder = 2\ncutoff_hz = 20\napplied = false\ncompensate = true\n[model]"
        ),
        "says that there was none",
    ),
    # Tables of text.
    "an empty file": campaign(
        lambda f: text("")(f / "run.csv"), r"run\.csv is empty \(0 bytes\); expected a table"
    ),
    "a heading alone": campaign(lambda f: text("force,acceleration\n")(f / "run.csv"), "no rows of numbers"),
    "prose": file("notes.txt", text("The bench was cold.\nWe went home.\n"), "no rows of numbers; expected"),
    "a decimal comma among commas": campaign(
        lambda f: text("force,acceleration\n1,2\n3,4,5\n5,6\n")(f / "run.csv"),
        r"row 2 \(index 1\), line 3 of the file, has 3 cells, .* expected 2. Likely cause: a decimal comma",
    ),
    "too many headings": file(
        "a.csv", text("a,b,c\n1,2\n3,4\n"), "3 headings but 2 columns .* expected one heading a column"
    ),
    "a quotation mark that is never closed": file(
        "a.csv", text('a,b\n1,2\n"3,4\n5,6\n7,8\n'), "Likely cause: a quotation mark that is never closed"
    ),
    "thousands with points": campaign(
        lambda f: text("force;acceleration\n" + "1,5;2,5\n" * 20 + "3,5;1.234,5\n")(f / "run.csv"),
        r"column `acceleration` holds the text '1.234,5' at row 21 \(index 20\), line 22 of the file",
    ),
    "overload in words": campaign(
        at(17, "force", "overload"),
        r"column `force` holds the text 'overload' at row 18 \(index 17\), line 19",
    ),
    "a point among decimal commas": campaign(
        cells(lambda t: t.astype(str).assign(force=lambda o: o["force"].str.replace(".", ",")), sep=";"),
        "column `(force|acceleration)` holds the text '.*' at row 1",
        "the other rows have a decimal",
    ),
    "a clock of letters": campaign(
        lambda f: (
            text("time,force,acceleration\n" + CLOCK.replace("12:03:05.000", "noon"))(f / "run.csv"),
            replace("rate = 200.0", 'time = "time"')(f),
        )[0],
        r"`time` holds the text 'noon' at row 9 \(index 8\), line 10 .* not a time of day",
    ),
    "two columns of a name": campaign(
        lambda f: text("force,force,acceleration\n" + "1,2,3\n4,5,6\n" * 20)(f / "run.csv"),
        "2 channels are called `force`; rename them",
    ),
    "a column that is missing": campaign(
        cells(lambda t: t.rename(columns={"force": "Force_N"})),
        "no column `force`; it has .*did you mean `Force_N`",
    ),
    "a row of a million columns": file(
        "a.csv",
        text(b"1.5," * 1_000_000 + b"\n"),
        "a line .* has 4000000 bytes; expected a row a sample",
        "transpose",
    ),
    "two thousand columns": file(
        "a.csv", text("\n".join([",".join(["1.5"] * 2000)] * 4)), "has 2000 columns; expected .* at most 1024"
    ),
    "zero bytes": file("a.csv", text(bytes(5000)), "no rows of numbers; expected"),
    "two rows": file(
        "a.csv", text("a,b\n1,2\n3,4\n"), "holds no channel; expected columns of at least 16 numbers"
    ),
    # Values.
    "a missing sample": campaign(
        at(17, "force", ""), r"column `force` is nan at row 18 \(index 17\); every sample"
    ),
    "an infinite sample": campaign(
        at(3, "acceleration", "inf"), r"`acceleration` is inf at row 4 \(index 3\); every"
    ),
    "nothing but NaN": campaign(
        cells(lambda t: t.assign(force=np.nan)), r"`force` is nan at row 1 \(index 0\) \(and at 1999 more\)"
    ),
    "a channel that stands still": campaign(
        cells(lambda t: t.assign(acceleration=0.5)),
        r"`acceleration` is constant \(0.5 in SI .*; expected a channel",
    ),
    "no force": campaign(
        cells(lambda t: t.assign(force=0.0)), "column `force` is 0 throughout, and the output does not decay"
    ),
    "too few samples": campaign(cells(lambda t: t.head(9)), "covers 9 samples of .*; at least 16 are needed"),
    "a heading in kN": campaign(
        cells(lambda t: t.rename(columns={"force": "force [kN]"})),
        r'unit = "N", but .* is in kN; they must agree',
    ),
    # Times.
    "time that runs backwards": campaign(
        timed(lambda t: np.where(np.arange(t.size) == 40, -1.0, t)),
        r"runs backwards at row 41 \(index 40\)",
        "must inc",
    ),
    "a time twice": campaign(
        timed(lambda t: np.where(np.arange(t.size) == 40, t[39], t)),
        r"repeats at row 41 \(index 40\): 0.195 s",
    ),
    "a gap": campaign(
        timed(lambda t: t + 0.02 * (np.arange(t.size) >= 100)), r"has a gap at row 101 .*samples are missing"
    ),
    "a time that is missing": campaign(
        timed(lambda t: np.where(np.arange(t.size) == 7, np.nan, t)),
        r"time column `time` is nan at row 8",
        "must be",
    ),
    "a clock that slows down": campaign(
        timed(lambda t: t + 0.2 * np.maximum(t - 5.0, 0.0)), "is not uniform: .* resample the record"
    ),
    "a rate that the times contradict": campaign(
        replace("rate = 200.0", 'rate = 100.0\ntime = "time"'),
        "says 100 Hz, but time column .* 200 Hz; they must agree",
    ),
    "no rate": campaign(replace("rate = 200.0\n", ""), r"sampling rate is not known; give \[sampling\] rate"),
    # Archives, trees and lists of channels.
    "a text called .npz": file(
        "a.npz", text("t,F\n1,2\n"), "cannot be read as a NumPy .npz .*Likely cause: it is cut"
    ),
    "a single array called .npz": file(
        "a.npz", text(header((2,)) + bytes(16)), "single array without a name; expected"
    ),
    "an archive cut short": file(
        "a.npz",
        cut(lambda p: np.savez(p, force=np.ones(500), a=np.ones(500))),
        "Likely cause: it is cut short",
    ),
    "an array of objects": campaign(
        data_in("a.npz", lambda p: np.savez(p, force=np.array([{}]), acceleration=np.ones(30))),
        "`force` cannot be read",
    ),
    "an archive of gigabytes": file(
        "a.npz", archive_of_zeros, "to read it takes 22.4 GiB of memory; expected at most 1"
    ),
    "an array that announces more than there is": campaign(
        data_in("a.npz", array_of_nothing),
        "array `force` cannot be read as numbers",
    ),
    "a .mat cut short": file(
        "a.mat", cut(lambda p: scipy.io.savemat(p, {"F": np.ones(500)})), "Likely cause: it is cut"
    ),
    "a .mat that announces 3 GB": file(
        "a.mat", lambda p: mat(p, array_element(4 * 10**8, 32 * 10**8)), "takes 5.96 GiB"
    ),
    "a packed .mat that announces 3 GB": file(
        "a.mat", lambda p: mat(p, packed(array_element(4 * 10**8, 32 * 10**8))), "takes 5.96 GiB of memory"
    ),
    "a .mat of a billion rows": file(
        "a.mat", lambda p: mat(p, array_element(10**9, 64)), "takes 22.4 GiB of memory"
    ),
    "structures in structures": file(
        "a.mat", nested_mat, "structures more than 64 levels deep", "Likely cause"
    ),
    "cells without end": file("a.mat", many_cells, "more than 16384 groups and arrays; expected"),
    "a MATLAB table": campaign(
        lambda f: (replace('column = "force"', 'column = "T"')(f), data_in("a.mat", matlab_table)(f))[0],
        "`T` holds objects, a MATLAB table, .*S = table2struct",
    ),
    "text called .h5": file(
        "a.h5", text("t,F\n1,2\n"), "cannot be read as HDF5. Likely cause: it is cut short"
    ),
    "Parquet called .h5": file("a.h5", parquet, "wrong ending, since it begins as Parquet"),
    "groups in groups": file("a.h5", nested_groups, "groups or structures more than 64 levels deep"),
    "links to links": file("a.h5", many_groups, "more than 16384 groups and arrays"),
    "a dataset of terabytes": file("a.h5", huge_dataset, r"takes 2.24e\+04 GiB of memory"),
    "an HDF5 file cut short": file(
        "a.h5",
        cut(lambda p: h5py.File(p, "w").create_dataset("F", data=np.ones(5000))),
        "Likely cause: it is cut",
    ),
    "a Parquet file cut short": file(
        "a.parquet", cut(parquet), "cannot be read as a Parquet file. Likely cause"
    ),
    "a spreadsheet called .parquet": file(
        "a.parquet", sheet, r"wrong ending, since it begins as a ZIP archive \(.npz"
    ),
    "a spreadsheet cut short": file("a.xlsx", cut(sheet), "cannot be read as a spreadsheet. Likely cause"),
    "an empty spreadsheet": file(
        "a.xlsx", lambda p: openpyxl.Workbook().save(p), "holds no table; expected a sheet"
    ),
    "a stray cell in the last column": file(
        "a.xlsx",
        lambda p: sheet(p, ("XFD9999", 1.0)),
        "row 9999 and column 16384; .*Likely cause: a stray entry",
    ),
    "text in a spreadsheet's column": campaign(
        lambda f: (
            replace('column = "force"', 'column = "F"')(f),
            data_in("a.xlsx", lambda p: sheet(p, ("B2", "x")))(f),
        )[0],
        r"column `F` holds the text 'x' at row 1 \(index 0\), row 2 of the sheet",
    ),
    "a LabVIEW file without data": file(
        "a.lvm",
        text("LabVIEW Measurement\t\nSeparator\tTab\n***End_of_Header***\n"),
        "cannot be read as a LabVIEW",
    ),
    "a text called .tdms": file("a.tdms", text("t,F\n1,2\n"), "cannot be read as TDMS. Likely cause"),
    "a universal file of spectra only": file(
        "a.uff", text(b"    -1\n    15\n    -1\n"), "datasets .* only; expected a real"
    ),
    "a text called .unv": file("a.unv", text("t,F\n1,2\n"), "holds no dataset; expected a universal file"),
    "an unknown ending": file(
        "a.docx", text("t,F\n1,2\n"), r'unknown ending "\.docx"; expected one of \.csv'
    ),
    "a file that is not there": Case(
        "inspect rum.csv", lambda f: None, ("rum.csv does not exist; .*did you mean `run.csv`",)
    ),
    "a folder without data": Case("inspect inner", lambda f: None, ("inner: no data file; expected one of",)),
    # Models of the map.
    "no model": Case("map none.json", lambda f: None, ("none.json: cannot be read",)),
    "a model that is no JSON": Case("map m.json", lambda f: text("{")(f / "m.json"), ("m.json",)),
}
CASES |= {name: campaign(replace(*row[:2]), row[2]) for name, row in MISTAKES.items()}
CASES |= {
    f"schedule {name}": campaign(
        lambda f, content=content: (
            replace('role = "fit"', 'role = "fit"\nschedule = "schedule.csv"')(f),
            text(content)(f / "schedule.csv"),
        )[0],
        r"schedule\.csv",
        message,
    )
    for name, (content, message) in SCHEDULES.items()
}


def refusal(words: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    """The one line with which a command refuses; nothing else is printed."""
    assert main(words) == 2
    shown = capsys.readouterr()
    lines = [line for line in shown.err.splitlines() if line]
    assert shown.out == ""
    assert len(lines) == 1
    assert lines[0].startswith("isojax: ")
    return lines[0]


def test_the_corpus_has_eighty_cases() -> None:
    assert len(CASES) >= 80


@pytest.mark.parametrize("name", CASES)
def test_a_bad_case_is_refused_in_one_line_that_helps(
    name: str, tiny: Callable[..., Path], capsys: pytest.CaptureFixture[str]
) -> None:
    case, folder = CASES[name], tiny()
    (folder / "inner").mkdir()
    case.spoil(folder)
    command, *target = case.command.split()
    words = [command, str(folder / target[0]) if target else str(folder)]
    words += ["--amplitudes", "1", "2", "--frequencies", "1", "2"] if command == "map" else []
    words += ["--out", str(folder / "out")] if command != "inspect" else []
    words += ["--quiet"]  # no sign of life on a slow machine
    line = refusal(words, capsys)
    for said in case.said:
        assert re.search(said, line), line
    assert str(folder) in line
    assert re.search(LIBRARIES, line) is None, line
    assert not (folder / "out").exists()
