"""The notebooks: stored with outputs and pictures, which a run from top to bottom gives again."""

import base64
import json
import re
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[1] / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))
ABSOLUTE = re.compile(r"(?<![\w./:)])(?:~|/[A-Za-z][\w.-]*)/|\b[A-Za-z]:\\|file://")

each_notebook = pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)


def test_every_notebook_is_looked_at():
    assert NOTEBOOKS
    assert {path.parent for path in FOLDER.rglob("*.ipynb")} == {FOLDER}


@pytest.mark.parametrize("text", ["/home/someone/x.csv", "open('/tmp/x')", "~/data", r"C:\data", "file:///x"])
def test_absolute_paths_are_recognised(text):
    assert ABSOLUTE.search(text)


@pytest.mark.parametrize("text", ["chi2/dof", "../src/isojax", "https://example.org/a/b", "a / b", "m/s²"])
def test_relative_paths_and_units_are_no_absolute_paths(text):
    assert not ABSOLUTE.search(text)


LARGEST, LARGEST_PICTURE = 600_000, 200_000
"""Bytes of a notebook and of a picture, so that a clone and a page with them stay small."""

RELATIVE = 0.01
"""By how much a number may differ from the stored one, beside one unit of its last digit.

Another processor adds in another order. A fit then ends within its own tolerance, far inside the standard
errors, but what is made of small differences, such as a curvature, a z or a p-value, may show it in its
third digit.
"""

NUMBER = re.compile(r"(?<![\w.])[-+−]?\d+(?:\.(?P<digits>\d+))?(?:e(?P<power>[-+]?\d+))?")
FRAME = re.compile(r"(?:[\s─━│┃]|\x1b\[[\d;]*m)+")
"""Blanks, lines and styles of a table, whose widths follow from the digits."""


def differences(stored: str, found: str) -> list[str]:
    """List how two texts differ: their words, or else numbers beyond the tolerance."""
    stored, found = (FRAME.sub(" ", text).strip() for text in (stored, found))
    if NUMBER.sub("#", stored) != NUMBER.sub("#", found):
        return [f"{stored!r} became {found!r}"]
    pairs = zip(NUMBER.finditer(stored), NUMBER.finditer(found), strict=True)
    return [f"{old[0]} became {new[0]}" for old, new in pairs if not _close(old, new)]


def _close(old: re.Match[str], new: re.Match[str]) -> bool:
    one, other = (float(number[0].replace("−", "-")) for number in (old, new))
    last = 10.0 ** (int(old["power"] or 0) - len(old["digits"] or ""))
    whole = old["digits"] is None and old["power"] is None
    return abs(one - other) <= max(0.0 if whole else 1.001 * last, RELATIVE * abs(one))


def texts(cell) -> str:
    """Give what a cell shows as text, without the HTML of the same."""
    shown = (output.get("text", output.get("data", {}).get("text/plain", "")) for output in cell["outputs"])
    return "\n".join("".join(text) for text in shown)


def pictures(cell) -> list[str]:
    """Give the PNG pictures that a cell shows, in base 64."""
    shown = (output.get("data", {}).get("image/png") for output in cell["outputs"])
    return ["".join(picture) for picture in shown if picture is not None]


def code_cells(notebook) -> list:
    """Give the cells that run."""
    return [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]


def read(path: Path) -> dict:
    """Give the stored notebook."""
    return json.loads(path.read_text(encoding="utf-8"))


@pytest.mark.parametrize(
    ("stored", "found", "count"),
    [
        ("Fc = 30.003 ± 0.014 N", "Fc = 30.004 ± 0.013 N", 0),
        ("Fc = 30.003 ± 0.014 N", "Fc = 30.903 ± 0.014 N", 1),
        ("│ a │ 9.99 │", "│ a │ 10.00 │", 0),
        ("z 1.31e3, 7 dwells", "z 1.32e3, 7 dwells", 0),
        ("z 1.31e3, 7 dwells", "z 1.41e3, 8 dwells", 2),
        ("−0.0021 N", "0.0021 N", 1),
        ("found: coulomb_friction", "found: dahl_friction", 1),
    ],
)
def test_texts_differ_by_words_or_by_more_than_the_tolerance(stored, found, count):
    assert len(differences(stored, found)) == count


@each_notebook
def test_notebook_is_stored_as_it_ran_from_top_to_bottom(path):
    notebook = read(path)
    assert path.stat().st_size < LARGEST
    assert set(notebook["metadata"]) <= {"kernelspec", "language_info"}
    assert notebook["metadata"]["kernelspec"]["name"] == "python3"
    assert notebook["metadata"]["language_info"] == {"name": "python"}
    assert all(cell["metadata"] == {} for cell in notebook["cells"])
    cells = code_cells(notebook)
    assert [cell["execution_count"] for cell in cells] == list(range(1, len(cells) + 1))
    assert any(pictures(cell) for cell in cells)
    for cell in cells:
        source = "".join(cell["source"])
        assert not [output for output in cell["outputs"] if output.get("name") == "stderr"], source
        assert not re.search(r"Warning\b|Traceback|\bat 0x[0-9a-f]+", texts(cell)), source
        for picture in pictures(cell):
            content = base64.b64decode(picture)
            assert content.startswith(b"\x89PNG")
            assert len(content) < LARGEST_PICTURE
        if ".plot." in source or ".plot(" in source:
            assert pictures(cell), f"{source}\n\nshowed no picture"


@each_notebook
def test_notebook_holds_no_absolute_path(path):
    for cell in read(path)["cells"]:
        said = texts(cell) if cell["cell_type"] == "code" else ""
        found = ABSOLUTE.search("".join(cell["source"])) or ABSOLUTE.search(said)
        assert found is None, found


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::DeprecationWarning:(jupyter|nbclient|nbformat|zmq|ipykernel)")
@each_notebook
def test_a_run_gives_the_stored_outputs(path):
    # Here, because its imports may warn, and only the warnings of this test are told to let that pass.
    from run_notebook import executed

    for old, new in zip(code_cells(read(path)), code_cells(executed(path)), strict=True):
        assert not [output for output in new["outputs"] if output.get("name") == "stderr"], texts(new)
        assert differences(texts(old), texts(new)) == [], "".join(old["source"])
        assert len(pictures(new)) == len(pictures(old))
