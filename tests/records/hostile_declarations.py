"""Declarations that should be refused, and what the refusal must say: numbers, units, names, structure."""

import functools
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from tiny_campaign import TINY, tiny_channels, write_csv

from isojax._read_campaign import read_campaign

Case = tuple[Callable[[Path], Callable[[], object]], str | None]
"""Writes the input into a folder and gives what reads it; what is said of it, None where it is right."""

INPUT, MODEL, RECORD = 'unit = "N"', "[model]", 'role = "fit"'
OUTPUT, RATE, MASS = 'unit = "m/s^2"', "rate = 200.0", "mass = 2.0"


@functools.cache
def right_table() -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        write_csv(Path(folder) / "run.csv", tiny_channels())
        return (Path(folder) / "run.csv").read_bytes()


def toml(text: str | bytes, said: str | None) -> Case:
    """A campaign.toml beside a right data file."""

    def write(folder: Path) -> Callable[[], object]:
        (folder / "campaign.toml").write_bytes(text if isinstance(text, bytes) else text.encode())
        (folder / "run.csv").write_bytes(right_table())
        return lambda: read_campaign(folder)

    return write, said


def after(place: str, more: str, said: str | None) -> Case:
    assert TINY.count(place) == 1
    return toml(TINY.replace(place, f"{place}\n{more}"), said)


def instead(place: str, new: str, said: str | None) -> Case:
    assert TINY.count(place) == 1
    return toml(TINY.replace(place, new), said)


def given(change: Callable[[dict[str, Any]], Any], said: str | None, data: Any = None) -> Case:
    """A declaration in memory."""

    def write(_: Path) -> Callable[[], object]:
        declared: dict[str, Any] = {
            "campaign": {"mass": 2.0},
            "input": {"quantity": "force", "column": "force", "unit": "N"},
            "output": {"quantity": "acceleration", "column": "acceleration", "unit": "g"},
            "sampling": {"rate": 200.0},
            "record": [{"file": "run", "role": "fit"}],
        }
        changed = change(declared)
        held = {"run": tiny_channels()} if data is None else data()
        return lambda: read_campaign(declared if changed is None else changed, data=held)

    return write, said


def set_in(section: str, field: Any, value: Any) -> Callable[[dict[str, Any]], None]:
    return lambda declared: declared[section].update({field: value})


def within_itself(declared: dict[str, Any]) -> None:
    declared["campaign"]["title"] = declared


def filtered(order: object, cutoff: object, rest: str = "applied = false") -> str:
    return f"[filter]\norder = {order}\ncutoff_hz = {cutoff}\n{rest}\n{MODEL}"


class Odd:
    """What raises when it is shown."""

    def __repr__(self) -> str:
        raise RuntimeError


HUGE = "9" * 400
NUMBERS: Mapping[str, tuple[str, str, tuple[str, ...]]] = {
    "mass": (MASS, "mass = {}", ("1e300", "1e-300", "-1e10", "inf", "nan", HUGE, "0x" + "f" * 100_000)),
    "gain": (INPUT, INPUT + "\ngain = {}", ("1e308", "-1e308", "1e-308", "5e-324", "inf", "-nan", HUGE, "0")),
    "rate": (RATE, "rate = {}", ("1e300", "1e-300", "0.0", "-inf", HUGE)),
    "noise": (OUTPUT, OUTPUT + "\nnoise = {}", ("1e308", "1e-308", "inf")),
    "accuracy": (OUTPUT, OUTPUT + "\naccuracy = {}", ("1e9", "1e-300")),
    "order": (MODEL, filtered("{}", 20), ("1000000000", "21", "0", "-3", "2.0", "true", HUGE)),
    "cutoff_hz": (MODEL, filtered(4, "{}"), ("1e300", "1e-300", "nan", HUGE)),
    "level": (RECORD, RECORD + "\nlevel = {}", ("1e308", "inf", HUGE)),
    "pressure": (RECORD, RECORD + "\npressure = {}", ("1e300", "5e-324")),
    "temperature": (RECORD, RECORD + "\ntemperature = {}", ("1e300", "-0.0")),
    "start": (RECORD, RECORD + "\nstart = {}", (HUGE, "-1", "0.5")),
    "stop": (RECORD, RECORD + "\nstop = {}", (HUGE,)),
    "period": (RECORD, RECORD + "\nperiod = {}", (HUGE, "1")),
    "settle": (RECORD, RECORD + "\nsettle = {}", (HUGE,)),
    "repeat": (RECORD, RECORD + "\nrepeat = {}", (HUGE,)),
}
UNITS = (
    *(
        "N**9**9**9",
        "N^9^9^9",
        "N**-9**9**9",
        "(N**9**9)**9",
        "9**9**9",
        "N**99999999",
        "N^1e9",
        "N**(9**9**9)",
    ),
    *("kN" * 2500, "(" * 5000, "(" * 30 + "N" + ")" * 30, "N*" * 3000 + "N", "a  " * 21 + "!", "(a*" * 21),
    *("YN", "qN", "N**9", "N/0", "0*N", "1e308*N", "nan", "inf", "-N", "N.__class__", "__import__('os')"),
    *("degC", "dBm", "\\u202eN", "N\\u0000", "\U0001f525", "²", "N²²²", "N^²", "%%%%", "1/1/1"),
)

