"""What a closed loop leaves on disk."""

import json
import math
from collections.abc import Callable, Mapping
from pathlib import Path

from ..._output_folder import check_folder, publish
from ..._results import is_successful
from ...health import CampaignHealth, campaign_health
from ...identification import Fit, Loop
from ...models import model_to_dict
from ._page import page_content, render_pages
from ._result import result_dict

MAP_FILES = ("map.npz", "map.png", "response.png", "folds.png", "curves.png")
"""What a map writes."""

MODEL_FILES = ("model.json", "fit.json", "fit.txt", "report.html", "result.json", "report.md", "report_*.png")
"""What a fit or a loop writes, as patterns."""


def write_report(
    loop: Loop,
    folder: str | Path,
    health: Callable[[], CampaignHealth] | None = None,
    *,
    markdown: bool = False,
) -> None:
    """Write result.json, model.json and fit.json, and then, once its pictures are drawn, report.html.

    The numbers are there whatever becomes of the health of the data, which joins result.json once it is
    computed, and of the pictures; one that cannot be drawn is a line of the report.

    Where the last fit failed there is no model: model.json and fit.json are not written, and those of before
    are removed. So are the other files that isojax wrote there: they belong to another run.

    Args:
        loop: the closed loop.
        folder: where they go; made if it is not there. Files that isojax did not write stay as they are.
        health: gives that of its campaign; computed here if omitted.
        markdown: whether to write report.md as well, with its pictures report_*.png beside it.

    Raises:
        ValueError: if something else than a folder is in the way, or a model that was found is not finite.
        KeptElsewhereError: if they could not be written there; it names the folder that has them.
    """
    folder = check_folder(folder)
    # Each step may fail, and must not take with it what is known before.
    numbers = {"model.json": model_text(loop.after), "fit.json": fit_text(loop.after)}
    write_model_files(folder, numbers)
    write_model_files(folder, {**numbers, "result.json": _result_text(loop)})
    known = campaign_health(loop) if health is None else health()
    numbers["result.json"] = _result_text(loop, known)
    write_model_files(folder, numbers)
    pages = render_pages(page_content(loop, known), markdown=markdown)
    # All of them again: what a full disk does not take is then whole in another place.
    write_model_files(folder, {**numbers, **pages})


def _result_text(loop: Loop, health: CampaignHealth | None = None) -> str:
    """Give result.json."""
    return json.dumps(result_dict(loop, health), indent=1, allow_nan=False) + "\n"


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


def fit_text(fit: Fit) -> str | None:
    """Give a fit as `Fit.save` writes it, from which a map of its model takes the errors.

    Args:
        fit: the fit.

    Returns:
        JSON; None where the search failed.
    """
    if not is_successful(fit.result):
        return None
    return json.dumps(fit.to_dict(), indent=1, allow_nan=False) + "\n"


def write_model_files(folder: Path, contents: Mapping[str, str | bytes | None]) -> None:
    """Write what belongs to a model; what an earlier run wrote there, a map included, belongs to another.

    Args:
        folder: where they go.
        contents: content by file name; a file whose content is None is not written.

    Raises:
        KeptElsewhereError: if they could not be written there; it names the folder that has them.
    """
    publish(folder, contents, (*MODEL_FILES, *MAP_FILES))
