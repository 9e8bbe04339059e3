"""What a closed loop leaves on disk."""

import json
import math
from collections.abc import Mapping
from pathlib import Path

from ..._results import is_successful
from ...health import CampaignHealth, campaign_health
from ...identification import Fit, Loop
from ...models import model_to_dict, write_whole
from ._page import page_content, render_pages
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


def write_report(
    loop: Loop, folder: str | Path, health: CampaignHealth | None = None, *, markdown: bool = False
) -> None:
    """Write report.html, result.json and model.json; everything is ready before the first is written.

    Where the last fit failed there is no model: no model.json is written, and one of before is removed.

    Args:
        loop: the closed loop.
        folder: where they go; made if it is not there. Other files in it stay as they are.
        health: of its campaign; computed here if omitted.
        markdown: whether to write report.md as well, with its pictures report_*.png beside it. If not, those
            of an earlier run are removed.

    Raises:
        ValueError: if something else than a folder is in the way, or a model that was found is not finite.
    """
    folder = check_folder(folder)
    health = campaign_health(loop) if health is None else health
    texts = {
        **dict.fromkeys(["report.md", *(path.name for path in folder.glob("report_*.png"))]),
        "model.json": model_text(loop.after),
        **render_pages(page_content(loop, health), markdown=markdown),
        "result.json": json.dumps(result_dict(loop, health), indent=1, allow_nan=False) + "\n",
    }
    write_texts(folder, texts)


def model_text(fit: Fit) -> str | None:
    """Give the model of a fit as `save_model` writes it.

    Args:
        fit: the fit.

    Returns:
        JSON; None where the search failed, so that no one goes on with numbers that were not found.

    Raises:
        ValueError: if a parameter of a model that was found is not finite.
    """
    if not is_successful(fit.result):
        return None
    for entry in fit.model.parameters:
        if not math.isfinite(entry.value):
            raise ValueError(
                f"Argument `fit` must hold a finite model, but its {entry.name} is {entry.value}."
            )
    return json.dumps(model_to_dict(fit.model), indent=1, allow_nan=False) + "\n"


def write_texts(folder: Path, texts: Mapping[str, str | bytes | None]) -> None:
    """Write files whole; the folder is made now that everything to write is ready.

    Args:
        folder: where they go.
        texts: content by file name; None removes the file that an earlier run left.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in texts.items():
        if text is None:
            (folder / name).unlink(missing_ok=True)
        else:
            write_whole(folder / name, text)
