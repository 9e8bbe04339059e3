"""The section "What is left", on the demo's dry friction taken for something that no effect explains."""

import dataclasses
import json
import re

import numpy as np
import pytest
from matplotlib.figure import Figure

from isojax import (
    plot_ceilings,
    plot_force_residual_loops,
    plot_force_residual_map,
    plot_remainder_map,
    plot_remainder_parts,
)
from isojax.reporting import loop_summary, render_page, render_text, result_dict

CEILING = {"share", "error", "weights", "held_out"}
LAW = {"formula", "coefficient", "standard_error", "unit", "share", "alike"}


@pytest.fixture(scope="module")
def unexplained(found):
    """The loop before friction was added, as if nothing had been found."""
    verdict = found.last._replace(verdict="unexplained", bounds={}, reason="Nothing explains it.")
    return dataclasses.replace(
        found, extensions=(), after=found.before, verdict="unexplained", last=verdict, bounds={}
    )


@pytest.mark.slow
def test_what_is_left_is_described_once(unexplained):
    first = unexplained.remainder
    assert first is not None
    assert unexplained.remainder is first


@pytest.mark.slow
def test_nothing_is_described_where_the_verdict_is_another(found, written):
    assert found.remainder is None
    assert "What is left" not in (written / "report.html").read_text(encoding="utf-8")
    assert "remainder" not in result_dict(found)


def test_dry_friction_grows_with_amplitude_and_not_with_frequency(unexplained):
    remainder = unexplained.remainder
    assert remainder is not None
    exponents = remainder.exponents
    assert exponents is not None
    assert abs(exponents.amplitude - 1.0) < 3.0 * exponents.amplitude_error
    assert abs(exponents.frequency) < 3.0 * exponents.frequency_error
    assert exponents.damping > 0.8
    assert "dry friction" in exponents.like


@pytest.mark.slow
def test_the_page_has_the_section_with_its_pictures(unexplained):
    page = render_page(unexplained)
    section = page.partition("<h2>What is left</h2>")[2].partition("<h2>")[0]
    assert section.count("data:image/png;base64,") == 6
    assert "no finding" in section
    assert re.search(r"A black box of \d+ weights explains \d+ ± \d+ % on held-out records", section)
    assert "dry friction" in section


def test_the_terminal_says_it_in_a_few_lines(unexplained):
    text = render_text(loop_summary(unexplained))
    assert "What is left: A force" in text
    assert "black box" in text


def test_result_holds_the_same_facts(unexplained):
    result = json.loads(json.dumps(result_dict(unexplained), allow_nan=False))
    left = result["remainder"]
    assert all(set(law) == LAW for law in left["laws"])
    assert len(left["laws"]) >= 1
    assert set(left["static"]) == set(left["black_box"]) == CEILING
    assert left["exponents"]["like"]
    assert left["chi2_per_dof_linear"] < left["chi2_per_dof"]
    assert np.isclose(sum(left["parts"].values()), 1.0)


def test_every_picture_draws_on_the_axes_it_is_given_and_labels_them(unexplained):
    remainder = unexplained.remainder
    assert remainder is not None
    axes = Figure().subplots(1, 5)
    drawn = (
        plot_ceilings(remainder, ax=axes[0]),
        plot_remainder_parts(remainder.parts, ax=axes[1]),
        plot_force_residual_map(remainder.force_map, ax=axes[2]),
        plot_remainder_map(remainder.dwells, ax=axes[3]),
        plot_force_residual_loops(remainder.dwells, ax=axes[4]),
    )
    assert all(figure is axes[0].figure for figure in drawn)
    for ax in axes:
        assert ax.has_data()
        assert "[" in ax.get_xlabel() + ax.get_ylabel()


def test_pictures_without_dwells_are_refused():
    for plot in (plot_force_residual_loops, plot_remainder_map):
        with pytest.raises(ValueError, match="must hold at least one dwell"):
            plot(())
