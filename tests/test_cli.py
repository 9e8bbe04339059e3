"""The command line, in this process; the demo from end to end."""

import html
import json
import re
import shutil
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))
import isojax
from isojax._cli import main
from isojax.demo import campaign_folder
from kill_and_resume import cut_demo


def test_effects_lists_the_whole_catalogue_unabridged(capsys):
    assert main(["effects"]) == 0
    text = capsys.readouterr().out
    for name, kind in isojax.CATALOGUE.items():
        line = next(line for line in text.splitlines() if line.split()[:1] == [name])
        assert kind.strength in line


def test_version_is_that_of_the_package(capsys):
    with pytest.raises(SystemExit) as ended:
        main(["--version"])
    assert ended.value.code == 0
    assert capsys.readouterr().out == f"isojax {version('isojax')}\n"
    assert isojax.__version__ == version("isojax")


@pytest.mark.parametrize("command", ["close-loop", "fit"])
def test_bad_campaign_ends_with_code_two_one_line_and_no_file(command, tmp_path, capsys):
    out = tmp_path / "out"
    assert main([command, str(tmp_path / "missing"), "--out", str(out)]) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert len(shown.err.splitlines()) == 1
    assert shown.err.startswith("isojax: ")
    assert "missing" in shown.err
    assert not out.exists()


