"""Tables of text as instruments and programs write them, by writers that are not the reader's."""

import contextlib
import io
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from isojax import read_campaign
from isojax.records.formats import read_table, read_text_columns, split_heading

Channels = dict[str, np.ndarray]
Tiny = Callable[..., Path]
FREE = "Measured by: A. Tester\nDate: 2026-03-05, 14:02\nComment: level 60 N; forward\n"
MICRO = np.array([0.25, -1.5, 3.0e-7, 12345.678, 0.0, 7.0] * 4).reshape(-1, 2)


def written(separator: str, decimal: str = ".", head: str = "force,acceleration") -> str:
    buffer = io.StringIO()
    frame = pd.DataFrame(MICRO, columns=head.split(","))
    frame.to_csv(buffer, sep=separator, decimal=decimal, index=False)
    return buffer.getvalue()


def spaced(text: str) -> str:
    """Columns in fixed widths."""
    return "\n".join("  ".join(f"{cell:>14}" for cell in line.split(",")) for line in text.splitlines())


TEXTS = {
    "commas": written(","),
    "semicolons and decimal commas": written(";", ","),
    "semicolons and decimal points": written(";"),
    "tabs": written("\t"),
    "tabs and decimal commas": written("\t", ","),
    "spaces": spaced(written(",")),
    "free lines above": FREE + written(","),
    "free lines above semicolons": FREE + "\n\n" + written(";", ","),
    "a row of units": written(",").replace("acceleration\n", "acceleration\nN,m/s^2\n", 1),
    "a row of units in brackets": written(";").replace("acceleration\n", "acceleration\n[N];[m/s²]\n", 1),
    "a row of units, then one of remarks": written(",").replace("on\n", "on\nN,m/s^2\ncell 3,table\n", 1),
    "units in the heading": written(",", head="force [N],acceleration [m/s^2]"),
    "units in round brackets": written("\t", head="force (N),acceleration (m/s2)"),
    "units and spaces": spaced(written(","))
    .replace("force", "force [N]")
    .replace("acceleration", "acceleration [g]"),
    "a heading behind a hash": "# made by a script\n# " + written(","),
    "a percent sign": "% " + written(","),
    "a separator at the end of rows": re.sub("\n", ",\n", written(",")),
    "carriage returns only": written(",").replace("\n", "\r"),
    "empty lines between rows": written(",").replace("\n", "\n\n"),
    "quoted headings": written(",").replace("force,acceleration", '"force","acceleration"'),
    "fortran exponents": written(",").replace("e-07", "D-07"),
    "one number per line above": "2000\n" + written(","),
}


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "cp1252"])
@pytest.mark.parametrize("layout", TEXTS)
def test_the_numbers_of_every_layout_come_back_exactly(layout: str, encoding: str, tmp_path: Path) -> None:
    file = tmp_path / "run.txt"
    file.write_bytes(TEXTS[layout].encode(encoding))
    columns = read_text_columns(file, ["force", "acceleration"])
    np.testing.assert_array_equal(np.stack([one.samples for one in columns.values()], axis=1), MICRO)
    if "unit" in layout:
        assert columns["force"].unit == "N"
        assert columns["acceleration"].unit in ("m/s^2", "m/s²", "m/s2", "g")


@pytest.mark.parametrize("ending", [".csv", ".txt", ".dat", ".tsv"])
@pytest.mark.parametrize("separator", [",", ";", "\t", "   "])
def test_a_table_without_a_heading_names_its_columns_by_place(
    ending: str, separator: str, tmp_path: Path
) -> None:
    file = tmp_path / f"run{ending}"
    np.savetxt(file, MICRO, delimiter=separator, fmt="%.17g")
    columns = read_text_columns(file, ["[:, 1]", "[:, 0]"])
    np.testing.assert_array_equal(columns["[:, 1]"].samples, MICRO[:, 1])
    np.testing.assert_array_equal(columns["[:, 0]"].samples, MICRO[:, 0])


@pytest.mark.parametrize(
    ("heading", "name", "unit"),
    [
        ("Time [ms]", "Time", "ms"),
        ("F (kN)", "F", "kN"),
        ("a / m/s^2", "a", "m/s^2"),
        ("Weg in mm", "Weg", "mm"),
        ("Acc X[g]", "Acc X", "g"),
        ("x (mV)", "x", "mV"),
        ("I [mA]", "I", "mA"),
        ("Sensor (A)", "Sensor (A)", None),
        ("Force (table)", "Force (table)", None),
        ("Force", "Force", None),
        ("B [G]", "B [G]", None),
        ("[:, 0]", "[:, 0]", None),
        ("F", "F", None),
    ],
)
def test_a_heading_gives_name_and_unit(heading: str, name: str, unit: str | None) -> None:
    assert split_heading(heading) == (name, unit)