CASES: dict[str, Case] = {
    f"{field} = {value:.12}": instead(
        place, text.format(value), rf"{field} = .* must be a (finite|whole) number"
    )
    for field, (place, text, values) in NUMBERS.items()
    for value in values
}
CASES |= {
    f"unit {i}: {unit:.20}": instead(
        INPUT, f'unit = "{unit}"', "unit = .* (is not a unit|not measure|at most 500)"
    )
    for i, unit in enumerate(UNITS)
}
CASES |= {
    "a filter that rounding spoils": instead(
        MODEL, filtered(20, 1e-6), "number 1: the .filter. cannot be comp"
    ),
    "a filter taken out that rounding spoils": instead(
        MODEL, filtered(20, 1e-3, "compensate = true"), "number 1 is too short"
    ),
    "an order of twenty": instead(MODEL, filtered(20, 20.0), None),
    "brackets in brackets": after(
        MASS, "title = " + "[" * 100_000, "not valid TOML: brackets within brackets"
    ),
    "closed brackets": after(
        MASS, f"title = {'[' * 40_000}{']' * 40_000}", "not valid TOML: brackets within"
    ),
    "tables in tables": after(MASS, "title = " + "{a=" * 50_000, "not valid TOML: brackets within brackets"),
    "lists of few levels": after(
        RECORD, f"level = {'[' * 50}{']' * 50}", "level = .* must be a finite number"
    ),
    "a dotted key": after(MASS, "a." * 100_000 + "a = 1", "points; expected a field"),
    "a dotted heading": after(MASS, f"[{'a.' * 100_000}a]", "points; expected a field"),
    "a dotted key in quotes": after(MASS, '"a" . ' * 60_000 + "a = 1", "points; expected a field"),
    "100,000 records": toml(
        TINY + '[[record]]\nfile = "run.csv"\nrole = "fit"\n' * 100_000, "bytes; expected a"
    ),
    "5,000 records": toml(
        TINY + '[[record]]\nfile = "run.csv"\nrole = "fit"\n' * 5000, "5001 .*at most 1000"
    ),
    "10,000 sections": toml(TINY + "".join(f"[s{i}]\n" for i in range(10_000)), "unknown section `s0`"),
    "megabytes of remarks": toml(TINY + "#" * 3_000_000, "bytes; expected a campaign .toml of at most"),
    "a title of a book": instead('"tiny"', f'"{"x" * 900_000}"', "title = .* must be a text .* at most 500"),
    "a whole number of 5,000 digits": instead(MASS, "mass = " + "9" * 5000, "not valid TOML"),
    "a date for a mass": instead(MASS, "mass = 1979-05-27T07:32:00Z", "mass = .* must be a finite number"),
    "an impossible date": instead(MASS, "mass = 1979-99-99", "not valid TOML"),
    "a field of 5,000 letters": after(MASS, "x" * 5000 + " = 1", "unknown field `x+`"),
    "a section of 5,000 letters": toml(TINY + f"[{'x' * 5000}]\n", "unknown section `x+`"),
    "a file of 5,000 letters": instead("run.csv", "x" * 5000, "file = .* must be the name of a file"),
    "a file of 400 letters": instead("run.csv", "x" * 400 + ".csv", "does not exist"),
    "a file with a zero byte": instead("run.csv", "run\\u0000.csv", "does not exist"),
    "a schedule of 400 letters": after(
        RECORD, f'schedule = "{"x" * 400}"', "does not exist; it is the schedule"
    ),
    "a column of 5,000 letters": instead('column = "force"', f'column = "{"x" * 5000}"', "must be a text"),
    "a column of indices": instead('column = "force"', f'column = "{"[1" * 240}"', "has no column"),
    "an effect of 5,000 letters": instead(
        MODEL, f'{MODEL}\nelements = ["{"x" * 5000}"]', "must be a list of"
    ),
    "an effect of 400 letters": instead(
        MODEL, f'{MODEL}\nelements = ["{"x" * 400}"]', "must name effects of"
    ),
    "an effect by its path": instead(
        MODEL, f'{MODEL}\nelements = ["/../../etc/passwd"]', "must name effects"
    ),
    "10,000 effects": instead(
        MODEL, f"{MODEL}\nelements = {[str(i) for i in range(10_000)]}", "must be a list of different names"
    ),
    "an effect under two names": instead(
        'stiffness = ["linear"]',
        'stiffness = ["cubic", "cubic_stiffness"]',
        "`cubic_stiffness` is named already",
    ),
    "an effect in two lists": instead(MODEL, f'{MODEL}\nelements = ["linear_damping"]', "is named already"),
    "bytes that are no text": toml(bytes(range(256)), "is not UTF-8 text"),
    "zero bytes": toml(bytes(1000), "not valid TOML"),
    "a mark of byte order alone": toml(b"\xef\xbb\xbf", "is empty"),
    "a declaration within itself": given(within_itself, "cannot be read as a declaration"),
    "a field that is a number": given(set_in("campaign", 1, 2), "unknown field `1`"),
    "a section that is a number": given(lambda one: one.__setitem__(3, {}), "unknown section `3`"),
    "an array for a mass": given(set_in("campaign", "mass", np.ones(3)), "mass = .* must be a finite number"),
    "an array for a choice": given(set_in("input", "quantity", np.ones(3)), "quantity = .* must be one of"),
    "a list for a choice": given(set_in("input", "hold", [[]]), "hold = .* must be one of"),
    "an object that cannot be shown": given(set_in("campaign", "mass", Odd()), "mass = <Odd> must be"),
    "bytes for a title": given(set_in("campaign", "title", b"x"), "title = .* must be a text"),
    "a half letter for a file": given(
        lambda one: one["record"][0].update(file="\ud800"), "`data` has `run` only"
    ),
    "records that are texts": given(lambda one: one.update(record=["run"]), "must be one table of fields"),
    "no declaration": given(lambda _: 5, "Argument `source` must be a path or a mapping"),
}


