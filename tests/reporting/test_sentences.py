import dataclasses
import math

import pytest

from isojax.elements import StribeckFriction
from isojax.identification import AlternativeLaw, Alternatives, DriftBudget, Errors, Fit, SelectedLaw
from isojax.identification._close_loop import overall_verdict
from isojax.records import NoisePeak, Spikes, data_health
from isojax.records.noise._health import UnsettledDwell
from isojax.reporting import render_text, result_dict, verdict_summary
from isojax.reporting.words import alternative_words
from isojax.reporting.words._health_words import budget_words
from isojax.reporting.words._sentences import caveats, finding_words, health_words, verdict_sentence


@pytest.mark.parametrize(
    ("verdict", "start"),
    [
        ("found", "Dry (Coulomb) friction, Fc = "),
        ("partly_explained", "Dry (Coulomb) friction, Fc = "),
        (
            "unexplained",
            "Something is missing that no known effect explains even with dry (Coulomb) friction",
        ),
    ],
)
def test_headline_says_what_the_verdict_says(found, verdict, start):
    sentence = verdict_sentence(dataclasses.replace(found, verdict=verdict))
    assert sentence.startswith(start)
    assert ("something else is missing too" in sentence) == (verdict == "partly_explained")
    assert sentence.endswith(".")


@pytest.mark.parametrize(
    ("before", "after", "samples", "said"),
    [
        (1.16, 1.32, 9e3, "contradict it: they are predicted worse than without it."),
        (1.16, 1.12, 9e3, "down to their noise: another law may act there."),
        (1.16, 1.04, 9e3, ""),
        (0.98, 1.03, 9e3, ""),
        # Of few samples chi2/dof scatters by itself: sqrt(2 / 300) is 0.08.
        (1.16, 1.12, 300.0, ""),
        (1.16, 1.30, 100.0, ""),
        (1.24, 1.30, 300.0, "down to their noise: another law may act there."),
        (3.00, math.nan, 9e3, "contradict it: the model diverges on them."),
    ],
)
def test_what_held_out_records_say_against_a_finding_is_told_and_it_is_not_called_found(
    before, after, samples, said, found, monkeypatch
):
    def errors(held):
        return {"holdout": Errors(0.01, 0.04, 0.04, before if held is found.before else after, samples)}

    plain = verdict_sentence(dataclasses.replace(found))
    monkeypatch.setattr(Fit, "errors", property(errors))
    loop = dataclasses.replace(found)
    assert verdict_sentence(loop).endswith(said)
    assert ("held-out records" in verdict_sentence(loop).removeprefix(plain)) == bool(said)
    expected = "partly_explained" if said else "found"
    assert overall_verdict(found.before, found.after, 1, found.last, found.rules) == expected
    assert dataclasses.replace(found, extensions=()).doubt == ""


def test_of_what_is_below_the_noise_no_share_is_told(found):
    finding = found.findings[0]
    assert "it leaves no excess." in finding_words(finding._replace(transfer=1014.4))[1]
    assert "it removes 62.0 % of the excess." in finding_words(finding._replace(transfer=0.62))[1]
    assert not any("In its place" in line for line in finding_words(finding))
    tried = (
        finding.ranking[0]._replace(held_out_share=0.62),
        finding.ranking[1]._replace(held_out_share=0.25),
    )
    lines = finding_words(finding._replace(transfer=0.62, ranking=tried))
    assert "In its place others would remove there: presliding (Dahl) friction 25.0 %." in lines


def test_headline_without_findings_names_nothing(found):
    alone = dataclasses.replace(found, extensions=(), after=found.before)
    assert verdict_sentence(dataclasses.replace(alone, verdict="none")).startswith("Nothing is missing")
    for verdict in ("partly_explained", "unexplained"):
        sentence = verdict_sentence(dataclasses.replace(alone, verdict=verdict))
        assert sentence.startswith("Something is missing that no known effect explains; held-out χ²/dof")
        assert "→" not in sentence


