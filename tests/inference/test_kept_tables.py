"""Tables of docs/validation.md, compared with the kept rows of the scripts that print them."""

import contextlib
import importlib
import json
import re
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "benchmarks"))


@pytest.fixture(scope="module")
def page() -> str:
    return (ROOT / "docs" / "validation.md").read_text(encoding="utf-8")


def report_of(name: str, capsys: pytest.CaptureFixture, file: str = "") -> list[str]:
    """Print what a script says of its kept rows, or of those in another file; a missed mark exits."""
    script = importlib.import_module(name)
    kept = script.RESULTS.with_name(file) if file else script.RESULTS
    rows = [json.loads(line) for line in kept.read_text(encoding="utf-8").splitlines()]
    with contextlib.suppress(SystemExit):
        script.report(rows)
    return capsys.readouterr().out.splitlines()


def test_intervals_from_few_records_are_those_of_the_rows(page, capsys):
    printed = report_of("covered", capsys)
    judged = [line.replace("| all ", "", 1) for line in printed if line.startswith("| all ")]
    chances = [line for line in printed if re.match(r"\| \d\.\d\d to ", line)]
    assert (len(judged), len(chances)) == (9, 7)
    for line in (*judged, *chances):
        assert line in page.splitlines()


def test_intervals_of_later_rigs_are_those_of_the_rows(page, capsys):
    printed = report_of("covered", capsys, "intervals_later.jsonl")
    judged = [line.replace("| all ", "", 1) for line in printed if line.startswith("| all ")]
    assert len(judged) == 9
    table = page[page.index("**Later rigs.**") :]
    assert all(line in table.splitlines() for line in judged)


def test_shrinkage_by_the_next_record_is_that_of_the_rows(page, capsys):
    figure = r"(\d\.\d{3})"
    printed = "\n".join(report_of("next_test", capsys))
    found = re.findall(rf"50 refits: predicted {figure}, found {figure}, ratio {figure} ", printed)
    table = page[page.index("## The next record") :]
    assert re.findall(rf"\| {figure} \| {figure} \| {figure}", table)[:9] == found
    assert len(found) == 9


def test_effects_of_the_pressure_are_those_of_the_rows(page, capsys):
    printed = "\n".join(report_of("pressure", capsys))
    table = page[page.index("## Coefficients that follow the pressure") :]
    for words in ("found where it is", "not found where it is not", "named alone, not in a set"):
        (said,) = re.findall(rf"{words}:? (\d+ of \d+)", printed)
        assert f"| {words} | {said} |" in table
    share, count, rms = re.findall(r"of the truth: (\d\.\d\d) of (\d+), rms (\d\.\d\d)", printed)[0]
    assert f"| {share} of {count}, rms {rms} standard errors |" in table
