"""`isojax map`, in this process: what it writes and prints, and how it ends."""

import json
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import isojax as ij
from isojax._cli import main
from isojax.reporting import map_dict, map_summary

PNG = b"\x89PNG\r\n\x1a\n"
WINDOW = ["--amplitudes", "100", "400", "4", "--frequencies", "1.5", "3.5", "5"]


@pytest.fixture(scope="module")
def z_file(tmp_path_factory):
    path = tmp_path_factory.mktemp("model") / "model.json"
    ij.save_model(ij.paper.z_direction(), path)
    return str(path)


@pytest.fixture(scope="module")
def z_map():
    amplitudes, frequencies = np.linspace(100, 400, 4), np.linspace(1.5, 3.5, 5)
    return ij.stability_map(ij.paper.z_direction(), amplitudes, frequencies, coexisting=True)


@pytest.mark.slow
def test_map_writes_arrays_that_equal_the_map_and_pictures(z_file, z_map, tmp_path, capsys):
    out = tmp_path / "out"
    out.mkdir()
    (out / "folds.png").write_bytes(b"of an earlier map")
    (out / "notes.txt").write_text("mine", encoding="utf-8")
    assert main(["map", z_file, *WINDOW, "--out", str(out), "--quiet"]) == 0
    shown = capsys.readouterr()
    assert shown.err == ""
    assert sorted(path.name for path in out.glob("[!.]*")) == [
        "curves.png",
        "map.npz",
        "map.png",
        "notes.txt",
        "response.png",
    ]
    for name in ("curves.png", "map.png", "response.png"):
        assert (out / name).read_bytes().startswith(PNG)
    with np.load(out / "map.npz", allow_pickle=False) as stored:
        for name in (
            "amplitudes",
            "frequencies",
            "spectral_radius",
            "multipliers",
            "response",
            "count",
            "y0",
        ):
            np.testing.assert_array_equal(stored[name], np.asarray(getattr(z_map, name)))
        assert not stored["result"].any()
        assert list(stored["result_names"]) == [
            "successful",
            "not_converged",
            "not_finite",
            "not_accurate",
            "sticks",
            "no_further_orbit",
        ]
        assert "stopped before it converged" in stored["result_words"][1]
        assert json.loads(str(stored["model"])) == json.loads(Path(z_file).read_text(encoding="utf-8"))
    text = shown.out
    assert "4 amplitudes 100 to 400 N, 5 frequencies 1.5 to 3.5 Hz" in text
    assert "20 in 20 cells" in text
    radius = np.asarray(z_map.spectral_radius)
    assert radius.shape == (1, 4, 5)
    _, row, column = np.unravel_index(radius.argmax(), radius.shape)
    assert "nowhere; each cell holds at most one orbit" in text
    assert f"{radius.max():.4f} at {100 * (row + 1)} N, {1.5 + 0.5 * column:g} Hz" in text
    assert "compiling" in text


def test_a_map_as_json_holds_what_each_cell_says(z_map):
    said = json.loads(json.dumps(map_dict(z_map), allow_nan=False))
    assert said["amplitudes"] == [100.0, 200.0, 300.0, 400.0]
    np.testing.assert_array_equal(said["spectral_radius"], np.asarray(z_map.spectral_radius)[0])
    np.testing.assert_array_equal(said["count"], np.asarray(z_map.count))
    assert said["folds"] is None
    lost = eqx.tree_at(lambda m: m.spectral_radius, z_map, z_map.spectral_radius.at[:, 0, 0].set(jnp.nan))
    assert map_dict(lost)["spectral_radius"][0][0] is None