def test_where_nothing_left_comes_back_with_the_drive_no_effect_is_said_to_be_missing(found):
    louder = found.after._replace(noise=dataclasses.replace(found.after.noise, excess=2.55))
    alone = dataclasses.replace(found, extensions=(), before=louder, after=louder, verdict="unexplained")
    sentence = verdict_sentence(alone)
    assert sentence.startswith(
        "The model explains what comes back with the drive, but the records hold more noise"
    )
    assert "χ²/dof 2.550 by that noise" in sentence
    assert "missing" not in sentence


def test_a_force_law_that_stands_out_beside_a_good_fit_is_told_and_forbids_the_word_found(found):
    law = SelectedLaw("|x| v", "damping-like", 2e5, 1e4, "N s/m^2", 3.0, 20.3, math.nan, ())
    last = found.last._replace(law=law)
    doubted = dataclasses.replace(found, last=last, verdict="partly_explained")
    assert doubted.doubt == "a further law"
    assert overall_verdict(found.before, found.after, 1, last, found.rules) == "partly_explained"
    told = ": a force |x| v stands out of the noise (z = 20); "
    assert "something else is missing too" + told in verdict_sentence(doubted)
    assert result_dict(doubted)["law"]["formula"] == "|x| v"
    (step,) = found.extensions
    assert told in verdict_sentence(dataclasses.replace(doubted, extensions=(step,) * 3))
    alone = dataclasses.replace(
        found, extensions=(), before=found.after, verdict="unexplained", last=last, bounds={}
    )
    said = last._replace(verdict="unexplained")
    assert overall_verdict(alone.before, alone.after, 0, said, found.rules) == "unexplained"
    sentence = verdict_sentence(alone)
    assert sentence.startswith("Something small is missing, and its cause is not identified" + told)
    constant = last._replace(law=law._replace(formula="1"))
    assert ": a constant force stands out" in verdict_sentence(dataclasses.replace(alone, last=constant))
    assert "law" not in result_dict(found)


def test_a_finding_that_a_later_one_contains_is_told_by_that(found):
    (step,) = found.extensions
    finding = step.verdict.finding._replace(effect="stribeck_friction")
    later = step._replace(verdict=step.verdict._replace(finding=finding))
    model = found.after.model.with_elements(StribeckFriction(4.0, 0.8, 0.01, 1e-4))
    after = found.after._replace(model=model)
    both = dataclasses.replace(found, extensions=(step, later), after=after)
    assert [one.effect for one in both.findings] == ["stribeck_friction"]
    assert verdict_sentence(both).startswith("Falling (Stribeck) friction")
    assert len(budget_words(DriftBudget(math.nan, ()), after, both.findings)) == 0


def test_more_than_two_findings_of_a_good_fit_are_said_to_explain_it(found):
    (step,) = found.extensions
    sentence = verdict_sentence(
        dataclasses.replace(found, extensions=(step,) * 3, verdict="partly_explained")
    )
    assert "explain the records together" in sentence
    assert "something else is missing too" not in sentence


def test_finding_without_rivals_asks_for_no_experiment(found):
    alone = found.findings[0]._replace(indistinguishable=("coulomb_friction",), transfer=0.9)
    lines = finding_words(alone)
    assert not any("cannot distinguish" in line or "separates them" in line for line in lines)
    assert any("90.0 %" in line for line in lines)


def test_caveats_name_what_is_declared_and_what_is_hidden(found):
    text = " ".join(caveats(found))
    assert "coulomb_friction.width = 1.00×10⁻⁴ m/s is declared, not fitted" in text
    assert "additional moving mass" in text
    assert "No record was held out" not in text


def test_health_counts_dwells_and_gives_the_noise(found):
    health = data_health(found.campaign)
    text = " ".join(health_words(health, found.after))
    dwells = [dwell for record in found.campaign.records for dwell in record.dwells]
    assert f"All {len(dwells)} dwells settled." in text
    slow = UnsettledDwell("up", dwells[0], 1e-6, 0.031)
    text = " ".join(health_words(dataclasses.replace(health, unsettled=(slow,)), found.after))
    assert f"1 of {len(dwells)} dwells never settled; the worst: up at " in text
    assert "(3.10 %)" in text
    assert f"{found.after.noise.sigma:#.3g} m/s² rms" in text


