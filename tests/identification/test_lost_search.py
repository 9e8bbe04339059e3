"""A search whose initial states ran away: it goes on from the measured ones."""

import sys
from pathlib import Path

import pytest

import isojax as ij
from isojax._results import is_successful
from isojax.identification import classical_guess, read_campaign

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
from _trial_campaign import sketch
from _trial_run import simulated as filed


@pytest.mark.slow
def test_a_search_whose_states_run_away_goes_on_from_the_measured_ones(tmp_path):
    """Of a spring that softens beyond its declared law the steps of the states lead where motions escape."""
    _, folder, _ = filed(sketch(12189, "two"), tmp_path)
    campaign = read_campaign(folder)
    lines: list[str] = []
    fitted = ij.fit(classical_guess(campaign), campaign, progress=lines.append)
    assert is_successful(fitted.result)
    assert any("measured states" in line for line in lines)
    assert fitted.errors["fit"].chi2_per_dof < 1.3
