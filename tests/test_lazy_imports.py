"""A command imports what it needs when it needs it, so that a refusal takes no longer than the reading."""

import json
import subprocess
import sys
import tomllib
from pathlib import Path

import lazy_loader
import pytest

import isojax
from isojax.demo import campaign_folder

ROOT = Path(__file__).parents[1]
PRINT_PACKAGES = """
import json, sys
from isojax._cli import main
try:
    code = main(sys.argv[1:])
except SystemExit as end:
    code = end.code
print(json.dumps([code, sorted({name.partition(".")[0] for name in sys.modules})]))
"""
COMPUTING = {"diffrax", "optimistix", "lineax", "matplotlib", "h5py"}
DRAWN_WITH = COMPUTING | {"jax", "equinox", "numpy", "scipy", "pandas", "pint", "rich"}


def packages_after(*arguments: object) -> tuple[int, set[str]]:
    """Exit code of a command, and the packages that it has imported."""
    words = [sys.executable, "-c", PRINT_PACKAGES, *map(str, arguments)]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    code, packages = json.loads(done.stdout.splitlines()[-1])
    return code, set(packages)


@pytest.mark.parametrize("arguments", [["--version"], ["close-loop", "--help"]])
def test_words_about_a_command_import_nothing_that_computes(arguments):
    code, packages = packages_after(*arguments)
    assert code == 0
    assert not packages & DRAWN_WITH


def test_a_bad_data_file_is_refused_before_anything_that_fits_or_draws_is_imported(tmp_path):
    declared = (campaign_folder() / "campaign.toml").read_text(encoding="utf-8")
    first = tomllib.loads(declared)["record"][0]
    (tmp_path / "campaign.toml").write_text(declared.replace(first["file"], "bad.csv"), encoding="utf-8")
    (tmp_path / "bad.csv").write_text("force,acceleration\n1,2\n3,4,5\n", encoding="utf-8")
    code, packages = packages_after("close-loop", tmp_path, "--out", tmp_path / "out")
    assert code == 2
    assert not packages & (COMPUTING | {"jax", "equinox"})


@pytest.mark.parametrize(
    ("words", "name"), [(["inspect"], "bad.csv"), (["close-loop", "--out", "none"], "campaign.toml")]
)
def test_a_bad_table_or_declaration_is_refused_before_jax_is_imported(words, name, tmp_path):
    (tmp_path / name).write_text("force,acceleration\n1,2\n3,4,5\n", encoding="utf-8")
    code, packages = packages_after(*words, tmp_path / name)
    assert code == 2
    assert not packages & (COMPUTING | {"jax", "equinox"})


def test_every_name_that_type_checkers_see_is_there():
    _, listed, _ = lazy_loader.attach_stub("isojax", isojax.__file__)
    assert sorted(listed()) == dir(isojax)
    for name in dir(isojax):
        assert getattr(isojax, name) is vars(isojax)[name]


def test_the_package_says_that_it_is_typed():
    assert Path(isojax.__file__).with_name("py.typed").is_file()


def test_the_citation_is_of_this_version():
    cited = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"\nversion: {isojax.__version__}\n" in cited