def test_spikes_are_counted_with_their_share(found):
    clean = data_health(found.campaign)
    assert "Spikes" not in " ".join(health_words(clean, found.after))
    few = (Spikes("up", "output", 7, 3e-4, 0.012), Spikes("down", "output", 2, 1e-4, 0.004))
    text = " ".join(health_words(dataclasses.replace(clean, spikes=few), found.after))
    assert "on the output of 2 records: 9 samples. In up they are 300 ppm of the samples" in text
    assert "hold 1.20 % of the rms" in text
    assert "on the input" not in text
    assert "`[output] remove_spikes = true`" in text
    records = (dataclasses.replace(found.campaign.records[0], removed_spikes=4), *found.campaign.records[1:])
    cleaned = found.after._replace(campaign=dataclasses.replace(found.campaign, records=records))
    assert "4 spikes were replaced by the cubic through their neighbours" in " ".join(
        health_words(clean, cleaned)
    )


def test_scatter_within_records_is_told_where_repeats_show_it(found):
    plain = " ".join(health_words(data_health(found.campaign), found.after))
    assert "within them" not in plain
    stats = found.after.stats._replace(stiffness_scatter=4e-4, segment_scatter=1e-3)
    told = " ".join(health_words(data_health(found.campaign), found.after._replace(stats=stats)))
    assert "scatters by 0.0400 % between records and 0.100 % within them." in told
    assert "0.04 % between records, 0.1 % within them" in str(found.after._replace(stats=stats))


def test_a_peak_in_the_scatter_is_said_in_numbers_and_a_flat_one_is_not(found):
    quiet = data_health(found.campaign)
    assert quiet.noise_peak is None
    assert not any("not white" in line for line in health_words(quiet, found.after))
    shaken = dataclasses.replace(quiet, noise_peak=NoisePeak(5.83, 9.21, 0.0214))
    (line,) = [line for line in health_words(shaken, found.after) if "not white" in line]
    for words in ("peaks at 5.8 Hz, 9.2 times its level", "holds 0.021 m/s² rms", "declare it as [floor]"):
        assert words in line


def test_diagnosis_prints_verdict_reason_and_ranking(found):
    text = render_text(verdict_summary(found.extensions[0].verdict))
    assert text.startswith("found: dry (Coulomb) friction")
    assert "It fits." in text
    assert "bouc_wen" in text


ONE_LAW = (
    "In the place of dry (Coulomb) friction, 1 of 137 free force laws explains the records as well or better "
    "(change of χ²): x² v"
)


@pytest.mark.parametrize(
    ("rise", "likeness", "verdict", "said"),
    [
        (3.0, 0.97, "found", f"{ONE_LAW} (+3)."),
        (-40.2, 0.97, "partly_explained", f"{ONE_LAW} (−40)."),
        (
            0.0,
            1.0,
            "found",
            "None of 137 free force laws explains the records as well as dry (Coulomb) friction.",
        ),
    ],
)
def test_the_range_of_laws_is_told_and_a_better_one_forbids_the_name(found, rise, likeness, verdict, said):
    law = AlternativeLaw("x^2 v", "damping-like", 3e8, 2e7, "N s/m^3", rise, likeness, found.after.model)
    others = (Alternatives(("coulomb_friction",), (law,), 137, 16.0),)
    assert overall_verdict(found.before, found.after, 1, found.last, found.rules, others) == verdict
    loop = dataclasses.replace(found, verdict=verdict, alternatives=others)
    assert alternative_words(loop) == (said,)
    assert verdict_sentence(loop).startswith("Something is missing, but its law") == (
        verdict == "partly_explained"
    )
    (entry,) = result_dict(loop)["alternatives"]
    assert entry["effects"] == ["coulomb_friction"]
    assert entry["laws"][0]["delta_chi2"] == rise
