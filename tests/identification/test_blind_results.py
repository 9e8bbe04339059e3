"""The blind trial's rows that are kept, and what the README says of them."""

import re
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
from _trial_judge import markdown
from blind_trial import key, read

ROOT = Path(__file__).parents[2]
RESULTS = ROOT / "benchmarks" / "results"


@pytest.fixture(scope="module")
def rows():
    return [row for path in sorted(RESULTS.glob("*.jsonl")) for row in read(path)]


def test_every_campaign_is_there_once_and_none_failed(rows):
    loops = [row for row in rows if row["task"] == "loop"]
    left = [row for row in rows if row["task"] == "leave_out"]
    assert sorted(row["seed"] for row in loops) == list(range(2000, 2200))
    assert sorted(row["seed"] for row in left) == sorted(r["seed"] for r in loops if r["kind"] == "one")
    assert len({key(row) for row in rows}) == len(rows)
    assert not [row["error"] for row in rows if "error" in row]
    assert len({row["commit"] for row in loops}) == 1
    assert not any("dirty" in row["commit"] for row in rows)


def test_the_table_of_the_readme_is_what_the_rows_give(rows):
    given = markdown([row for row in rows if row["task"] in ("loop", "leave_out")])
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    _, _, rest = text.partition(given[0] + "\n" + given[1] + "\n")
    told = re.match(r"(?:\|.*\n)+", rest)
    assert told, "README lacks the table of the blind trial"
    lines = told.group().splitlines()
    assert len(lines) >= 12
    assert [line for line in lines if line not in given] == []
    assert [line for line in given if "**missed**" in line and line not in lines] == []
