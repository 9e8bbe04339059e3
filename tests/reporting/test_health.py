"""Data health on the page: the words say what the numbers say."""

import json
import math

import numpy as np
import pytest

from isojax import plot
from isojax.health import DwellStability
from isojax.identification import DriftBudget, Share
from isojax.records import Dwell, HumLine, MainsCollision
from isojax.reporting import ClosedLoop
from isojax.reporting.words._health_words import budget_words, dwell_words, mains_words


def dwell(frequency, radius, force=math.inf, shift=math.inf, reason="", level=100.0):
    where = Dwell(0, 1000, frequency, 20.0)
    return DwellStability("up", level, where, 150.0, radius, force, shift, reason)


LOST = dwell(4.6, math.nan, math.nan, math.nan, "the dwell is not driven")


def test_the_nearest_dwell_is_named_with_force_frequency_and_settling_time():
    lines = dwell_words([dwell(4.0, 0.5), dwell(4.4, 0.9, 1.5, -0.021), dwell(4.5, 0.8, -20.0, 0.1)], "force")
    assert len(lines) == 2
    assert (
        "1.5 N (1.00 % of the drive) or 0.021 Hz from up at 4.40 Hz; 1 of 3 dwells are within 5 %" in lines[0]
    )
    # ln(100) / -ln(0.9) = 43.7
    assert "at most 0.900 (up at 4.40 Hz): there a disturbance decays to 1 % in 44 cycles" in lines[1]


def test_a_fold_that_only_the_frequency_reaches_is_named_too():
    lines = dwell_words([dwell(4.0, 0.5), dwell(4.4, 0.6, math.inf, 0.3)], "force")
    assert "is 0.30 Hz from up at 4.40 Hz" in lines[0]


def test_no_fold_within_reach_is_said():
    assert "no dwell has a fold" in dwell_words([dwell(4.0, 0.5)], "force")[0]


def test_unstable_and_lost_dwells_are_counted():
    lines = dwell_words([dwell(4.0, 1.02, 0.1, 0.1), LOST], "force")
    assert "by the model 1 of the measured dwells are unstable" in lines[1]
    assert lines[2] == "1 of 2 dwells left out (for example up at 4.60 Hz): the dwell is not driven."
    assert dwell_words([], "force") == ()


def test_repeatability_of_a_finding_is_one_sentence_in_its_unit(found):
    name = "coulomb_friction.force_level"
    budget = DriftBudget(2e-3, (Share(name, "N", 3.98, 0.05, 0.04, 0.03, 0.41),))
    lines = budget_words(budget, found.after, found.findings)
    assert len(lines) == 1
    for words in ("to ± 0.030 N", "noise alone to ± 0.040 N", "0.200 % between records", "± 0.41 N"):
        assert words in lines[0]
    assert budget_words(DriftBudget(math.nan, ()), found.after, found.findings) == ()


@pytest.mark.parametrize("what", ["multiplier", "fold"])
def test_pictures_leave_out_what_is_not_known(what):
    figure = plot.dwell_stability([dwell(4.0, 0.5), dwell(4.4, 0.9, 1.5, 0.02, level=None), LOST], what=what)
    (ax,) = figure.axes
    drawn = [line for line in ax.lines if line.get_marker() == "o"]
    assert [list(line.get_xdata()) for line in drawn] == [[4.0], [4.4]]
    if what == "multiplier":
        assert [float(line.get_ydata()[0]) for line in drawn] == [0.5, 0.9]
    else:
        assert float(drawn[1].get_ydata()[0]) == pytest.approx(1.0)
        assert float(drawn[0].get_ydata()[0]) > 30.0


@pytest.mark.slow
def test_page_and_result_hold_the_health_of_the_campaign(written, found):
    page = (written / "report.html").read_text(encoding="utf-8")
    for words in ("Drift budget", "By the fitted model", "Repeatability limits dry (Coulomb) friction"):
        assert words in page
    health = json.loads((written / "result.json").read_text(encoding="utf-8"))["health"]
    count = sum(len(record.dwells) for record in found.campaign.records)
    assert len(health["dwells"]) == count
    assert set(health["repeatability"]) == set(found.after.free)
    for entry in health["dwells"]:
        assert entry["reason"] or 0.0 < entry["spectral_radius"] < 1.0


def test_parts_of_every_error_bar_add_up(found):
    loop = ClosedLoop(found)
    assert loop.health is loop.health
    errors = found.after.standard_errors
    for share in loop.health.budget.shares:
        assert np.hypot(share.noise, share.repeatability) == pytest.approx(errors[share.name])


def test_hum_and_where_it_hides_is_told(found):
    loop = ClosedLoop(found)
    collision = MainsCollision("up", Dwell(0, 4000, 5.0, 20.0), 10, 50.0)
    health = loop.health._replace(hum=(), collisions=(collision, collision))
    (hidden,) = mains_words(health, "m/s^2")
    assert hidden.endswith("where it could hide: dwell at 5.00 Hz: harmonic 10 falls on 50 Hz.")
    health = health._replace(hum=(HumLine("up", 50.0, 0.0123), HumLine("down", 50.0, 0.01)))
    seen, masked = mains_words(health, "m/s^2")
    assert "at 50 Hz in 2 records, up to 0.012 m/s²" in seen
    assert masked.endswith("dwell at 5.00 Hz: harmonic 10 falls on 50 Hz.")
    assert mains_words(health._replace(hum=(), collisions=()), "m/s^2") == ()
