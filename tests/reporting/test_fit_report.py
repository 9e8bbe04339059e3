"""The fit report: layout of lmfit, and what a reader is warned of."""

import dataclasses

import numpy as np
import pytest

from isojax import RESULTS
from isojax.identification import fit_report
from isojax.identification.fitting import invert_information
from isojax.identification.fitting._fit_result import _within
from isojax.records import data_health
from isojax.reporting.words._sentences import health_words


def with_uncertainty(fit, matrix):
    found = fit.estimate._replace(uncertainty=invert_information(matrix))
    return fit._replace(estimate=found)


def test_report_gives_value_error_and_start_of_every_coefficient(found):
    fit = found.after
    report = str(fit)
    for place, name in enumerate(fit.free):
        line = next(line for line in report.splitlines() if line.strip().startswith(f"{name}:"))
        value, error = float(fit.model[name]), float(np.sqrt(fit.covariance[place, place]))
        assert f"{value:.6g}" in line
        assert f"+/- {error:.3g}" in line
        assert "(init = " in line
    assert "800          kg (fixed)" in report
    assert f"{fit.stats.bic:.8g}" in report
    assert "successful" in report
    assert "[[Warnings]]" not in report


def test_report_lists_strong_correlations_only(found):
    matrix = np.eye(len(found.before.free))
    matrix[0, 1] = matrix[1, 0] = 0.95
    matrix[1, 2] = matrix[2, 1] = 0.1
    report = str(with_uncertainty(found.before, matrix))
    lines = [line for line in report.splitlines() if line.strip().startswith("C(")]
    first, second = found.before.free[:2]
    assert len(lines) == 1
    assert first in lines[0]
    assert second in lines[0]
    assert abs(float(lines[0].rpartition("=")[2])) == pytest.approx(0.95, abs=0.01)


def test_printed_report_cuts_its_longest_lists_to_the_lines_there_are():
    sizes = {"Model": 3, "Coefficients": 20, "Correlations": 30, "None": 0}
    sections = [(title, [title[0]] * count) for title, count in sizes.items()]
    assert _within(sections, 56) == sections
    printed = dict(_within(sections, 30))
    assert printed["Model"] == ["M"] * 3
    assert printed["None"] == []
    assert len(printed["Coefficients"]) == 1 + printed["Coefficients"].count("C")
    assert printed["Coefficients"][-1] == f"... and {20 - printed['Coefficients'].count('C')} more"
    assert printed["Correlations"][-1] == f"... and {30 - printed['Correlations'].count('C')} more"
    assert sum(map(len, printed.values())) + 3 == 30


def test_printed_report_is_the_whole_one_where_it_is_short(found):
    assert str(found.after) == fit_report(found.after)


def test_report_names_partners_that_the_data_cannot_part(found):
    count = len(found.before.free)
    matrix = np.eye(count)
    matrix[0, 1] = matrix[1, 0] = 1.0
    report = str(with_uncertainty(found.before, matrix))
    first, second = found.before.free[:2]
    assert f"{first}, {second} are not determined apart" in report
    assert report.count("+/- unknown") == 2


def test_report_names_a_coefficient_without_a_trace(found):
    matrix = np.eye(len(found.before.free))
    matrix[2, 2] = 0.0
    report = str(with_uncertainty(found.before, matrix))
    assert f"{found.before.free[2]} is not determined: the data hold no trace of it" in report


def test_report_names_a_coefficient_at_its_bound_or_unmoved(found):
    standing = found.after.model.replace(coulomb_friction__force_level=0.0)
    report = str(found.after._replace(model=standing, start=standing))
    assert "coulomb_friction.force_level is at its bound of 0 N" in report
    assert "linear_stiffness.coefficient never moved" in report


def test_report_of_an_extended_model_marks_what_was_added(found):
    report = str(found.after._replace(start=found.before.model))
    line = next(line for line in report.splitlines() if "coulomb_friction.force_level:" in line)
    assert "(added)" in line


def test_report_says_why_a_search_failed(found):
    report = str(found.after._replace(result=RESULTS.not_converged))
    assert RESULTS[RESULTS.not_converged] in report
    assert report.count("not found") == len(found.after.free)
    assert "[[Correlations" not in report
    assert f"{float(found.after.model['linear_stiffness.coefficient']):.6g}" not in report


def test_report_shows_integration_error_where_it_is_known(found):
    stats = found.after.stats._replace(integration_error=0.012)
    assert "0.012 of the noise when halved" in str(found.after._replace(stats=stats))
    quiet = dataclasses.replace(found.campaign, records=found.campaign.fit_records)
    assert "0 held out" in str(found.after._replace(campaign=quiet))


def test_report_warns_of_a_blow_that_the_samples_hardly_see(found):
    record = found.campaign.records[0]
    drive = np.zeros(record.time.size)
    drive[50:53] = (200.0, 400.0, 200.0)
    hit = dataclasses.replace(record, raw_input=drive, kind="impulse")
    fit = found.after._replace(campaign=dataclasses.replace(found.campaign, records=(hit,)))
    assert f"The blow of {record.name} lasts 3 samples" in str(fit)
    words = " ".join(health_words(data_health(fit.campaign), fit))
    assert "Blows of fewer than four samples" in words
    assert f"{record.name} (3)" in words
    assert "blow" not in str(found.after)