def spoilt(samples: object) -> Callable[[], Any]:
    """Data in memory of which the force is spoilt."""
    return lambda: {"run": {**tiny_channels(), "force": samples() if callable(samples) else samples}}


def listed(**fields: object) -> Callable[[], Any]:
    """Channels as SEP 005 lists them, of which both have the same fields."""
    channels = [{"name": name, "data": samples, **fields} for name, samples in tiny_channels().items()]
    return lambda: {"run": channels[1:]}


def unchanged(_: dict[str, Any]) -> None:
    """Leaves a declaration as it is."""


def endless() -> dict[str, Any]:
    held: dict[str, Any] = {}
    held["force"] = held
    return {"run": held}


CASES |= {
    "samples of 1e300": given(
        unchanged, "column `force` is 1e.300 .*at most 1e.30", spoilt(np.full(2000, 1e300))
    ),
    "samples of 1e-200": given(
        unchanged, "column `force` is constant", spoilt(lambda: 1e-200 * tiny_channels()["force"] + 1e-190)
    ),
    "a gain on large samples": given(
        set_in("input", "gain", 1e15), "at most 1e.30", spoilt(lambda: 1e20 * tiny_channels()["force"])
    ),
    "a number seen 1e11 times": given(
        unchanged, "to read it takes 745 GiB", spoilt(lambda: np.broadcast_to(np.float32(1), 10**11))
    ),
    "rows of different length": given(unchanged, "run cannot be read as data", spoilt([[1.0], [1.0, 2.0]])),
    "an array of objects": given(unchanged, "holds objects", spoilt(np.array([Odd(), Odd()]))),
    "an object": given(unchanged, "column `force`", spoilt(Odd())),
    "a mapping within itself": given(unchanged, "run cannot be read as data", endless),
    "complex samples": given(unchanged, "holds complex", spoilt(np.ones(2000) * 1j)),
    "a rate of nothing": given(unchanged, "states a rate of nan", listed(fs=np.nan)),
    "a negative rate": given(unchanged, "states a rate of -5", listed(fs=-5.0)),
    "an endless rate": given(unchanged, "states a rate of inf", listed(fs=np.inf)),
    "a rate in words": given(unchanged, "run cannot be read as data", listed(fs="fast")),
    "times of 1e300": given(
        unchanged, "time column .* is .*; it must be finite", listed(time=1e300 * tiny_channels()["time"])
    ),
    "data that are no mapping": given(unchanged, "Argument `data` must", lambda: [1, 2]),
    "data of another kind": given(unchanged, "of the type int cannot be read", lambda: {"run": 5}),
}
