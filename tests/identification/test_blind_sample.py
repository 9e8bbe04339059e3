"""A small sample of the blind trial, which the diagnosis must pass."""

import sys
from pathlib import Path

import jax
import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
from _trial_judge import table
from _trial_run import crowded, run_one

SAMPLE = dict.fromkeys((1000, 1004), "none") | dict.fromkeys((1003, 1009, 1013, 1015), "one")
SAMPLE |= {1017: "outside", 1018: "two"}


def _mark(rows, criterion):
    return next(mark for mark in table(rows) if mark.criterion.startswith(criterion))


@pytest.mark.slow
def test_a_small_sample_is_judged_right():
    """Eight campaigns: too few for the marks of the whole trial, enough to see that nothing is broken."""
    rows = []
    for seed, kind in SAMPLE.items():
        rows.append(run_one(seed, kind, "loop"))
        if crowded():
            jax.clear_caches()
    assert not [row["error"] for row in rows if "error" in row]
    false, right = _mark(rows, "an effect named"), _mark(rows, "right family")
    assert false.interval[0] <= 0.05, false.failing
    assert right.judged >= 4
    assert right.figure >= 0.75, right.failing
    two, outside = _mark(rows, "two effects"), _mark(rows, "outside")
    assert (two.judged, outside.judged) == (1, 1)
    assert two.figure == 1.0, two.failing
    assert outside.figure == 1.0, outside.failing
    assert _mark(rows, "inadmissible sign").passed


@pytest.mark.slow
def test_records_are_restarted_on_the_branch_that_the_fit_is_on():
    """Beside a fold a dwell goes to the other branch from its measured state alone: chi2/dof 1.09."""
    row = run_one(2197, "none", "loop")
    assert row["verdict"] == "none"
    assert row["before"]["fit"] == pytest.approx(1.0, abs=0.05)
