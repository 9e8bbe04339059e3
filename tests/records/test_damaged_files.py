"""Whatever the bytes of a file are, its reader gives numbers or one error that names the file."""

import re
import warnings
import zipfile
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import openpyxl
import pyarrow
import pyarrow.parquet
import pytest
import scipy.io
from hypothesis import given, settings
from hypothesis import strategies as st
from test_file_formats import write_mat_73, write_tdms, write_universal

from isojax.records.reading import READERS

NAMES = ("time", "force", "acceleration")
CHANNELS = {name: np.arange(2000.0) * 0.005 + i for i, name in enumerate(NAMES)}
RAW = re.compile("tokenizing|Traceback|object at 0x|<class")


def write_sheet(file: Path) -> None:
    book = openpyxl.Workbook()
    page = book.worksheets[0]
    page.append(list(NAMES))
    for row in np.column_stack(list(CHANNELS.values()))[:60]:
        page.append([float(one) for one in row])
    book.save(file)


def write_ods(file: Path) -> None:
    """The least that a reader takes for an OpenDocument sheet."""
    kind = 'office:value-type="float" office:value='
    cells = lambda row: "".join(f'<table:table-cell {kind}"{one}"/>' for one in row)  # noqa: E731
    rows = np.column_stack(list(CHANNELS.values()))[:60]
    body = "".join(f"<table:table-row>{cells(row)}</table:table-row>" for row in rows)
    spaces = " ".join(
        f'xmlns:{one}="urn:oasis:names:tc:opendocument:xmlns:{one}:1.0"'
        for one in ("office", "table", "text")
    )
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("mimetype", "application/vnd.oasis.opendocument.spreadsheet")
        archive.writestr("META-INF/manifest.xml", "<manifest/>")
        archive.writestr(
            "content.xml",
            f"<office:document-content {spaces}><office:body><office:spreadsheet>"
            f'<table:table table:name="run">{body}</table:table>'
            "</office:spreadsheet></office:body></office:document-content>",
        )


def write_lvm(file: Path) -> None:
    head = (
        "LabVIEW Measurement\t\nWriter_Version\t2\nReader_Version\t2\nSeparator\tTab\nDecimal_Separator\t.\n"
        "Multi_Headings\tNo\nX_Columns\tOne\n***End_of_Header***\t\n\nChannels\t2\t\t\nSamples\t60\t60\t\n"
        "X_Dimension\tTime\tTime\t\nX0\t0.0\t0.0\t\nDelta_X\t0.005\t0.005\t\n***End_of_Header***\t\t\t\n"
        "X_Value\tforce\tacceleration\tComment\n"
    )
    rows = np.column_stack(list(CHANNELS.values()))[:60]
    file.write_text(head + "".join("\t".join(map(repr, map(float, row))) + "\n" for row in rows))


def write_h5(file: Path) -> None:
    with h5py.File(file, "w") as handle:
        for name, samples in CHANNELS.items():
            handle.create_dataset(f"run/{name}", data=samples, compression="gzip")


WRITERS: dict[str, Callable[[Path], None]] = {
    ".csv": lambda file: np.savetxt(
        file,
        np.column_stack(list(CHANNELS.values()))[:60],
        delimiter=",",
        header=",".join(NAMES),
        comments="",
    ),
    ".lvm": write_lvm,
    ".xlsx": write_sheet,
    ".ods": write_ods,
    ".parquet": lambda file: pyarrow.parquet.write_table(pyarrow.table(CHANNELS), file),
    ".npz": lambda file: np.savez_compressed(file, **CHANNELS),
    ".mat": lambda file: scipy.io.savemat(file, {"run": CHANNELS, **CHANNELS}, do_compression=True),
    "_73.mat": lambda file: write_mat_73(file, CHANNELS),
    ".h5": write_h5,
    ".uff": lambda file: write_universal(file, CHANNELS),
    ".tdms": lambda file: write_tdms(file, CHANNELS),
}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], bytes]:
    """Gives the bytes of a right file of each format."""
    made: dict[str, bytes] = {}

    def bytes_of(ending: str) -> bytes:
        if ending not in made:
            file = tmp_path_factory.mktemp("right") / f"run{ending}"
            WRITERS[ending](file)
            assert len(read(file)) >= 2
            made[ending] = file.read_bytes()
        return made[ending]

    return bytes_of


