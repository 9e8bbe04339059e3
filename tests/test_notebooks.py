"""The notebooks: committed without outputs, and every cell runs, in the order in which it is read."""

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


@each_notebook
def test_notebook_holds_no_outputs(path):
    notebook = json.loads(path.read_text(encoding="utf-8"))
    assert set(notebook["metadata"]) <= {"kernelspec", "language_info"}
    assert notebook["metadata"]["kernelspec"]["name"] == "python3"
    for cell in notebook["cells"]:
        assert cell["metadata"] == {}
        if cell["cell_type"] == "code":
            assert cell["outputs"] == []
            assert cell["execution_count"] is None


@each_notebook
def test_notebook_holds_no_absolute_path(path):
    for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]:
        found = ABSOLUTE.search("".join(cell["source"]))
        assert found is None, found


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::DeprecationWarning:(jupyter|nbclient|nbformat|zmq|ipykernel)")
@each_notebook
def test_notebook_runs_from_top_to_bottom(path, tmp_path, monkeypatch):
    # Here, because their imports may warn, and only the warnings of this test are told to let that pass.
    import nbclient
    import nbformat

    # The kernel inherits this: the notebook asks for double precision itself and leaves the home alone.
    monkeypatch.delenv("JAX_ENABLE_X64", raising=False)
    monkeypatch.setenv("JAX_PLATFORMS", "cpu")
    for name in ("IPYTHONDIR", "JUPYTER_RUNTIME_DIR"):
        monkeypatch.setenv(name, str(tmp_path / name.lower()))
    workplace = tmp_path / "workplace"
    workplace.mkdir()

    notebook = nbformat.read(path, as_version=4)
    nbformat.validate(notebook)
    client = nbclient.NotebookClient(
        notebook, timeout=600, kernel_name="python3", resources={"metadata": {"path": str(workplace)}}
    )
    client.execute()  # raises CellExecutionError with the traceback of the cell

    for cell in notebook.cells:
        if cell.cell_type != "code":
            continue
        shown = [name for output in cell.outputs for name in output.get("data", {})]
        said = "".join(output.text for output in cell.outputs if output.get("name") == "stderr")
        assert said == "", f"{cell.source}\n\nwrote to stderr:\n{said}"
        if ".plot." in cell.source or ".plot(" in cell.source:
            assert "image/png" in shown, f"{cell.source}\n\nshowed no picture"
