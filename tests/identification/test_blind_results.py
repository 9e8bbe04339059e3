"""The blind trial's rows that are kept, and what docs/validation.md says of them."""

import re
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
from _trial_effects import COMMONEST
from _trial_judge import coverage_markdown, markdown
from blind_trial import key, read

ROOT = Path(__file__).parents[2]
RESULTS = ROOT / "benchmarks" / "results"
KEPT = ("blind_trial", "coverage", "left_out")


@pytest.fixture(scope="module")
def rows():
    return [row for name in KEPT for row in read(RESULTS / f"{name}.jsonl")]


def test_every_campaign_is_there_once_and_none_failed(rows):
    loops = [row for row in rows if row["task"] == "loop"]
    left = [row for row in rows if row["task"] == "leave_out"]
    assert sorted(row["seed"] for row in loops) == list(range(15960, 16160))
    assert sorted(row["seed"] for row in left) == sorted(r["seed"] for r in loops if r["kind"] == "one")
    assert len({key(row) for row in rows}) == len(rows)
    assert not [row["error"] for row in rows if "error" in row]
    assert len({row["commit"] for row in loops}) == 1
    assert not any("dirty" in row["commit"] for row in rows)


def test_a_hundred_repeats_of_each_common_effect_are_there(rows):
    repeats = [row for row in rows if row["task"] == "coverage"]
    assert sorted((row["seed"], *row["names"]) for row in repeats) == sorted(
        (100_000 + repeat, name) for repeat in range(100) for name in COMMONEST
    )
    assert len({row["commit"] for row in repeats}) == 1
    assert all(row["oracle_converged"] for row in repeats)


def table_below(head):
    text = (ROOT / "docs" / "validation.md").read_text(encoding="utf-8")
    _, _, rest = text.partition("\n".join(head) + "\n")
    table = re.match(r"(?:\|.*\n)+", rest)
    assert table, f"docs/validation.md lacks the table of {head[0]}"
    return table.group().splitlines()


def test_the_coverage_of_the_page_is_what_the_rows_give(rows):
    given = coverage_markdown([row for row in rows if row["task"] == "coverage"])
    assert table_below(given[:2]) == given[2:]
    assert len(given) == 2 + len(COMMONEST) + 1


def test_the_table_of_the_page_is_what_the_rows_give(rows):
    given = markdown([row for row in rows if row["task"] in ("loop", "leave_out")])
    lines = table_below(given[:2])
    assert len(lines) >= 12
    assert [line for line in lines if line not in given] == []
    assert [line for line in given if "**missed**" in line and line not in lines] == []
