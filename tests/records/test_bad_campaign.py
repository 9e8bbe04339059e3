"""Every mistake in campaign.toml gives one ValueError: file, field, what was found and what was expected."""

import shutil
import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from isojax import read_campaign

RECORD = r'role = "fit"'
FLOOR = """\
[floor]
quantity = "acceleration"
column = "floor"
unit = "m/s^2"

[model]"""
MISTAKES = {
    "a missing section": (r"\[output\](.|\n)*?\n\n", "", r"section \[output\] is missing.*`quantity`"),
    "an unknown section": (r"\[model\]", "[modell]", r"unknown section `modell`; did you mean `model`"),
    "a misspelt field": ("^mass = ", "mas = ", r"\[campaign\].*unknown field `mas`; did you mean `mass`"),
    "a missing mass": ("^mass = 2.0\n", "", r"\[campaign\] lacks the field `mass`"),
    "a missing column field": ('column = "force"\n', "", r"\[input\] lacks the field `column`"),
    "a missing unit": (
        'unit = "N"\n',
        "",
        r"\[input\] unit is not declared, and .*run\.csv states no unit of .*`force`; write unit = \"N\"",
    ),
    "G for standard gravity": (
        '"m/s\\^2"',
        '"G"',
        r'unit = "G" \(gauss\) does not .* did you mean `g`, standard',
    ),
    "a unit of time without a time column": (
        "rate = 200.0",
        'rate = 200.0\nunit = "ms"',
        r"\[sampling\] unit = 'ms' is that of the time column, but the field `time`.* is missing",
    ),
    "a missing quantity": (
        'quantity = "force"\n',
        "",
        r"\[input\] lacks the field `quantity`.*base_acceleration",
    ),
    "a negative mass": ("mass = 2.0", "mass = -2.0", r"mass = -2.0 must be a finite number above 0"),
    "a mass that is no number": ("mass = 2.0", "mass = nan", r"mass = nan must be a finite number above 0"),
    "a mass in quotes": ("mass = 2.0", 'mass = "2.0"', r"mass = '2.0' must be a finite number"),
    "a flag in quotes": (
        "mass = 2.0",
        'mass = 2.0\nmass_free = "yes"',
        r"mass_free = 'yes' must be true or false",
    ),
    "a flag that is a number": (
        "mass = 2.0",
        "mass = 2.0\nmass_free = 1",
        r"mass_free = 1 must be true or false",
    ),
    "a number that is a flag": ("mass = 2.0", "mass = true", r"mass = True must be a finite number"),
    "an empty title": ('"tiny"', '""', r"title = '' must be a text"),
    "an unknown quantity": (
        '"force"',
        '"forse"',
        r"quantity = 'forse' must be one of .*; did you mean `force`",
    ),
    "an unknown output": ('"acceleration"', '"jerk"', r"\[output\] quantity = 'jerk' must be one of"),
    "a zero gain": ('unit = "N"', 'unit = "N"\ngain = 0', r"gain = 0 must be a finite number other than 0"),
    "an unknown hold": ('unit = "N"', 'unit = "N"\nhold = "cubic"', r"hold = 'cubic' must be one of"),
    "a reaction mass without its mass": (
        'quantity = "force"',
        'quantity = "reaction_mass_acceleration"',
        r"lacks the field `moving_mass`",
    ),
    "a moving mass without a reaction mass": (
        'unit = "N"',
        'unit = "N"\nmoving_mass = 3.0',
        r"moving_mass = 3.0 belongs to",
    ),
    "one column for both channels": ('"force"\nunit', '"acceleration"\nunit', r"both name column"),
    "an unknown unit": (
        'unit = "N"',
        'unit = "Nn"',
        r'\[input\] unit = "Nn" is not a unit.*did you mean `N`|mN',
    ),
    "a unit of another quantity": (
        'unit = "N"',
        'unit = "m"',
        r'unit = "m" \(meter\) does not measure a force',
    ),
    "a knot for a kilonewton": ('unit = "N"', 'unit = "kn"', r"does not measure a force.*did you mean `kN`"),
    "gram for an acceleration's unit": ('"m/s\\^2"', '"kg"', r"does not measure an acceleration"),
    "a unit with a number": ('"m/s\\^2"', '"2 m/s^2"', r"is not a unit"),
    "a floor measured in newtons": (
        r"\[model\]",
        FLOOR.replace("m/s^2", "N"),
        r'\[floor\] unit = "N" .* does not measure an acceleration',
    ),
    "a floor that does not move": (
        r"\[model\]",
        FLOOR.replace("m/s^2", 'm/s^2"\ngain = "0'),
        r"\[floor\] gain = '0' must be a finite number other than 0",
    ),
    "a floor that is the output": (
        r"\[model\]",
        FLOOR.replace('"floor"', '"acceleration"'),
        r'\[output\] and \[floor\] both name column = "acceleration"',
    ),
    "noise below zero": (
        '"m/s\\^2"',
        '"m/s^2"\nnoise = -0.1',
        r"noise = -0.1 must be a finite number above 0",
    ),
    "a negative rate": ("rate = 200.0", "rate = -200.0", r"\[sampling\] rate = -200.0 must be"),
    "no rate at all": ("rate = 200.0\n", "", r"the sampling rate is not known"),
    "a filter above half the rate": (
        r"\[model\]",
        "[filter]\norder = 4\ncutoff_hz = 120.0\napplied = false\n[model]",
        r"cutoff_hz = 120 must be below half the sampling rate, 100 Hz",
    ),
    "a filter taken out that never was": (
        r"\[model\]",
        "[filter]\norder = 4\ncutoff_hz = 20.0\napplied = false\ncompensate = true\n[model]",
        r"compensate = true removes the filter of the test rig, but applied = false",
    ),
    "a filter without order": (
        r"\[model\]",
        "[filter]\ncutoff_hz = 20.0\n[model]",
        r"\[filter\] lacks .* `order`",
    ),
    "an unknown filter": (
        r"\[model\]",
        '[filter]\nkind = "bessel"\norder = 2\ncutoff_hz = 20.0\n[model]',
        r"kind = 'bessel' must be one of",
    ),
    "a stiffness that is no list": (
        r'\["linear"\]',
        '"linear"',
        r"\[model\] stiffness = 'linear' must be a list",
    ),
    "a list of numbers": (r'\["linear"\]', "[1, 2]", r"stiffness = \[1, 2\] must be a list"),
    "a term named twice": (r'\["linear"\]', '["linear", "linear"]', r"must be a list of different names"),
    "records as one table": (r"\[\[record\]\]", "[record]", r"write \[\[record\]\] above each record"),
    "a section as a list": (r"\[model\]", "[[model]]", r"\[model\] must be one table of fields"),
    "no record": (r"\[\[record\]\](.|\n)*", "", r"no \[\[record\]\] is listed"),
    "no record to fit": (RECORD, 'role = "holdout"', r"no \[\[record\]\] has role = \"fit\""),
    "an unknown role": (
        RECORD,
        'role = "test"',
        r"number 1 role = 'test' must be one of \"fit\", \"holdout\"",
    ),
    "a missing role": (RECORD, "", r"\[\[record\]\] number 1 lacks the field `role`"),
    "a missing file field": ('file = "run.csv"', "", r"number 1 lacks the field `file`"),
    "a missing file": ("run.csv", "rum.csv", r"rum\.csv does not exist.*did you mean `run.csv`"),
    "an unknown ending": ('"run.csv"', '"campaign.toml"', r'unknown ending "\.toml"; expected one of \.csv'),
    "a missing column": ('column = "force"', 'column = "forc"', r"no column `forc`; it has `time`, `force`"),
    "an unknown direction": (RECORD, RECORD + '\ndirection = "up"', r"direction = 'up' must be one of"),
    "a start that is a fraction": (RECORD, RECORD + "\nstart = 1.5", r"start = 1.5 must be a whole number"),
    "a negative start": (RECORD, RECORD + "\nstart = -1", r"start = -1 must be a whole number, at least 0"),
    "a start outside the file": (
        RECORD,
        RECORD + "\nstart = 2000",
        r"start = 2000 lies outside .* 2000 samples",
    ),
    "a stop outside the file": (RECORD, RECORD + "\nstop = 2001", r"stop = 2001 lies outside .*run\.csv"),
    "a stop before the start": (
        RECORD,
        RECORD + "\nstart = 90\nstop = 50",
        r"stop = 50 must be above start = 90",
    ),
    "too few samples": (RECORD, RECORD + "\nstop = 5", r"covers 5 samples"),
    "a settle beyond the record": (
        RECORD,
        RECORD + "\nsettle = 2000",
        r"settle = 2000 must be below .* 2000",
    ),
    "a period beyond the record": (
        RECORD,
        RECORD + "\nperiod = 2001",
        r"period = 2001 exceeds .* 2000 samples",
    ),
    "a missing schedule": (
        RECORD,
        RECORD + '\nschedule = "no.csv"',
        r"no\.csv does not exist; it is the schedule",
    ),
    "an unknown kind": (
        RECORD,
        RECORD + '\nkind = "free decay"',
        r"number 1 kind = 'free decay' must be one of .*; did you mean `free_decay`",
    ),
    "a kind against a period": (
        RECORD,
        RECORD + '\nperiod = 100\nkind = "swept"',
        r'number 1 has kind = "swept" and a period; .* is of kind "periodic"',
    ),
    "a kind that needs a period": (
        RECORD,
        RECORD + '\nkind = "periodic"',
        r'kind = "periodic", but lacks the field `period`',
    ),
    "a folder for a file": ('"run.csv"', '"."', r"file = '\.' must be the name of a file"),
    "a folder that is there": ('"run.csv"', '"inner"', r"inner is a folder; expected one file on a disk"),
    "a pressure below vacuum": (
        RECORD,
        RECORD + "\npressure = -2e4",
        r"\[\[record\]\] number 1 pressure = -20000.0 must be a finite number above 0",
    ),
    "a pressure that one record lacks": (
        RECORD,
        f'{RECORD}\npressure = 2e5\nstop = 900\n[[record]]\nfile = "run.csv"\nstart = 900\n{RECORD}',
        r'\[\[record\]\] number 2, file = "run.csv", lacks `pressure`, but number 1 has pressure = 200000',
    ),
    "a law that follows a pressure that none states": (
        r'\["linear"\]',
        '["linear", "pressure"]',
        r"\[model\] names `pressure_stiffness`, .* `pressure` must differ .* none states it",
    ),
    "a temperature that never changes": (
        r'\["linear"\](.|\n)*role = "fit"',
        f'["linear", "temperature"]\n[[record]]\nfile = "run.csv"\n{RECORD}\ntemperature = 300',
        r"`temperature_stiffness`, .* `temperature` must differ .* of each it is 300",
    ),
    "text for a level": (RECORD, RECORD + '\nlevel = "60 N"', r"level = '60 N' must be a finite number"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_in_the_toml_is_named(mistake: str, tiny: Callable[..., Path]) -> None:
    pattern, replacement, message = MISTAKES[mistake]
    folder = tiny((pattern, replacement))
    (folder / "inner").mkdir()
    with pytest.raises(ValueError, match=message) as caught:
        read_campaign(folder)
    assert str(folder) in str(caught.value)


def test_the_tiny_campaign_itself_is_read(tiny: Callable[..., Path]) -> None:
    assert read_campaign(tiny()).records[0].output.shape == (2000,)


def test_broken_toml_names_the_file_and_the_line(tiny: Callable[..., Path]) -> None:
    with pytest.raises(ValueError, match=r"campaign\.toml is not valid TOML: .*line 3"):
        read_campaign(tiny(("mass = 2.0", "mass = ")))


def test_the_toml_is_parsed_once(tiny: Callable[..., Path], monkeypatch: pytest.MonkeyPatch) -> None:
    parse, texts = tomllib.loads, []
    monkeypatch.setattr(tomllib, "loads", lambda text: texts.append(text) or parse(text))
    read_campaign(tiny())
    assert len(texts) == 1


@pytest.mark.parametrize(
    ("content", "message"),
    [(b"", "is empty"), (b"\xff\xfe[campaign]", "is not UTF-8")],
)
def test_a_file_that_is_no_text_is_refused(content: bytes, message: str, tmp_path: Path) -> None:
    (tmp_path / "campaign.toml").write_bytes(content)
    with pytest.raises(ValueError, match=message):
        read_campaign(tmp_path)


def test_a_folder_without_campaign_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"campaign\.toml does not exist"):
        read_campaign(tmp_path)


@pytest.mark.parametrize(
    ("first", "second"),
    [("", ""), ("stop = 1200", "start = 1000"), ("stop = 1200", "start = 1150\nsettle = 20")],
)
def test_held_out_samples_that_are_also_fitted_are_refused(
    first: str, second: str, tiny: Callable[..., Path]
) -> None:
    more = f'role = "fit"\n{first}\n[[record]]\nfile = "run.csv"\nrole = "holdout"\n{second}\n'
    with pytest.raises(ValueError, match=r"number 1 and number 2 share samples .*held-out samples must not"):
        read_campaign(tiny((RECORD, more)))


def test_a_copy_of_a_fitted_file_is_no_held_out_record(tiny: Callable[..., Path]) -> None:
    more = 'role = "fit"\n[[record]]\nfile = "copy.csv"\nrole = "holdout"\n'
    folder = tiny((RECORD, more))
    home = folder if folder.is_dir() else folder.parent
    shutil.copy(home / "run.csv", home / "copy.csv")
    with pytest.raises(ValueError, match=r"number 1 and number 2 share samples .*held-out samples must not"):
        read_campaign(folder)


def test_a_fit_must_not_set_its_state_from_held_out_samples(tiny: Callable[..., Path]) -> None:
    more = (
        f'{RECORD}\nstart = 900\nsettle = 100\n[[record]]\nfile = "run.csv"\nrole = "holdout"\nstop = 950\n'
    )
    with pytest.raises(ValueError, match=r"share samples 900:950"):
        read_campaign(tiny((RECORD, more)))


def test_samples_that_would_count_twice_are_refused(tiny: Callable[..., Path]) -> None:
    with pytest.raises(ValueError, match="each sample may count only once"):
        read_campaign(tiny((RECORD, f'{RECORD}\n[[record]]\nfile = "run.csv"\n{RECORD}\n')))


def test_settle_samples_of_a_held_out_record_may_be_fitted_ones(tiny: Callable[..., Path]) -> None:
    more = (
        f'{RECORD}\nstop = 1000\n[[record]]\nfile = "run.csv"\nrole = "holdout"\nstart = 950\nsettle = 50\n'
    )
    campaign = read_campaign(tiny((RECORD, more)))
    assert [record.name for record in campaign.records] == ["run[0:1000]", "run[950:]"]
    assert [record.role for record in campaign.records] == ["fit", "holdout"]


@pytest.mark.parametrize("kind", ["swept", "free_decay", "impulse", "broadband"])
def test_a_declared_kind_goes_before_the_detected_one(kind: str, tiny: Callable[..., Path]) -> None:
    record = read_campaign(tiny((RECORD, f'{RECORD}\nkind = "{kind}"'))).records[0]
    assert record.kind == kind
    assert np.any(record.raw_input)
    assert np.any(record.input) == (kind != "free_decay")
