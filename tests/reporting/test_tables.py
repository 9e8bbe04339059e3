"""Tables for the terminal and for notebooks."""

import numpy as np

import isojax as ij


def test_error_table_has_a_row_for_each_role_and_model(found):
    lines = [line.split() for line in ij.render_text(ij.error_table(found.before, found.after)).splitlines()]
    rows = [line for line in lines if line and line[0] in ("fitted", "held")]
    expected = [
        (words, label, f"{fit.errors[role].chi2_per_dof:.3f}")
        for words, role in (("fitted", "fit"), ("held", "holdout"))
        for label, fit in (("before", found.before), ("after", found.after))
    ]
    assert [(row[0], row[2 if row[0] == "held" else 1], row[-1]) for row in rows] == expected


def test_tables_of_one_model_do_not_speak_of_before(found):
    for table in (ij.error_table, ij.parameter_table):
        text = ij.render_text(table(found.before))
        assert text == ij.render_text(table(found.before, found.before))
        assert "before" not in text
        assert "fitted" in text


def test_parameter_table_leaves_open_what_the_model_before_lacks(found):
    text = ij.render_text(ij.parameter_table(found.before, found.after))
    row = next(line for line in text.splitlines() if "coulomb_friction.force_level" in line)
    assert row.count("±") == 1
    mass = next(line for line in text.splitlines() if line.split()[:1] == ["mass"])
    assert mass.count("800.0 kg (fixed)") == 2


def test_ranking_table_keeps_the_order_of_the_ranking(found):
    ranking = found.findings[0].ranking
    text = ij.render_text(ij.ranking_table(ranking))
    places = [text.index(candidate.effect) for candidate in ranking]
    assert places == sorted(places)


def test_a_notebook_shows_a_table_by_itself(found):
    shown = ij.error_table(found.before)._repr_mimebundle_([], [])
    assert "NRMSE" in shown["text/html"]


def test_the_unit_of_a_heading_is_shown_and_not_read_as_markup():
    time = np.arange(4000) / 500.0
    seen = ij.records.inspect_file("run [b]", data={"t [s]": time, "F [N]": np.sin(30 * time), "a [g]": time})
    shown = str(ij.reporting.inspection_summary([seen]))
    assert "run [b]" in shown
    assert "F [N] " in shown
    assert "a [g] " in shown
