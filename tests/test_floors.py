"""The house: floors import downwards only, and importing the package does nothing but import."""

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SOURCES = sorted((ROOT / "src" / "isojax").rglob("*.py"))


def python(script: str) -> subprocess.CompletedProcess:
    """Run a script in an interpreter of its own, every warning an error."""
    environment = {key: value for key, value in os.environ.items() if not key.startswith("JAX_")}
    return subprocess.run(
        [sys.executable, "-W", "error", "-c", script],
        capture_output=True,
        text=True,
        env=environment,
        check=False,
    )


def imported(tree: ast.Module) -> set[str]:
    """First names of the packages that a file imports from outside."""
    names = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            names.add(node.module.partition(".")[0])
    return names


def test_each_floor_imports_from_lower_floors_only():
    command = Path(sys.executable).with_name("lint-imports")
    done = subprocess.run([command, "--no-cache"], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_importing_every_module_prints_nothing_and_sets_no_flag():
    done = python(
        "import jax, warnings\n"
        "before = dict(jax.config.values)\n"
        "filters = list(warnings.filters)\n"
        "import importlib, pkgutil, isojax\n"
        "names = [module.name for module in pkgutil.walk_packages(isojax.__path__, 'isojax.')]\n"
        "assert len(names) > 40, names\n"
        "for name in names:\n"
        "    if not name.endswith('__main__'):\n"
        "        importlib.import_module(name)\n"
        "changed = {key for key, value in jax.config.values.items() if before.get(key, value) != value}\n"
        "assert not changed, changed\n"
        "assert not jax.config.jax_enable_x64\n"
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout == ""
    assert done.stderr == ""


def test_importing_the_package_starts_no_device():
    done = python(
        "import isojax\nfrom jax._src import xla_bridge\nassert not xla_bridge.backends_are_initialized()\n"
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(ROOT / "src")))
def test_a_source_file_keeps_the_house_rules(path):
    text = path.read_text(encoding="utf-8")
    tree = ast.parse(text)
    parts = path.relative_to(ROOT / "src" / "isojax").parts
    assert len(text.splitlines()) <= 400
    assert ast.get_docstring(tree) or not text.strip()
    assert "from __future__" not in text
    names = imported(tree)
    if parts[0] != "reporting":
        assert "matplotlib" not in names
    if parts[0] in ("records", "rig"):
        assert not names & {"jax", "equinox", "diffrax", "optimistix", "lineax"}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom):
            assert all(alias.name != "*" for alias in node.names)
        if isinstance(node, ast.Call) and parts != ("_cli.py",):
            assert ast.unparse(node.func) != "jax.config.update"
