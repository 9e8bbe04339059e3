"""A contributor adds one file and one line, those of CONTRIBUTING.md, and everything sees the effect."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import isojax

ROOT = Path(__file__).parents[2]
NAME = "van_der_pol_damping"
CHECKS = (
    "tests/elements/test_contract.py",
    "tests/test_effect_pages.py",
    "tests/test_no_catalogue_names.py",
    "tests/test_campaign_page.py",
    "tests/identification/test_separating_words.py",
    "tests/identification/test_passivity.py",
    "tests/identification/test_fit_recovery.py",
)
"""Tests that ask every effect of the catalogue."""

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Runs Python with a copy of the package that has the effect of CONTRIBUTING.md."""
    folder = tmp_path_factory.mktemp("package")
    shutil.copytree(Path(isojax.__file__).parent, folder / "isojax")
    page = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    law, line = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    elements = folder / "isojax" / "elements"
    (elements / f"_{NAME}.py").write_text(law, encoding="utf-8")
    catalogue = (elements / "__init__.py").read_text(encoding="utf-8")
    assert len(line.splitlines()) == 1
    (elements / "__init__.py").write_text(catalogue.replace("\nCATALOGUE", f"{line}\nCATALOGUE"), "utf-8")

    def python(*arguments) -> str:
        found = subprocess.run(
            [sys.executable, *map(str, arguments)],
            cwd=ROOT,
            env={**os.environ, "PYTHONPATH": str(folder), "COLUMNS": "200", "ISOJAX_UNCHECKED": "1"},
            capture_output=True,
            text=True,
        )
        assert found.returncode == 0, found.stdout[-6000:] + found.stderr[-2000:]
        return found.stdout

    return python


@pytest.fixture(scope="module")
def journey(run, tmp_path_factory):
    """What the way from records to the report saw, and the folder of the report."""
    folder = tmp_path_factory.mktemp("out")
    printed = run(ROOT / "tests" / "elements" / "new_effect_journey.py", NAME, folder)
    return json.loads(printed.splitlines()[-1]), folder


def test_no_test_that_asks_the_whole_catalogue_fails(run):
    # Cases of other effects, but for its look-alike, are as they were; its orbit is tried below by itself.
    others = " or ".join(set(isojax.elements.CATALOGUE) - {"position_damping"})
    chosen = f"({NAME} or not ({others})) and not has_finite_multipliers"
    printed = run("-m", "pytest", "-n", "0", "-q", "-p", "no:cacheprovider", *CHECKS, "-k", chosen)
    assert re.search(r"\d{3,} passed", printed)
    assert not re.search(r"failed|error|skipped", printed)


def test_the_command_line_lists_it(run):
    assert NAME in run("-m", "isojax", "effects")


def test_the_site_has_a_page_for_it_and_names_it_on_that_of_its_look_alike(run, tmp_path):
    run(ROOT / "docs" / "build_catalogue.py", tmp_path)
    page = (tmp_path / f"{NAME}.md").read_text(encoding="utf-8")
    assert "`c (x^2/x0^2 - 1) v` [N]." in page
    assert "exactly, beside a free `linear_damping`" in page
    assert "may feed energy in" in page
    assert f"[`{NAME}`]({NAME}.md)" in (tmp_path / "position_damping.md").read_text(encoding="utf-8")
    assert f"[{NAME}]({NAME}.md)" in (tmp_path / "README.md").read_text(encoding="utf-8")


def test_beside_a_free_linear_damper_it_is_reported_with_position_damping(journey):
    seen, folder = journey
    assert seen["verdict"] == "found"
    assert [set(names) for names in seen["findings"]] == [{NAME, "position_damping"}]
    assert "goes on without a drive" in seen["advice"]
    result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    [finding] = result["findings"]
    assert {finding["effect"], *finding["indistinguishable"]} == {NAME, "position_damping"}
    assert "van der Pol" in (folder / "report.html").read_text(encoding="utf-8")


def test_beside_a_known_linear_damper_it_is_named_alone_with_its_numbers_although_it_is_active(journey):
    seen, _ = journey
    assert seen["alone"] == [NAME]
    np.testing.assert_allclose(seen["alone_refit"], seen["truth"], rtol=0.01)


def test_its_orbit_is_stable_and_its_energy_that_of_the_closed_form(journey):
    seen, _ = journey
    assert len(seen["multipliers"]) == 2
    assert max(seen["multipliers"]) < 1.0
    np.testing.assert_allclose(seen["work"], seen["work_in_closed_form"], rtol=1e-10)