@pytest.mark.slow
def test_the_summary_says_whose_errors_the_chances_hold_and_how_large_they_are(z_map):
    shape = z_map.response.shape
    errors = {
        "response": 0.02 * z_map.response,
        "spectral_radius": jnp.full(shape, 1e-3).at[0, 0, 0].set(0.5),
    }
    chances = jnp.ones(shape[1:]), jnp.zeros(shape[1:]), errors
    known = eqx.tree_at(
        lambda m: (m.probability_stable, m.probability_coexisting, m.standard_errors),
        z_map,
        chances,
        is_leaf=lambda leaf: leaf is None,
    )
    text = map_summary(known, whose="of a further record")
    words = "of a further record; response ± 2 % in the median cell, 2 % at most, |µ| ± 0.001 in the median"
    assert words in text
    assert "0.5 at most" in text
    assert "their errors" not in map_summary(z_map, whose="of a further record")


def test_a_further_record_needs_a_share_and_the_fit(z_file, z_map, tmp_path, capsys, monkeypatch):
    command = ["map", z_file, *WINDOW, "--out", str(tmp_path / "out"), "--quiet"]
    for share in ("-1", "much", "inf"):
        with pytest.raises(SystemExit) as ended:
            main([*command, "--next-record", share])
        assert ended.value.code == 2
        assert f"must be a share of 0 or above, such as 0.005, but is {share}" in capsys.readouterr().err
    monkeypatch.setattr("isojax.stability.stability_map", lambda *_, **__: z_map)
    assert main([*command, "--next-record"]) == 2
    assert "--next-record needs the fit beside the model, but there is no" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["--amplitudes", "400", "100", "--frequencies", "1", "4"], "--amplitudes"),
        (["--amplitudes", "1", "100", "1", "--frequencies", "1", "4"], "--amplitudes"),
        (["--amplitudes", "1", "100", "3.5", "--frequencies", "1", "4"], "--amplitudes"),
        (["--amplitudes", "1", "100", "--frequencies", "0", "4"], "--frequencies"),
        (["--amplitudes", "1", "100", "--frequencies", "1", "four"], "--frequencies"),
        (["--amplitudes", "1", "100", "--frequencies", "1"], "--frequencies"),
        (["--amplitudes", "1", "inf", "--frequencies", "1", "4"], "--amplitudes"),
        (["--amplitudes", "1", "100", "9", "9", "--frequencies", "1", "4"], "--amplitudes"),
    ],
)
def test_bad_window_ends_with_code_two_one_line_and_no_file(z_file, words, named, tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["map", z_file, *words, "--out", str(out)]) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert len(shown.err.splitlines()) == 1
    assert shown.err.startswith(f"isojax: {named} must be START STOP [COUNT]")
    assert not out.exists()


def test_bad_model_ends_with_code_two_and_names_the_file(tmp_path, capsys):
    path = tmp_path / "model.json"
    for content in (None, "{", '{"format": "other"}'):
        if content is not None:
            path.write_text(content, encoding="utf-8")
        assert main(["map", str(path), *WINDOW, "--out", str(tmp_path / "out")]) == 2
        shown = capsys.readouterr()
        assert len(shown.err.splitlines()) == 1
        assert "model.json" in shown.err
    assert not (tmp_path / "out").exists()


def test_a_file_in_place_of_the_folder_is_refused_before_any_work(z_file, tmp_path, capsys):
    (tmp_path / "out").write_text("mine", encoding="utf-8")
    assert main(["map", z_file, *WINDOW, "--out", str(tmp_path / "out")]) == 2
    assert "must be a folder" in capsys.readouterr().err


@pytest.mark.slow
def test_map_in_which_nothing_converged_ends_with_code_one_and_says_why(
    z_file, z_map, tmp_path, capsys, monkeypatch
):
    blank = jnp.full_like(z_map.spectral_radius, jnp.nan)
    lost = jnp.zeros(blank.shape, dtype=bool).at[:, 0].set(True)

    def ending(away):
        return ij.RESULTS.where(away, ij.RESULTS.not_finite, ij.RESULTS.not_converged)

    result = jax.vmap(jax.vmap(jax.vmap(ending)))(lost)
    failed = eqx.tree_at(
        lambda m: (m.spectral_radius, m.response, m.count, m.result),
        z_map,
        (blank, blank, jnp.zeros_like(z_map.count), result),
    )
    monkeypatch.setattr("isojax.stability.stability_map", lambda *_, **__: failed)
    assert main(["map", z_file, *WINDOW, "--out", str(tmp_path), "--quiet"]) == 1
    text = capsys.readouterr().out
    assert "20 cells (15 not converged, 5 left every bound)" in text
    with np.load(tmp_path / "map.npz") as stored:
        np.testing.assert_array_equal(stored["result"][0, :, 0], [2, 1, 1, 1])


