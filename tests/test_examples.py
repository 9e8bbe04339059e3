"""The scripts of README.md run, and the examples of the docstrings print what they say.

They are in one file, so that one process runs them: both go from the demo campaign to a diagnosis, and from a
branch to its sensitivity, and what the one has compiled serves the other.
"""

import doctest
import inspect
import re
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest

import isojax as ij

README = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")
SCRIPTS = re.findall(r"^## ([^\n]+)\n+```python\n(.*?)^```$", README, flags=re.MULTILINE | re.DOTALL)

JOURNEY = """
    read_campaign classical_guess fit load_fit uncertainty next_record profile next_test residual
    explain_remainder diagnose extend find_separating_experiment close_loop design
""".split()
"""Examples that go on with what the one before has made, so that one test runs them in a row."""

QUICK = {"Harmonic", "Integrator", "Isolator", "compile_quickly", "is_successful", "load_model", "save_model"}


def test_readme_has_a_script_for_a_fit_a_map_and_a_sensitivity():
    assert [title for title, _ in SCRIPTS] == ["A fit", "A map", "A sensitivity"]


@pytest.mark.slow
@pytest.mark.parametrize(("title", "script"), SCRIPTS, ids=[title for title, _ in SCRIPTS])
def test_a_script_of_readme_runs_by_itself(title, script, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    mpl.use("agg")
    exec(compile(script, f"README.md, {title}", "exec"), {"__name__": "__main__"})
    assert capsys.readouterr().out


def documented():
    """Public functions and classes; result codes need no example."""
    shown = {name: getattr(ij, name) for name in dir(ij) if name != "RESULTS"}
    shown |= {name: one for name, one in vars(ij.inference).items() if inspect.isfunction(one)}
    return {name: one for name, one in shown.items() if inspect.isfunction(one) or inspect.isclass(one)}


def run(name, names):
    """Run the examples of a name in a name space, which keeps what they make; give what went wrong."""
    example = doctest.DocTestParser().get_doctest(inspect.getdoc(getattr(ij, name)), names, name, None, None)
    assert example.examples, f"{name} has no example"
    said = []
    doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE).run(
        example, out=said.append, clear_globs=False
    )
    names.update(example.globs)
    return "".join(said)


def test_every_public_function_has_an_example():
    assert len(documented()) > 25
    assert [name for name, one in documented().items() if ">>> " not in inspect.getdoc(one)] == []


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[] if name in QUICK else pytest.mark.slow)
        for name in documented()
        if name not in JOURNEY
    ],
)
def test_an_example_prints_what_it_says(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert run(name, {"ij": ij, "np": np}) == ""


@pytest.mark.slow
def test_the_examples_from_campaign_to_closed_loop_go_on_from_each_other(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = {"ij": ij, "np": np}
    for name in JOURNEY:
        assert run(name, names) == "", name
    assert (tmp_path / "out" / "report.html").exists()
