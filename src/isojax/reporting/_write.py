"""What a closed loop leaves on disk."""

import json
from pathlib import Path

from ..identification import Loop
from ..models import Isolator, model_to_dict, write_whole
from ._page import render_page
from ._result import result_dict


def check_folder(folder: str | Path) -> Path:
    """Refuse a folder that cannot be written to; nothing is made yet.

    Args:
        folder: where results shall go.

    Returns:
        Its path.

    Raises:
        ValueError: if something else than a folder is in the way.
    """
    folder = Path(folder)
    for part in (folder, *folder.parents):
        if part.exists() and not part.is_dir():
            raise ValueError(f"{folder} must be a folder, but {part} is a file.")
    return folder


def write_report(loop: Loop, folder: str | Path) -> None:
    """Write report.html, result.json and model.json; everything is ready before the first is written.

    Args:
        loop: the closed loop.
        folder: where they go; made if it is not there. Other files in it stay as they are.

    Raises:
        ValueError: if something else than a folder is in the way, or the model is not finite.
    """
    folder = check_folder(folder)
    for entry in loop.after.model.parameters:
        if entry.value != entry.value:
            raise ValueError(
                f"Argument `loop` must hold a finite model, but its {entry.name} is {entry.value}."
            )
    texts = {
        "model.json": model_text(loop.after.model),
        "report.html": render_page(loop),
        "result.json": json.dumps(result_dict(loop), indent=1, allow_nan=False) + "\n",
    }
    write_texts(folder, texts)


def model_text(model: Isolator) -> str:
    """Give a model as `save_model` writes it.

    Args:
        model: the isolator.

    Returns:
        JSON.

    Raises:
        ValueError: if a parameter is not finite.
    """
    return json.dumps(model_to_dict(model), indent=1, allow_nan=False) + "\n"


def write_texts(folder: Path, texts: dict[str, str]) -> None:
    """Write files whole; the folder is made now that everything to write is ready.

    Args:
        folder: where they go.
        texts: content by file name.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in texts.items():
        write_whole(folder / name, text)