def test_letters_that_are_also_units_are_a_heading(tmp_path: Path) -> None:
    file = tmp_path / "run.csv"
    file.write_text("made in,Ulm\nt,F,a\n0,1,2\n1,3,4\n2,5,6\n")
    assert read_table(file).headings == ("t", "F", "a")


def test_a_row_with_a_missing_first_value_is_no_heading(tmp_path: Path) -> None:
    file = tmp_path / "run.csv"
    file.write_text("a,b,c\n0.0,1,\n0.1,,\n0.2,3,4\n0.3,5,6\n0.4,7,8\n")
    table = read_table(file)
    assert table.headings == ("a", "b", "c")
    np.testing.assert_array_equal(table.numbers(0), [0.0, 0.1, 0.2, 0.3, 0.4])
    assert np.isnan(table.numbers(2)[:2]).all()


def test_units_are_taken_from_the_heading_and_converted(tiny: Tiny, channels: Channels) -> None:
    frame = pd.DataFrame(
        {
            "time [ms]": 1e3 * channels["time"],
            "force [kN]": 1e-3 * channels["force"],
            "acceleration [g]": channels["acceleration"] / 9.80665,
        }
    )
    units = ('unit = "N"\n', ""), (r'unit = "m/s\^2"\n', ""), ("rate = 200.0", 'time = "time"')
    folder = tiny(*units)
    frame.to_csv(folder / "run.csv", sep=";", decimal=",", index=False, encoding="utf-16")
    campaign = read_campaign(folder)
    assert (campaign.input.unit, campaign.output.unit, campaign.rate) == ("kN", "g", 200.0)
    np.testing.assert_allclose(campaign.records[0].input, channels["force"], rtol=1e-12)
    np.testing.assert_allclose(campaign.records[0].output, channels["acceleration"], rtol=1e-12)


@pytest.mark.parametrize(
    ("heading", "message"),
    [
        (
            "force [kN]",
            r'\[input\] unit = "N", but .*run\.csv says that .*`force` is in kN; they',
        ),
        ("force (V)", r'\[input\] unit = "N", but .* is in V'),
        ("force [m/s^2]", r'\[input\] unit = "N", but .* is in m/s\^2'),
    ],
)
def test_a_heading_that_contradicts_the_declared_unit_is_refused(
    heading: str, message: str, tiny: Tiny, channels: Channels
) -> None:
    folder = tiny()
    pd.DataFrame(channels).rename(columns={"force": heading}).to_csv(folder / "run.csv", index=False)
    with pytest.raises(ValueError, match=message):
        read_campaign(folder)


@pytest.mark.parametrize("heading", ["force [N]", "force (Newton)", "force [1]", "force [raw]", "force"])
def test_a_heading_that_says_the_same_or_nothing_is_accepted(
    heading: str, tiny: Tiny, channels: Channels
) -> None:
    folder = tiny(('column = "force"', f'column = "{heading}"'))
    pd.DataFrame(channels).rename(columns={"force": heading}).to_csv(folder / "run.csv", index=False)
    np.testing.assert_array_equal(read_campaign(folder).records[0].input, channels["force"])


def test_a_declared_unit_of_time_converts_and_is_compared(tiny: Tiny, channels: Channels) -> None:
    folder = tiny(("rate = 200.0", 'time = "time"\nunit = "ms"'))
    pd.DataFrame({**channels, "time": 1e3 * channels["time"]}).to_csv(folder / "run.csv", index=False)
    assert read_campaign(folder).rate == 200.0
    frame = pd.DataFrame(channels).rename(columns={"time": "time [s]"})
    frame.to_csv(folder / "run.csv", index=False)
    with pytest.raises(ValueError, match=r'\[sampling\] unit = "ms", but .* column `time` is in s; they'):
        read_campaign(folder)