def test_bad_row_of_a_data_file_is_named_and_nothing_is_written(tmp_path, capsys):
    (tmp_path / "campaign.toml").write_text(
        '[campaign]\ntitle = "t"\nmass = 1.0\n'
        '[input]\nquantity = "force"\ncolumn = "f"\nunit = "N"\n'
        '[output]\nquantity = "acceleration"\ncolumn = "a"\nunit = "m/s^2"\n'
        '[sampling]\nrate = 100.0\n[model]\nstiffness = ["linear"]\ndamping = ["linear"]\n'
        '[[record]]\nfile = "r.csv"\nrole = "fit"\n',
        encoding="utf-8",
    )
    rows = [f"{i % 7},{i % 5}" for i in range(200)]
    rows[57] = "oops,1"
    (tmp_path / "r.csv").write_text("f,a\n" + "\n".join(rows) + "\n", encoding="utf-8")
    assert main(["close-loop", str(tmp_path), "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert "r.csv" in error
    assert "oops" in error
    assert not (tmp_path / "out").exists()


def test_a_file_in_place_of_the_folder_is_refused_before_any_work(tmp_path, capsys):
    (tmp_path / "out").write_text("mine", encoding="utf-8")
    assert main(["demo", "--out", str(tmp_path / "out")]) == 2
    assert "must be a folder" in capsys.readouterr().err
    assert (tmp_path / "out").read_text(encoding="utf-8") == "mine"


def test_inspect_lists_drafts_and_draws_and_the_draft_is_a_campaign(tmp_path, capsys):
    draft, picture = tmp_path / "new" / "campaign.toml", tmp_path / "new" / "seen.png"
    options = ["--rate", "500", "--draft", str(draft), "--picture", str(picture)]
    assert main(["inspect", str(campaign_folder()), *options]) == 0
    shown = capsys.readouterr().out
    assert shown.count("stepped sine, 9 dwells from 4.6 to 7 Hz") == 6
    assert "6 records are read by it" in shown
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert len(isojax.read_campaign(draft).records) == 6
    assert main(["inspect", str(campaign_folder()), *options]) == 2
    assert "is not overwritten" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--rate", "-1"], "--rate must be a finite number above 0"),
        (["--draft", "{}/campaign.toml"], "does not state its sampling rate"),
        (["{}/none.csv"], "none.csv does not exist"),
    ],
)
def test_inspect_refuses_what_it_cannot_use_in_one_line(options, message, tmp_path, capsys):
    data = next(campaign_folder().glob("*.npz"))
    assert main(["inspect", "--quiet", str(data), *(one.format(tmp_path) for one in options)]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert len(error.splitlines()) == 1
    assert not list(tmp_path.iterdir())


def test_no_command_is_an_error_of_usage(capsys):
    with pytest.raises(SystemExit) as ended:
        main([])
    assert ended.value.code == 2
    assert "COMMAND" in capsys.readouterr().err


def test_module_runs_as_a_command():
    done = subprocess.run(
        [sys.executable, "-W", "error", "-m", "isojax", "--version"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("isojax ")
    assert done.stderr == ""


def test_fit_shows_a_line_a_stage_and_verbose_its_steps_as_well(tmp_path, capsys):
    campaign = cut_demo(tmp_path / "campaign", dwells=2)
    for option, stages_only in ((), True), (("--verbose",), False):
        assert main(["fit", str(campaign), *option]) in (0, 1)
        # A slow stage has dots in its line, and a slow step a line of dots.
        shown = [line for line in capsys.readouterr().err.splitlines() if set(line) != {"."}]
        names = [re.split(r" \.|:| \(", line.split(" s  ")[-1])[0] for line in shown]
        stages = ("reading of the campaign", "classical guess", "fit of the declared model")
        assert {f"[{place}/3] {stage}" for place, stage in enumerate(stages, 1)} <= set(names)
        assert ("step 1" not in names) == stages_only
        assert (len(shown) == 3) == stages_only


def test_fit_prints_its_report_and_writes_it(tmp_path, capsys):
    campaign = cut_demo(tmp_path / "campaign")
    assert main(["fit", str(campaign), "--out", str(tmp_path / "out"), "--quiet"]) == 0
    shown = capsys.readouterr()
    assert shown.err == ""
    report = (tmp_path / "out" / "fit.txt").read_text(encoding="utf-8")
    assert report in shown.out
    assert "[[Coefficients]]" in report
    model = isojax.load_model(tmp_path / "out" / "model.json")
    assert float(model["linear_stiffness.coefficient"]) == pytest.approx(1.12e6, rel=0.02)


def failing_campaign(folder):
    """Four dwells of the demo with a force of the wrong sign: no spring and no damper fits them."""
    campaign = cut_demo(folder, dwells=2)
    file = campaign / "campaign.toml"
    text = file.read_text(encoding="utf-8").replace('unit = "N"', 'unit = "N"\ngain = -40.0', 1)
    file.write_text(text, encoding="utf-8")
    return campaign


@pytest.mark.slow
@pytest.mark.parametrize(("command", "file"), [("fit", "fit.txt"), ("close-loop", "report.html")])
def test_a_fit_that_failed_ends_with_code_one_and_its_report_says_so(
    command, file, tmp_path, capsys, monkeypatch
):
    monkeypatch.setattr("isojax.identification.fitting._descent.MOST_REFUSALS", 1)
    monkeypatch.setattr("isojax.identification.fitting._descent.STALLED", 0.0)
    campaign = failing_campaign(tmp_path / "campaign")
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "model.json").write_text("of an earlier run", encoding="utf-8")
    assert main([command, str(campaign), "--out", str(tmp_path / "out"), "--quiet"]) == 1
    assert capsys.readouterr().err == ""
    report = (tmp_path / "out" / file).read_text(encoding="utf-8")
    assert "The search failed." in report
    assert "is not good, but" not in report
    assert not (tmp_path / "out" / "model.json").exists()
    if command == "fit":
        listed = report.split("[[Coefficients]]")[1].split("[[")[0].strip().splitlines()
        assert [line.split()[1:3] for line in listed if "mass" not in line] == [["not", "found"]] * 3
        assert "reduced chi-square   = nan" in report
    if command == "close-loop":
        assert "The fit failed" in report
        result = json.loads((tmp_path / "out" / "result.json").read_text(encoding="utf-8"))
        assert result["verdict"] == "unexplained"
        assert result["bounds"] == {}
        assert set(result["after"]["error"]["fit"].values()) == {None}
        assert result["after"]["parameters"]["linear_stiffness.coefficient"]["value"] is None
        assert result["after"]["parameters"]["mass"]["value"] == 800.0


def test_help_says_what_the_exit_codes_mean(capsys):
    with pytest.raises(SystemExit):
        main(["--help"])
    shown = " ".join(capsys.readouterr().out.split())
    assert "0 done; 1 the fit did not converge" in shown
    assert "2 an argument or a file is bad" in shown


def test_an_unknown_effect_is_refused_before_a_data_file_is_opened(tmp_path, capsys):
    campaign = cut_demo(tmp_path / "campaign")
    for data in campaign.glob("*.npz"):
        data.unlink()
    file = campaign / "campaign.toml"
    file.write_text(file.read_text(encoding="utf-8").replace('"cubic"', '"kubic"', 1), encoding="utf-8")
    assert main(["fit", str(campaign), "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert "model.stiffness" in error
    assert "kubic" in error
    assert len(error.splitlines()) == 1
    assert not (tmp_path / "out").exists()


@pytest.fixture
def demo(tmp_path, capsys, demo_beside):
    """Folder, output and messages of `isojax demo`, which .ci/run runs where nothing else is installed."""
    if demo_beside is not None:
        ends = (demo_beside.with_suffix(end).read_text(encoding="utf-8") for end in (".out", ".err"))
        return demo_beside, *ends
    assert main(["demo", "--out", str(tmp_path)]) == 0
    return tmp_path, *capsys.readouterr()


@pytest.mark.slow
def test_demo_finds_the_friction_that_was_put_in(demo):
    folder, out, messages = demo
    assert all((folder / name).stat().st_size for name in ("report.html", "result.json", "model.json"))
    result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    truth = json.loads((campaign_folder() / "truth.json").read_text(encoding="utf-8"))
    assert result["verdict"] == "found"
    assert [finding["effect"] for finding in result["findings"]] == [truth["effect"]]
    level = result["after"]["parameters"]["coulomb_friction.force_level"]
    assert level["value"] == pytest.approx(truth["spec"]["q"][0], abs=3.0 * level["standard_error"])
    before, after = (result[when]["error"]["holdout"] for when in ("before", "after"))
    assert after["chi2_per_dof"] < 1.05
    assert after["nrmse"] < 0.3 * before["nrmse"]
    readme = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")
    said = re.search(
        r"Fc = ([\d.]+) ± .*χ²/dof ([\d.]+) → ([\d.]+)\..* ([\d.]+) % to ([\d.]+) %", readme, re.DOTALL
    )
    errors = [before["chi2_per_dof"], after["chi2_per_dof"], 100 * before["nrmse"], 100 * after["nrmse"]]
    assert said is not None
    assert [float(number) for number in said.groups()] == pytest.approx([level["value"], *errors], rel=0.01)
    assert "report.html" in out
    assert "6 records read" in messages
    assert "chi2/dof" in messages
    assert len(messages.splitlines()) < 12


@pytest.mark.parametrize("command", ["fit", "close-loop"])
def test_records_that_contradict_their_declaration_end_with_code_two(command, tmp_path, capsys):
    folder = shutil.copytree(campaign_folder(), tmp_path / "flipped")
    file = folder / "campaign.toml"
    file.write_text(file.read_text(encoding="utf-8").replace('unit = "N"', 'unit = "N"\ngain = -1.0'))
    assert main([command, str(folder), "--out", str(tmp_path / "out"), "--quiet"]) == 2
    said = capsys.readouterr().err
    assert "wrong sign" in said
    assert "--anyway" in said
    assert not (tmp_path / "out").exists()


@pytest.fixture
def calm_loop(monkeypatch):
    """Make the loop of the command look for dry friction alone."""
    others = tuple(name for name in isojax.CATALOGUE if name != "coulomb_friction")
    find = isojax.close_loop
    monkeypatch.setattr(
        "isojax.reporting.close_loop", lambda *args, **options: find(*args, excluded=others, **options)
    )


def stop_at(monkeypatch, place, error):
    """Let the command fail at its n-th evaluation, as Ctrl-C or kill would end it."""
    from isojax.identification.fitting import _simulator

    work, calls = _simulator.information, []

    def counted(*args):
        calls.append(1)
        if len(calls) == place:
            raise error
        return work(*args)

    monkeypatch.setattr(_simulator, "information", counted)
    return calls


@pytest.mark.slow
def test_an_interrupted_loop_keeps_what_it_did_and_resumes_with_the_same_result(
    calm_loop, tmp_path, capsys, monkeypatch
):
    campaign, out = cut_demo(tmp_path / "campaign", dwells=2), tmp_path / "out"
    words = ["close-loop", str(campaign), "--out", str(out)]
    with monkeypatch.context() as patch:
        stop_at(patch, 8, KeyboardInterrupt())
        assert main(words) == 130
    shown = capsys.readouterr()
    assert shown.out == ""
    *stages, last = shown.err.splitlines()
    assert last.startswith("isojax: interrupted; what is finished is kept in ")
    assert "--resume" in last
    assert all("[" in line for line in stages)
    assert [entry.name for entry in out.iterdir()] == [".isojax"]
    (out / "mine.txt").write_text("mine")

    with monkeypatch.context() as patch:
        page = {"report.html": "<html></html>"}
        patch.setattr("isojax.reporting.page._write.page_content", lambda *_: {})
        patch.setattr("isojax.reporting.page._write.render_pages", lambda *_, **__: page)
        resumed = stop_at(patch, 0, KeyboardInterrupt())
        assert main([*words, "--resume", "--json"]) in (0, 1)
        again = len(resumed)
        shown = capsys.readouterr()
        result = json.loads((out / "result.json").read_text(encoding="utf-8"))
        assert json.loads(shown.out) == result
        assert "finished computations were kept: going on from there" in shown.err
        assert "coulomb_friction" in shown.err
        assert not (out / ".isojax" / "answers").exists()

        assert main([*words, "--quiet"]) in (0, 1)
        whole = json.loads((out / "result.json").read_text(encoding="utf-8"))
        assert len(resumed) == again + again + 7
    assert {**whole, "seconds": 0.0} == {**result, "seconds": 0.0}
    names = sorted(entry.name for entry in out.iterdir())
    assert names == [".isojax", "fit.json", "mine.txt", "model.json", "report.html", "result.json"]

    capsys.readouterr()
    assert main(["fit", str(campaign), "--out", str(out), "--quiet", "--json"]) in (0, 1)
    shown = capsys.readouterr()
    assert shown.err == ""
    (tmp_path / "fit.json").write_text(shown.out, encoding="utf-8")
    loaded = isojax.load_fit(tmp_path / "fit.json")
    assert float(loaded.model["mass"]) == 800.0
    names = sorted(entry.name for entry in out.iterdir())
    assert names == [".isojax", "fit.json", "fit.txt", "mine.txt", "model.json"]


@pytest.mark.slow
@pytest.mark.parametrize("command", ["fit", "close-loop"])
def test_what_contradicts_is_fitted_anyway_and_the_doubt_stands_first(
    command, calm_loop, tmp_path, capsys, monkeypatch
):
    kinds = ("lead", "response", "error", "evidence", "remainder", "record", "force", "health")
    without = {f"{kind}_pictures": () for kind in kinds}
    monkeypatch.setattr("isojax.reporting.page._page.draw_pictures", lambda *_: without)
    # What the page says of folds and of the response is not asked here.
    monkeypatch.setattr("isojax.health._campaign_health.dwell_stability", lambda *_: ())
    monkeypatch.setattr("isojax.reporting.page._identified_response._why_not", lambda _: "it is not asked")
    campaign, out = cut_demo(tmp_path / "campaign", dwells=4), tmp_path / "out"
    file = campaign / "campaign.toml"
    heavier = file.read_text(encoding="utf-8").replace("mass = 800.0", "mass = 1600.0")
    file.write_text(heavier, encoding="utf-8")
    words = [command, str(campaign), "--out", str(out), "--quiet"]
    assert main(words) == 2
    assert "--anyway" in capsys.readouterr().err
    assert not out.exists()

    assert main([*words, "--anyway"]) in (0, 1)
    shown = capsys.readouterr()
    assert shown.err == ""
    doubt = 'Check first: "force" and "acceleration": the apparent mass, force over acceleration'
    assert " ".join(shown.out.split()).startswith(doubt)
    if command == "fit":
        assert (out / "fit.txt").read_text(encoding="utf-8").startswith(doubt)
    else:
        result = json.loads((out / "result.json").read_text(encoding="utf-8"))
        assert [(one["check"], one["contradicts"]) for one in result["check_first"]] == [("inertia", True)]
        assert result["before"]["parameters"]["mass"]["value"] == 1600.0
        page = html.unescape((out / "report.html").read_text(encoding="utf-8"))
        assert page.index(doubt) < page.index("Verdict: unexplained")


def test_inspect_prints_json_alone(capsys):
    assert main(["inspect", str(campaign_folder()), "--rate", "500", "--json"]) == 0
    shown = capsys.readouterr()
    files = json.loads(shown.out)
    assert len(files) == 6
    assert {one["kind"] for one in files} == {"stepped_sine"}
    assert all(one["channels"][0]["rms"] > 0.0 for one in files)
    assert "samples" not in files[0]["channels"][0]
    assert "9 dwells" in shown.err


@pytest.mark.parametrize("command", ["close-loop", "fit"])
def test_results_on_a_full_disk_end_with_code_three_and_the_place(command, tmp_path, capsys, monkeypatch):
    from isojax._output_folder import KeptElsewhereError

    def full(*_, **__):
        raise KeptElsewhereError(f"{tmp_path} cannot be written to (No space left on device). See there.")

    monkeypatch.setattr("isojax._cli._read", full)
    assert main([command, str(campaign_folder()), "--out", str(tmp_path / "out"), "--quiet"]) == 3
    assert "No space left" in capsys.readouterr().err
