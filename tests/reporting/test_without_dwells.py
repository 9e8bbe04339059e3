"""Reports of records without dwells, and of pictures that cannot be drawn."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy import signal

from isojax import CATALOGUE, ClosedLoop, close_loop
from isojax._cli import main
from isojax.demo import campaign_folder
from isojax.identification import classical_guess
from isojax.records import Campaign, InputChannel, OutputChannel, Record
from isojax.reporting import write_report
from isojax.reporting.page._identified_response import _sines, identified_response

MASS, NATURAL, DAMPING = 20.0, 10.0, 0.04
RATE, PERIODS = 40.0 * NATURAL, 160
OMEGA = 2.0 * np.pi * NATURAL
FILES = ["fit.json", "model.json", "report.html", "result.json"]


def chirp(time, _):
    """A sine from 0.4 to 2.2 natural frequencies and back."""
    share = 1.0 - np.abs(2.0 * time / time[-1] - 1.0)
    return 0.35 * np.sin(2.0 * np.pi * NATURAL * np.cumsum(0.4 + 1.8 * share) / RATE)


def random(time, generator):
    """Noise from 0.3 to 3 natural frequencies, of rms 0.5."""
    band = signal.butter(4, (0.3 * NATURAL, 3.0 * NATURAL), "bandpass", fs=RATE, output="sos")
    drive = signal.sosfilt(band, generator.standard_normal(time.size))
    return 0.5 * drive / np.std(drive)


def record(drive, level, role, seed):
    """What SciPy simulates of a linear oscillator: its acceleration, with white noise of 0.4 %."""
    generator = np.random.default_rng(seed)
    time = np.arange(round(PERIODS * RATE / NATURAL)) / RATE
    force = level * MASS * OMEGA**2 * 1e-3 * drive(time, generator)
    system = signal.lti([1.0 / MASS, 0.0, 0.0], [1.0, 2.0 * DAMPING * OMEGA, OMEGA**2])
    exact = signal.lsim(system, force, time)[1]
    output = exact + 0.004 * np.std(exact) * generator.standard_normal(time.size)
    kind = "swept" if drive is chirp else "broadband"
    channels = (force, output, force, output)
    return Record(f"{role}{level}", Path("x.npz"), time, RATE, *channels, level=level, role=role, kind=kind)


def campaign_of(drive, seed=0):
    levels = ((0.5, "fit"), (1.0, "fit"), (2.0, "fit"), (1.5, "holdout"))
    return Campaign(
        title="no dwells",
        file=Path("campaign.toml"),
        mass=MASS,
        mass_free=False,
        input=InputChannel("force", "f", "N", hold="linear"),
        output=OutputChannel("acceleration", "a", "m/s^2"),
        filter=None,
        rate=RATE,
        stiffness=("linear",),
        damping=("linear",),
        elements=(),
        records=tuple(record(drive, *one, 10 * seed + place) for place, one in enumerate(levels)),
    )


@pytest.fixture(scope="module")
def chirps():
    """The closed loop over chirps, with few candidates."""
    few = ("cubic_stiffness", "coulomb_friction")
    return close_loop(campaign_of(chirp), excluded=tuple(name for name in CATALOGUE if name not in few))


@pytest.fixture(scope="module")
def report(chirps, tmp_path_factory):
    """The folder of its report, and the response that this shows."""
    folder, shown = tmp_path_factory.mktemp("chirps"), []

    def watched(loop):
        shown.append(identified_response(loop))
        return shown[-1]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("isojax.reporting.page._page.identified_response", watched)
        chirps.report(folder)
    return folder, shown[0]


def names(folder):
    return sorted(path.name for path in folder.glob("[!.]*"))


def test_a_loop_over_chirps_writes_its_report(report):
    folder, _ = report
    assert names(folder) == FILES
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert "could not be drawn" not in page
    assert 'alt="response of the model"' in page
    result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    assert result["verdict"] == "none"
    stiffness = result["after"]["parameters"]["linear_stiffness.coefficient"]
    assert abs(stiffness["value"] - MASS * OMEGA**2) < 4.0 * stiffness["standard_error"]


def test_nothing_is_read_where_nothing_was_driven(chirps, report):
    # A chirp over a band of B Hz in T seconds ends within some sqrt(B/T) of its ends, here 1.5 Hz.
    low, high = 0.4 * NATURAL - 1.5, 2.2 * NATURAL + 1.5
    for one in chirps.guess.linear:
        assert low < one.frequency[0] < one.frequency[-1] < high
        exact = 1.0 / MASS / (OMEGA**2 - (2.0 * np.pi * one.frequency) ** 2 + 2j * DAMPING * OMEGA**2)
        assert np.max(np.abs(one.receptance)) < 2.0 * np.max(np.abs(exact))
    first, last = report[1].bands.frequencies
    assert low < first < 0.7 * NATURAL
    assert 1.5 * NATURAL < last < high


@pytest.mark.parametrize("seed", range(6))
def test_the_response_to_random_drives_is_shown_where_they_drive(seed):
    campaign = campaign_of(random, seed)
    guess = classical_guess(campaign)
    first, last = _sines(campaign, guess, (), guess).frequencies
    # The skirts of the filter hold a thousandth of the power below and a hundredth above.
    assert 0.15 * NATURAL < first < 0.5 * NATURAL
    assert 2.0 * NATURAL < last < 5.0 * NATURAL


def fails(*_, **__):
    raise RuntimeError("the ink\nis out.")


def test_pictures_that_cannot_be_drawn_are_lines_beside_all_the_others(plain, tmp_path, monkeypatch):
    lost = {
        "_pictures.plot_receptance": ("receptance",),
        "_pictures.worst_window": ("largest residual", "zoom", "residual there"),
        "_pictures.residual": ("cross-correlation", "autocorrelation"),
        "_pictures._effect_pictures": ("each effect by itself",),
        "_identified_response.response_bands": ("the response of the model",),
    }
    for broken in lost:
        monkeypatch.setattr(f"isojax.reporting.page.{broken}", fails)
    write_report(plain, tmp_path, markdown=True)
    assert set(FILES) < set(names(tmp_path))
    for file in ("report.html", "report.md"):
        page = (tmp_path / file).read_text(encoding="utf-8")
        lines = [f"Picture of {one} could not be drawn: the ink is out." for one in sum(lost.values(), ())]
        assert [page.count(line) for line in lines] == [1] * len(lines)
        assert page.count("could not be drawn") == len(lines)
        for one in ("time history", "force against velocity", "goodness of fit", "residual of each dwell"):
            assert f'alt="{one}"' in page or f"![{one}]" in page


def test_the_numbers_are_written_before_anything_is_drawn(plain, tmp_path, monkeypatch):
    seen = []

    def watch(figure):
        seen.append(names(tmp_path))
        raise KeyboardInterrupt

    monkeypatch.setattr("isojax.reporting.page._pictures.png_bytes", watch)
    (tmp_path / "mine.png").write_bytes(b"mine")
    with pytest.raises(KeyboardInterrupt):
        write_report(plain, tmp_path)
    assert seen == [["fit.json", "mine.png", "model.json", "result.json"]]
    assert names(tmp_path) == seen[0]


def test_what_is_known_is_written_whatever_fails_after_it(plain, tmp_path, monkeypatch):
    """The health of the data, then words of result.json: each leaves what was found before it."""
    with pytest.raises(RuntimeError, match="the ink"):
        write_report(plain, tmp_path / "health", health=fails)
    assert names(tmp_path / "health") == ["fit.json", "model.json", "result.json"]
    assert "health" not in json.loads((tmp_path / "health" / "result.json").read_text(encoding="utf-8"))
    monkeypatch.setattr("isojax.reporting.page._result.check_first_dicts", fails)
    with pytest.raises(RuntimeError, match="the ink"):
        write_report(plain, tmp_path / "words")
    assert names(tmp_path / "words") == ["fit.json", "model.json"]


def test_without_a_single_picture_the_verdict_gives_the_exit_code(plain, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("isojax.reporting.close_loop", lambda *_, **__: ClosedLoop(plain))
    monkeypatch.setattr("isojax.reporting.page._pictures.png_bytes", fails)
    monkeypatch.setattr("isojax.reporting.page._pictures.telling_slice", fails)
    monkeypatch.setattr("isojax.reporting.page._page.identified_response", fails)
    assert main(["close-loop", str(campaign_folder()), "--out", str(tmp_path), "--quiet", "--json"]) == 0
    shown = capsys.readouterr()
    result = json.loads((tmp_path / "result.json").read_text(encoding="utf-8"))
    assert json.loads(shown.out) == result
    assert result["verdict"] == "none"
    assert names(tmp_path) == FILES
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "<img" not in page
    assert page.count("could not be drawn: the ink is out.") > 8
