"""The section on the response of the identified model."""

import dataclasses

import numpy as np
import pytest

from isojax._results import RESULTS
from isojax.reporting.page._identified_response import identified_response


@pytest.fixture(scope="module")
def shown(found):
    return identified_response(found)


def test_the_curves_pass_through_the_measured_dwells(shown):
    for one in shown.measured:
        force = np.abs(one.force[:, 0])
        curve = min(
            shown.bands.curves, key=lambda curve, force=force: abs(curve.amplitude - np.median(force))
        )
        # Only dwells whose drive is that of the curve: a shaker does not hold its level.
        alike = np.abs(force / curve.amplitude - 1.0) < 0.02
        model = np.interp(one.frequency[alike], curve.frequency, curve.displacement)
        np.testing.assert_allclose(np.abs(one.displacement[alike, 0]), model, rtol=0.08)


def test_the_page_and_the_markdown_have_both_pictures(found, written):
    page, text = ((written / name).read_text(encoding="utf-8") for name in ("report.html", "report.md"))
    for content in (page, text):
        assert "Response of the identified model" in content
        assert "no fold, so no jump" in content
        assert (
            "models drawn within the errors of the coefficients agree" in content
            or "with probability" in content
        )
    assert {"report_response_of_the_model.png", "report_transmissibility_of_the_model.png"} <= {
        one.name for one in written.iterdir()
    }


def test_without_dwells_the_amplitudes_are_those_of_the_rms(plain):
    shown = identified_response(plain)
    assert any("no dwells" in line for line in shown.lines)
    drive = plain.campaign.records[0]
    rms = np.std(drive.input[drive.settle :])
    np.testing.assert_allclose(shown.bands.amplitudes, [np.sqrt(2.0) * rms])


def test_a_failed_fit_says_why_nothing_is_shown(found):
    failed = dataclasses.replace(found, after=found.after._replace(result=RESULTS.not_converged))
    assert identified_response(failed).lines == ("The response is not shown: the last fit failed.",)
