"""A small sample of the blind trial, which the diagnosis must pass."""

import sys
from pathlib import Path

import jax
import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
from _trial_judge import table
from _trial_run import crowded, run_one

SAMPLE = {2197: "none", 12036: "one", 12042: "outside"}


@pytest.fixture(scope="module")
def rows():
    """What the trial says of the sample, by seed."""
    judged = {}
    for seed, kind in SAMPLE.items():
        judged[seed] = run_one(seed, kind, "loop")
        if crowded():
            jax.clear_caches()
    return judged


def _mark(rows, criterion):
    return next(mark for mark in table(rows) if mark.criterion.startswith(criterion))


@pytest.mark.slow
def test_a_small_sample_is_judged_right(rows):
    """Three campaigns: too few for the marks of the whole trial, enough to see that nothing is broken.

    Two effects at once are found in `test_imitations.py`.
    """
    rows = list(rows.values())
    assert not [row["error"] for row in rows if "error" in row]
    judged = {
        "an effect named": (1, 0.0),
        "right family": (1, 1.0),
        "outside": (1, 1.0),
    }
    for criterion, (count, figure) in judged.items():
        mark = _mark(rows, criterion)
        assert (mark.judged, mark.figure) == (count, figure), mark.failing
    assert _mark(rows, "inadmissible sign").passed


@pytest.mark.slow
def test_records_are_restarted_on_the_branch_that_the_fit_is_on(rows):
    """Beside a fold a dwell goes to the other branch from its measured state alone: chi2/dof 1.09."""
    row = rows[2197]
    assert row["verdict"] == "none"
    assert row["before"]["fit"] == pytest.approx(1.0, abs=0.05)
