"""A model on disk."""

import json
import os

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from isojax import paper
from isojax.elements import BoucWen, CoulombFriction, LinearStiffness, PressureStiffness
from isojax.models import Isolator, load_model, model_to_dict, save_model, write_whole


def test_a_model_comes_back_digit_for_digit(tmp_path):
    rng = np.random.default_rng(11)
    model = Isolator(
        rng.uniform(1.0, 1e3),
        (
            BoucWen(*rng.uniform(0.5, 10.0, 4)),
            CoulombFriction(*rng.uniform(0.0, 1.0, 2)),
            LinearStiffness(0.1 + 0.2),
        ),
        "base_acceleration",
    )
    save_model(model, tmp_path / "model.json")
    assert eqx.tree_equal(load_model(str(tmp_path / "model.json")), model)


def test_the_file_is_plain_json_with_names_and_si_numbers(tmp_path):
    save_model(paper.y_direction(), tmp_path / "model.json")
    content = json.loads((tmp_path / "model.json").read_text())
    assert content == model_to_dict(paper.y_direction())
    assert content["mass"] == 800.0
    assert {"name": "cubic_stiffness", "coefficient": 2.51667e11} in content["elements"]


def test_a_file_of_before_a_law_could_bend_holds_the_straight_line(tmp_path):
    content = model_to_dict(Isolator(2.0, (LinearStiffness(1.0), PressureStiffness(3.0, 2e5))))
    assert content["elements"][1].pop("curvature") == 0.0
    (tmp_path / "model.json").write_text(json.dumps(content))
    assert float(load_model(tmp_path / "model.json")["pressure_stiffness.curvature"]) == 0.0


def test_a_model_that_is_not_finite_is_not_written(tmp_path):
    model = paper.y_direction().replace(cubic_stiffness__coefficient=jnp.nan)
    with pytest.raises(ValueError, match=r"must be finite, but its cubic_stiffness.coefficient is nan"):
        save_model(model, tmp_path / "model.json")
    assert list(tmp_path.iterdir()) == []


def test_a_write_that_fails_leaves_the_old_file_and_no_rest(tmp_path, monkeypatch):
    path = tmp_path / "model.json"
    path.write_text("old")

    def refuse(*arguments):
        raise OSError("disk full")

    monkeypatch.setattr(os, "replace", refuse)
    with pytest.raises(OSError, match="disk full"):
        write_whole(path, "new")
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


SPRING = {"name": "linear_stiffness", "coefficient": 1.0}
GOOD = {"format": "isojax-model", "version": 1, "excitation": "force", "mass": 800.0, "elements": [SPRING]}


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("{", "is no JSON file"),
        ("[]", 'must hold "format": "isojax-model"'),
        (json.dumps(GOOD | {"version": 2}), 'must hold "format": "isojax-model", "version": 1'),
        (json.dumps(GOOD | {"colour": "red"}), "unknown key 'colour'"),
        (json.dumps(GOOD | {"excitation": "base"}), "\"excitation\" must be .*, but is 'base'"),
        (json.dumps(GOOD | {"elements": None}), '"elements" must be a list, but is None'),
        (
            json.dumps({key: value for key, value in GOOD.items() if key != "elements"}),
            '"elements" must be a list',
        ),
        (
            json.dumps(GOOD | {"elements": [{"name": "spring"}]}),
            "element name must be one of .*, but is 'spring'",
        ),
        (json.dumps(GOOD | {"elements": [3]}), "element name must be one of .*, but is None"),
        (
            json.dumps(GOOD | {"elements": [{"name": "linear_stiffness"}]}),
            r"must hold \['coefficient'\], but holds \[\]",
        ),
        (
            json.dumps(GOOD | {"elements": [SPRING | {"coefficient": "1"}]}),
            "must be a finite number, but is '1'",
        ),
        (
            json.dumps(GOOD | {"elements": [SPRING | {"coefficient": True}]}),
            "must be a finite number, but is True",
        ),
        (json.dumps(GOOD | {"mass": float("nan")}), "mass of the model must be a finite number, but is nan"),
        (json.dumps(GOOD | {"mass": -1.0}), "mass of the model must be positive, but is -1.0"),
    ],
)
def test_a_file_that_is_no_model_is_refused_by_name(tmp_path, content, message):
    path = tmp_path / "model.json"
    path.write_text(content)
    with pytest.raises(ValueError, match=message) as raised:
        load_model(path)
    assert str(path) in str(raised.value)


def test_a_missing_file_is_refused_by_name(tmp_path):
    with pytest.raises(ValueError, match=r"absent.json: cannot be read \(No such file"):
        load_model(tmp_path / "absent.json")
