"""Closed loops on a cut of the demo: one that found dry friction, one without dwells that found nothing."""

import dataclasses
import os
import shutil

import pytest

from isojax import CoulombFriction, read_campaign, write_report
from isojax.demo import campaign_folder
from isojax.identification import Candidate, Extension, Finding, Loop, Verdict, classical_guess, fit


def cut(record, dwells):
    """The record up to the end of its first dwells."""
    stop = record.dwells[dwells - 1].stop
    signals = ("time", "input", "output", "raw_input", "raw_output")
    shorter = {name: getattr(record, name)[:stop] for name in signals}
    return dataclasses.replace(record, dwells=record.dwells[:dwells], **shorter)


def candidate(effect, z, strength, **changes):
    return Candidate(
        effect, f"words for {effect}", z, 1e-9, 0.1, strength, 0.1, "N", 1.02, 0.0, 1.0, True
    )._replace(**changes)


RANKING = (
    candidate("coulomb_friction", 80.0, 4.0),
    candidate("dahl_friction", 70.0, 3.9, delta_bic=4.0, likeness=0.96),
    candidate("bouc_wen", -9.0, -8921.0, admissible=False, chi2_per_dof=float("nan"), delta_bic=float("nan")),
    candidate("sensor_offset", 0.5, 1e-5, p_value=0.9, unit="SI unit of the output"),
)


@pytest.fixture(scope="session")
def campaign():
    """Two records to fit and one held out, seven dwells each."""
    whole = read_campaign(campaign_folder())
    chosen = [record for record in whole.records if "backward" not in record.name]
    return dataclasses.replace(whole, records=tuple(cut(record, 7) for record in chosen))


@pytest.fixture(scope="session")
def found(campaign):
    """The loop that found dry friction, with evidence as a diagnosis would give it."""
    guess = classical_guess(campaign)
    before = fit(guess.model, campaign)
    after = fit(before.model.with_elements(CoulombFriction(25.0, 1e-4)), campaign)
    finding = Finding(
        "coulomb_friction", ("dahl_friction",), 1e-9, 0.97, float("nan"), RANKING, "a test at 5 N"
    )
    verdict = Verdict("found", finding, RANKING, ("dahl_friction",), 0.03, (), {}, after, "It fits.")
    bounds = {"bouc_wen": (11021.0, "N/m"), "sensor_offset": (1e-4, "SI unit of the output")}
    last = Verdict(
        "none", None, RANKING[3:], (), 0.0, ("added_mass",), bounds, None, "Nothing is significant."
    )
    return Loop(
        campaign, guess, before, (Extension(before, after, verdict),), after, "found", last, last.bounds, 12.5
    )


@pytest.fixture(scope="session")
def written(found, tmp_path_factory):
    """The folder of the report of that loop, with Markdown, which held a file before."""
    folder = tmp_path_factory.mktemp("report") / "out"
    folder.mkdir()
    (folder / "notes.txt").write_text("mine", encoding="utf-8")
    write_report(found, folder, markdown=True)
    return folder


@pytest.fixture(scope="session")
def plain(campaign):
    """A loop without dwells and without held-out records that found nothing."""
    record = dataclasses.replace(campaign.records[0], dwells=(), kind="swept", level=None)
    alone = dataclasses.replace(campaign, records=(record,), title="<b>no dwells & no holdout</b>")
    guess = classical_guess(alone)
    only = fit(guess.model, alone)
    last = Verdict("none", None, (), (), 0.0, (), {}, None, "Nothing is significant.")
    return Loop(alone, guess, only, (), only, "none", last, last.bounds, 3.0)


@pytest.fixture(scope="session")
def browser(tmp_path_factory):
    command = shutil.which("chromium")
    if command is None:
        if os.environ.get("CI") == "true":
            pytest.fail("CI needs Chromium: apt-get install chromium")
        pytest.skip("no Chromium here")
    from chromium import Browser  # tests of other folders import this module, from where that one is not seen

    opened = Browser(command, tmp_path_factory.mktemp("chromium"))
    yield opened
    opened.close()