@pytest.mark.slow
def test_a_model_that_follows_the_pressure_is_mapped_at_one(z_map, tmp_path, capsys, monkeypatch):
    follows = ij.paper.z_direction().with_elements(ij.elements.PressureStiffness(4e5, 2e5))
    path, mapped = tmp_path / "model.json", []
    ij.save_model(follows, path)
    monkeypatch.setattr(
        "isojax.stability.stability_map", lambda model, *_, **__: mapped.append(model) or z_map
    )
    command = ["map", str(path), *WINDOW, "--out", str(tmp_path / "out"), "--quiet"]
    assert main(command) == 2
    assert "--pressure must be given" in capsys.readouterr().err
    assert main([*command, "--pressure", "2.5e5"]) == 0
    assert eqx.tree_equal(mapped, [follows.at(pressure=2.5e5)])


@pytest.mark.slow
def test_nothing_is_written_where_a_picture_fails(z_file, z_map, tmp_path, monkeypatch):
    def fail(*_, **__):
        raise ValueError("no ink")

    monkeypatch.setattr("isojax.stability.stability_map", lambda *_, **__: z_map)
    monkeypatch.setattr("isojax.reporting.page._map_files.plot_response_map", fail)
    assert main(["map", z_file, *WINDOW, "--out", str(tmp_path / "out"), "--quiet"]) == 2
    assert not (tmp_path / "out").exists()


def test_help_documents_every_option_and_the_exit_codes(capsys):
    with pytest.raises(SystemExit) as ended:
        main(["map", "--help"])
    assert ended.value.code == 0
    shown = " ".join(capsys.readouterr().out.split())
    for option in (
        "--amplitudes",
        "--frequencies",
        "--no-coexisting",
        "--folds",
        "--out",
        "--checkpoint",
        "--next-record",
        "--pressure",
        "--temperature",
        "--json",
        "--verbose",
        "--quiet",
    ):
        assert option in shown
    for word in (
        "map.npz",
        "curves.png",
        "map.png",
        "response.png",
        "folds.png",
        "no cell of a map did",
        "200 if omitted",
    ):
        assert word in shown


@pytest.mark.slow
def test_coexisting_map_follows_its_folds_to_both_cusps_and_resumes(tmp_path, capsys):
    ij.save_model(ij.paper.y_direction(), tmp_path / "model.json")
    words = [
        "map",
        str(tmp_path / "model.json"),
        "--amplitudes",
        "120",
        "220",
        "26",
        "--frequencies",
        "4",
        "5",
        "11",
    ]
    words += ["--folds", "--checkpoint", str(tmp_path / "kept")]
    assert main([*words, "--out", str(tmp_path / "one")]) == 0
    shown = capsys.readouterr()
    assert "orbits" in shown.err
    assert "closed curve, cusps at 1" in shown.out
    assert (tmp_path / "one" / "folds.png").read_bytes().startswith(PNG)
    assert list((tmp_path / "kept").glob("*.npz"))
    assert main([*words, "--out", str(tmp_path / "two"), "--quiet"]) == 0
    assert capsys.readouterr().err == ""
    with np.load(tmp_path / "one" / "map.npz") as one, np.load(tmp_path / "two" / "map.npz") as two:
        assert one["count"].max() == 3
        # 176 N lies between the folds at 4.2 Hz, 171.89 and 178.12 N; 168 and 180 N do not.
        row = {round(float(force)): place for place, force in enumerate(one["amplitudes"])}
        assert [int(one["count"][row[force], 2]) for force in (168, 176, 180)] == [1, 3, 1]
        for name in one.files:
            np.testing.assert_array_equal(one[name], two[name])