FAULTS = {
    "a decimal comma among commas": (
        "a,b\n1,2\n3,4\n5,5,6\n7,8\n",
        r"row 3 \(index 2\), line 4 of the file, has 3 cells, separated by commas; expected 2. "
        r"Likely cause: a decimal comma",
    ),
    "a point among decimal commas": (
        "a;b\n1,5;2,5\n3,5;4.5\n5,5;6,5\n",
        r"column `b` holds the text '4.5' at row 2 \(index 1\), line 3 .*; the other rows have a .*comma",
    ),
    "thousands": (
        "a;b\n1,5;2,5\n3,5;1.234,5\n5,5;6,5\n",
        r"column `b` holds the text '1.234,5' at row 2",
    ),
    "an open quotation mark": ('a,b\n1,2\n"3,4\n5,6\n7,8\n', r"cannot be told apart.*quotation mark"),
    "too many headings": (
        "a,b,c\n1,2\n3,4\n",
        r"has 3 headings but 2 columns of values \(line 2\); expected one heading a column",
    ),
    "no numbers": ("to be done\n", r"holds? no rows of numbers|no rows"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_faulty_table_is_named_with_line_and_likely_cause(fault: str, tmp_path: Path) -> None:
    text, message = FAULTS[fault]
    file = tmp_path / "run.csv"
    file.write_text(text)
    with pytest.raises(ValueError, match=message) as caught:
        read_text_columns(file, ["a", "b"])
    assert "tokenizing" not in str(caught.value)
    assert "run.csv" in str(caught.value)


CELLS = st.one_of(
    st.floats(allow_nan=True).map(repr),
    st.integers().map(str),
    st.sampled_from(["", '"', "nan", "x", "[N]", "1,5", "#", "true", "1_0", "∞", "N/A", "\x00", "1e999"]),
    st.text(max_size=4),
)
TABLES = st.lists(
    st.tuples(st.lists(CELLS, max_size=4), st.sampled_from([",", ";", "\t", " "])), max_size=8
).map(lambda rows: "\n".join(separator.join(cells) for cells, separator in rows))


@settings(deadline=None, max_examples=150)
@given(st.one_of(st.binary(max_size=120), TABLES.map(lambda text: text.encode("utf-8", "surrogatepass"))))
def test_whatever_the_bytes_are_the_reader_gives_numbers_or_a_value_error(
    tmp_path_factory: pytest.TempPathFactory, content: bytes
) -> None:
    file = tmp_path_factory.getbasetemp() / "any.csv"
    file.write_bytes(content)
    with contextlib.suppress(ValueError):
        for name, column in read_text_columns(file, None).items():
            again = read_text_columns(file, [name])[name]
            np.testing.assert_array_equal(again.samples, column.samples)


@pytest.mark.parametrize(
    ("separator", "clock"),
    [
        (",", "%H:%M:%S.%f"),
        (";", "%Y-%m-%d %H:%M:%S.%f"),
        ("\t", "%Y-%m-%dT%H:%M:%S.%fZ"),
        ("   ", "%H:%M:%S.%f"),
    ],
)
def test_times_of_day_are_seconds_since_the_first_over_midnight(
    separator: str, clock: str, tmp_path: Path
) -> None:
    times = pd.Timestamp("2026-03-05 23:59:58.5") + pd.to_timedelta(np.arange(40) * 125, unit="ms")
    rows = [f"{one.strftime(clock)}{separator}{i % 7}{separator}{i % 5}.5" for i, one in enumerate(times)]
    file = tmp_path / "run.csv"
    file.write_text("\n".join([separator.join(("time", "force", "a")), *rows]) + "\n")
    columns = read_text_columns(file, ["time", "a"])
    np.testing.assert_allclose(columns["time"].samples, np.arange(40) / 8.0, atol=1e-6)
    assert columns["time"].unit == "s"
    np.testing.assert_array_equal(columns["a"].samples, np.arange(40) % 5 + 0.5)


def test_one_column_of_decimal_commas_is_one_column(tmp_path: Path) -> None:
    file = tmp_path / "run.csv"
    file.write_text("force [N]\n1,5\n-2,25\n3,0e1\n0,5\n")
    columns = read_text_columns(file, None)
    assert {name: one.unit for name, one in columns.items()} == {"force [N]": "N"}
    np.testing.assert_array_equal(columns["force [N]"].samples, [1.5, -2.25, 30.0, 0.5])
    file.write_text("force,a\n1,5\n2,25\n3,0\n")
    assert list(read_text_columns(file, None)) == ["force", "a"]