def read(file: Path) -> dict[str, object]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of packages, on damaged files
        return {**READERS[file.suffix](file, None)}


def check_error(file: Path) -> None:
    """Reads a file; an error must name it, and be no message of the package that reads it."""
    try:
        read(file)
    except (ValueError, OSError) as error:
        said = str(error)
    else:
        return
    assert file.name in said
    assert RAW.search(said) is None, said


DAMAGE = st.one_of(
    st.tuples(st.just("cut"), st.floats(0.0, 1.0), st.binary(max_size=8)),
    st.tuples(st.just("overwrite"), st.floats(0.0, 1.0), st.binary(min_size=1, max_size=16)),
    st.tuples(st.just("insert"), st.floats(0.0, 1.0), st.binary(min_size=1, max_size=16)),
    st.tuples(st.just("replace"), st.floats(0.0, 0.05), st.binary(max_size=400)),
)


def damaged(raw: bytes, how: str, share: float, put: bytes) -> bytes:
    at = int(share * len(raw))
    rest = {"cut": b"", "overwrite": raw[at + len(put) :], "insert": raw[at:], "replace": b""}[how]
    return raw[:at] + put + rest


@pytest.mark.parametrize("ending", WRITERS)
def test_a_damaged_file_gives_numbers_or_an_error_that_names_it(
    ending: str, whole: Callable[[str], bytes], tmp_path_factory: pytest.TempPathFactory
) -> None:
    raw, file = whole(ending), tmp_path_factory.mktemp("damaged") / f"run{ending}"

    # Always the same examples: a package may crash on bytes that no one has seen.
    @settings(deadline=None, max_examples=40, derandomize=True, database=None)
    @given(DAMAGE)
    def check(damage: tuple[str, float, bytes]) -> None:
        file.write_bytes(damaged(raw, *damage))
        check_error(file)

    check()


@pytest.mark.parametrize("ending", WRITERS)
@pytest.mark.parametrize("content", [b"\x00" * 300, bytes(range(256)) * 4, b"PK\x03\x04" + b"\x07" * 99])
def test_other_bytes_give_an_error_that_names_the_file(ending: str, content: bytes, tmp_path: Path) -> None:
    file = tmp_path / f"run{ending}"
    file.write_bytes(content)
    check_error(file)


def test_samples_count_as_the_float64_that_they_become(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "run.mat"
    small = {f"a{i}": np.arange(20000, dtype=np.uint8) for i in range(4)}  # 80 kB, 640 kB as float64
    scipy.io.savemat(file, {"run": small}, do_compression=True)
    assert len(read(file)) == 4
    monkeypatch.setenv("ISOJAX_READ_GIB", "0.0015")
    with pytest.raises(ValueError, match=r"run\.mat: to read it takes 0\.00194 GiB of memory; expected at"):
        read(file)


@pytest.mark.parametrize("announced", [100, 2_200_000])
def test_a_spreadsheet_is_unpacked_whatever_its_directory_announces(
    announced: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "run.xlsx"
    write_sheet(file)
    with zipfile.ZipFile(file) as archive:
        parts = {part.filename: archive.read(part) for part in archive.infolist()}
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in parts.items():
            archive.writestr(name, content + b"<a/>" * (500_000 if "sheet1" in name else 0))
    raw = bytearray(file.read_bytes())
    entry = raw.rindex(b"xl/worksheets/sheet1.xml") - 46
    raw[entry + 24 : entry + 28] = announced.to_bytes(4, "little")
    file.write_bytes(raw)
    monkeypatch.setenv("ISOJAX_READ_SECONDS", "0.1")
    with pytest.raises(ValueError, match=r"run\.xlsx: to read it takes 0\.\d+ s; expected at most 0\.1"):
        read(file)


def test_cells_without_places_are_counted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "run.xlsx"
    write_sheet(file)
    with zipfile.ZipFile(file) as archive:
        parts = {part.filename: archive.read(part) for part in archive.infolist()}
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in parts.items():
            archive.writestr(name, re.sub(rb"<(c|row) r=\"\w+\"", rb"<\1", content))
    monkeypatch.setenv("ISOJAX_READ_GIB", "1e-5")
    with pytest.raises(ValueError, match=r"run\.xlsx: to read it takes .* column 3; all have 183 cells"):
        read(file)
