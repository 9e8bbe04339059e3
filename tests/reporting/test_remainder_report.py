"""The section "Unexplained residual", on the demo's dry friction treated as if no effect explained it."""

import dataclasses
import json
import re

import pytest
from matplotlib.figure import Figure

from isojax import plot
from isojax.reporting import loop_summary, render_page, render_text, result_dict

LAW = {"formula", "coefficient", "standard_error", "unit", "share", "alike", "z"}


@pytest.fixture(scope="module")
def unexplained(found):
    """The loop before friction was added, as if nothing had been found."""
    verdict = found.last._replace(verdict="unexplained", bounds={}, reason="Nothing explains it.")
    return dataclasses.replace(
        found, extensions=(), after=found.before, verdict="unexplained", last=verdict, bounds={}
    )


@pytest.mark.slow
def test_the_residual_is_described_once(unexplained):
    first = unexplained.remainder
    assert first is not None
    assert unexplained.remainder is first


@pytest.mark.slow
def test_nothing_is_described_where_the_verdict_is_another(found, written):
    assert found.remainder is None
    assert "Unexplained residual" not in (written / "report.html").read_text(encoding="utf-8")
    assert "remainder" not in result_dict(found)


def test_dry_friction_is_described_as_a_force_that_opposes_the_velocity(unexplained):
    remainder = unexplained.remainder
    assert remainder is not None
    first = remainder.pursuit.laws[0]
    assert "sgn(v)" in (first.formula, *first.alike)
    assert first.coefficient > 0.0


@pytest.mark.slow
def test_the_page_has_the_section_with_its_pictures(unexplained):
    page = render_page(unexplained)
    sentence = page.partition('<h2 id="residual">Unexplained residual</h2>')[2].partition("<h2")[0]
    assert "no finding" in sentence
    assert re.search(r"selected from \d+ free laws, would explain [\d.]+ % of it", sentence)
    detail = page.partition('id="residual-detail"')[2].partition("</details>")[0]
    assert detail.count("data:image/png;base64,") == 4
    assert "<details open>" in page


def test_the_terminal_says_it_in_a_few_lines(unexplained):
    text = render_text(loop_summary(unexplained))
    assert "Unexplained residual: A force" in text


def test_result_holds_the_same_facts(unexplained):
    result = json.loads(json.dumps(result_dict(unexplained), allow_nan=False))
    left = result["remainder"]
    assert all(set(law) == LAW for law in left["laws"])
    assert len(left["laws"]) >= 1
    assert left["chi2_per_dof_linear"] < left["chi2_per_dof"]


def test_every_picture_draws_on_the_axes_it_is_given_and_labels_them(unexplained):
    remainder = unexplained.remainder
    assert remainder is not None
    axes = Figure().subplots(1, 3)
    drawn = (
        plot.force_residual_map(remainder.force_map, ax=axes[0]),
        plot.remainder_map(remainder.dwells, ax=axes[1]),
        plot.force_residual_loops(remainder.dwells, ax=axes[2]),
    )
    assert all(figure is axes[0].figure for figure in drawn)
    for ax in axes:
        assert ax.has_data()
        assert "[" in ax.get_xlabel() + ax.get_ylabel()


def test_pictures_without_dwells_are_refused():
    for draw in (plot.force_residual_loops, plot.remainder_map):
        with pytest.raises(ValueError, match="must hold at least one dwell"):
            draw(())
