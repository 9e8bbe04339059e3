import dataclasses
import json
from types import SimpleNamespace

import numpy as np
import pytest

from isojax import RESULTS, ClosedLoop, load_model, write_report
from isojax.reporting import result_dict

PARAMETER = {"value", "standard_error", "unit"}
ERROR = {"rmse", "nrmse", "nrmse_segments", "chi2_per_dof"}
RANKED = {"effect", "z", "p_value", "delta_bic", "admissible"}
FINDING = {
    "effect",
    "indistinguishable",
    "p_value",
    "excess_explained",
    "held_out_share",
    "ranking",
    "separating_experiment",
}


def is_number_or_none(value):
    return value is None or (isinstance(value, float) and np.isfinite(value))


def check_schema(result):
    """Schema 1 of result.json, written out by hand."""
    keys = [
        "schema",
        "campaign",
        "check_first",
        "before",
        "verdict",
        "findings",
        "after",
        "bounds",
        "seconds",
        "errors",
    ]
    assert list(result) == keys
    assert result["schema"] == 1
    assert result["verdict"] in ("none", "found", "partly_explained", "unexplained")
    assert isinstance(result["seconds"], float)
    for side in (result["before"], result["after"]):
        assert set(side) == {"elements", "parameters", "error"}
        assert set(side["error"]) == {"fit", "holdout"}
        for entry in side["parameters"].values():
            assert set(entry) == PARAMETER
            assert isinstance(entry["unit"], str)
            assert is_number_or_none(entry["value"])
            assert is_number_or_none(entry["standard_error"])
        for errors in side["error"].values():
            if errors is not None:
                assert set(errors) == ERROR
                assert all(is_number_or_none(value) for value in errors.values())
    for finding in result["findings"]:
        assert set(finding) == FINDING
        for entry in finding["ranking"]:
            assert set(entry) - {"held_out_share"} == RANKED  # of those that were tried on unseen records
            assert isinstance(entry["admissible"], bool)
    for bound in result["bounds"].values():
        assert set(bound) == {"upper", "unit"}
    for side, rows in result["errors"].items():
        assert set(rows[0]) == {"horizon", "fit", "holdout"}
        assert rows[-1]["horizon"] is None
        assert rows[-1]["fit"] == result[side]["error"]["fit"]["rmse"]
        assert [row["horizon"] for row in rows[:-1]] == sorted(row["horizon"] for row in rows[:-1])


def test_result_follows_schema_one(found, plain):
    for loop in (found, plain):
        check_schema(json.loads(json.dumps(result_dict(loop), allow_nan=False)))


def test_result_names_every_parameter_and_gives_no_error_to_fixed_ones(found):
    result = result_dict(found)
    assert result["before"]["elements"] == ["linear_stiffness", "cubic_stiffness", "linear_damping"]
    parameters = result["after"]["parameters"]
    assert parameters["mass"] == {"value": 800.0, "standard_error": None, "unit": "kg"}
    assert parameters["coulomb_friction.width"]["standard_error"] is None
    assert parameters["coulomb_friction.force_level"]["standard_error"] > 0
    assert parameters["cubic_stiffness.coefficient"]["unit"] == "N/m^3"
    assert "coulomb_friction.force_level" not in result["before"]["parameters"]


def test_nan_becomes_null_and_units_of_the_output_are_resolved(found):
    result = result_dict(found)
    assert result["findings"][0]["ranking"][2]["delta_bic"] is None
    assert result["bounds"]["sensor_offset"] == {"upper": 1e-4, "unit": "m/s^2"}


def test_without_held_out_records_the_block_is_null(plain):
    result = result_dict(plain)
    assert result["before"]["error"]["holdout"] is None
    assert result["findings"] == []
    assert result["before"] == result["after"]


def test_failed_fit_is_written_with_nulls_and_said_in_the_report(plain, tmp_path):
    unknown = plain.after.errors["fit"]._replace(
        rmse=np.nan, nrmse=np.nan, nrmse_segments=np.nan, chi2_per_dof=np.nan
    )
    runs, restarts = plain.after.free_runs, plain.after.restarts
    errors = {"fit": unknown, "holdout": None}
    held = SimpleNamespace(errors=errors, free_runs=runs, restarts=restarts, bent=())
    failed = plain.after._replace(result=RESULTS.not_converged, evaluation=held)
    loop = dataclasses.replace(plain, before=failed, after=failed, verdict="unexplained")
    ClosedLoop(loop).report(tmp_path / "deep" / "out")
    result = json.loads((tmp_path / "deep" / "out" / "result.json").read_text(encoding="utf-8"))
    assert set(result["after"]["error"]["fit"].values()) == {None}
    assert "The fit failed" in (tmp_path / "deep" / "out" / "report.html").read_text(encoding="utf-8")


def test_files_come_together_and_others_stay(found, written):
    assert sorted(path.name for path in written.glob("[!.]*") if path.suffix != ".png") == [
        "fit.json",
        "model.json",
        "notes.txt",
        "report.html",
        "report.md",
        "result.json",
    ]
    assert (written / "notes.txt").read_text(encoding="utf-8") == "mine"
    level = load_model(written / "model.json")["coulomb_friction.force_level"]
    assert float(level) == float(found.after.model["coulomb_friction.force_level"])


def test_a_file_in_the_way_is_refused_and_nothing_is_written(found, tmp_path):
    (tmp_path / "out").write_text("a file", encoding="utf-8")
    with pytest.raises(ValueError, match="must be a folder"):
        write_report(found, tmp_path / "out" / "below")
    assert (tmp_path / "out").read_text(encoding="utf-8") == "a file"


def test_a_model_that_is_not_finite_writes_nothing(found, tmp_path):
    model = found.after.model.replace(coulomb_friction__force_level=np.nan)
    with pytest.raises(ValueError, match=r"coulomb_friction\.force_level"):
        write_report(dataclasses.replace(found, after=found.after._replace(model=model)), tmp_path / "out")
    assert not (tmp_path / "out").exists()
