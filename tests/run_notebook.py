"""Run notebooks as the tests do, each in an empty folder, and store their outputs.

python tests/run_notebook.py [FILE ...]
"""

import base64
import io
import os
import sys
import tempfile
from pathlib import Path
from typing import Any

import nbclient
import nbformat
from PIL import Image

FOLDER = Path(__file__).parents[1] / "notebooks"


def executed(path: Path) -> Any:
    """Give the notebook with the outputs of a run from top to bottom; raises with the traceback of a cell."""
    notebook = nbformat.read(path, as_version=4)
    nbformat.validate(notebook)
    with tempfile.TemporaryDirectory() as folder:
        # The notebook asks for double precision itself, and leaves the home alone.
        environment = {name: text for name, text in os.environ.items() if name != "JAX_ENABLE_X64"}
        environment |= {
            "JAX_PLATFORMS": "cpu",
            "IPYTHONDIR": f"{folder}/i",
            "JUPYTER_RUNTIME_DIR": f"{folder}/j",
        }
        workplace = Path(folder, "workplace")
        workplace.mkdir()
        client = nbclient.NotebookClient(
            notebook,
            timeout=600,
            kernel_name="python3",
            record_timing=False,
            resources={"metadata": {"path": str(workplace)}},
        )
        client.execute(env=environment)
    notebook.metadata.language_info = {"name": "python"}  # that of a run names its Python version
    return notebook


def with_small_pictures(notebook: Any) -> Any:
    """Give the notebook with a palette in each picture, which takes a third of the bytes of full colour."""
    for cell in notebook.cells:
        for output in cell.get("outputs", []):
            picture = output.get("data", {}).get("image/png")
            if picture is None:
                continue
            small, drawn = io.BytesIO(), Image.open(io.BytesIO(base64.b64decode(picture)))
            drawn.convert("RGB").quantize(96).save(small, "PNG", optimize=True)
            output.data["image/png"] = base64.b64encode(small.getvalue()).decode()
    return notebook


if __name__ == "__main__":
    for file in [Path(word) for word in sys.argv[1:]] or sorted(FOLDER.glob("*.ipynb")):
        nbformat.write(with_small_pictures(executed(file)), file)
        print(f"{file.name}: {file.stat().st_size / 1e3:.0f} kB")
