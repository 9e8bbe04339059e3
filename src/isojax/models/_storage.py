"""Models on disk: JSON, without loss."""

import json
import math
import os
import tempfile
from pathlib import Path
from typing import Any

from .._parameters import own_parameters, required_parameters
from .._types import check_float64
from ..elements import CATALOGUE
from ._isolator import Isolator

FORMAT = "isojax-model"


def model_to_dict(model: Isolator) -> dict[str, Any]:
    """Give a model as plain numbers and words.

    Args:
        model: the isolator.

    Returns:
        A dictionary that JSON holds without loss (shortest decimal that reads back the same float64).
    """
    return {
        "format": FORMAT,
        "version": 1,
        "excitation": model.excitation,
        "mass": float(model.mass),
        "elements": [
            {"name": element.name}
            | {field: float(getattr(element, field)) for field, _ in own_parameters(element)}
            for element in model.elements
        ],
    }


def write_whole(path: Path, content: str | bytes) -> None:
    """Write a file whole or not at all: to a temporary file beside it, then rename.

    Args:
        path: the file.
        content: its content; text is written as UTF-8.
    """
    data = content.encode() if isinstance(content, str) else content
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=path.name, suffix=".part")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise


def save_model(model: Isolator, path: str | Path) -> None:
    """Save a model as JSON.

    Args:
        model: the isolator.
        path: the file to write; its folder must exist.

    Raises:
        ValueError: if a parameter is not finite.

    Example:
        >>> ij.save_model(ij.paper.y_direction(), "model.json")
    """
    for entry in model.parameters:
        if not math.isfinite(entry.value):
            raise ValueError(f"Argument `model` must be finite, but its {entry.name} is {entry.value}.")
    write_whole(Path(path), json.dumps(model_to_dict(model), indent=1) + "\n")


def load_model(path: str | Path) -> Isolator:
    """Load a model saved by `save_model`.

    Args:
        path: the JSON file.

    Returns:
        The isolator, equal to the one saved.

    Raises:
        ValueError: if the file is missing, is no isojax model, names an unknown element or parameter, or
            holds something else than a finite number for one.
        RuntimeError: if JAX is not in 64-bit mode.

    Example:
        >>> ij.save_model(ij.paper.y_direction(), "model.json")
        >>> model = ij.load_model("model.json")
        >>> [element.name for element in model.elements][:2]
        ['linear_stiffness', 'abs_quadratic_stiffness']
    """
    check_float64()
    path = Path(path)
    return model_from_dict(read_json(path), path)


def read_json(path: Path) -> Any:
    """Give what a JSON file holds.

    Args:
        path: the file.

    Returns:
        Numbers, words, lists and dictionaries.

    Raises:
        ValueError: if it is missing or is no JSON file.
    """
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ValueError(f"{path}: cannot be read ({error.strerror}).") from None
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"{path}: is no JSON file ({error}).") from None


def model_from_dict(content: Any, path: Path) -> Isolator:
    """Give the model of `model_to_dict`'s numbers and words.

    Args:
        content: what a file holds.
        path: the file, which messages name.

    Returns:
        The isolator.

    Raises:
        ValueError: as `load_model` does.
        RuntimeError: if JAX is not in 64-bit mode.
    """
    check_float64()
    if not isinstance(content, dict) or content.get("format") != FORMAT or content.get("version") != 1:
        raise ValueError(f'{path}: must hold "format": "{FORMAT}", "version": 1, but does not.')
    unknown = sorted(set(content) - {"format", "version", "excitation", "mass", "elements"})
    if unknown:
        raise ValueError(f"{path}: unknown key {unknown[0]!r}.")
    if content.get("excitation") not in ("force", "base_acceleration"):
        found = content.get("excitation")
        raise ValueError(f'{path}: "excitation" must be "force" or "base_acceleration", but is {found!r}.')
    if not isinstance(content.get("elements"), list):
        raise ValueError(f'{path}: "elements" must be a list, but is {content.get("elements")!r}.')
    elements = []
    for entry in content["elements"]:
        name = entry.get("name") if isinstance(entry, dict) else None
        if name not in CATALOGUE:
            known = ", ".join(sorted(CATALOGUE))
            raise ValueError(f"{path}: element name must be one of {known}, but is {name!r}.")
        kind = CATALOGUE[name]
        expected = [field for field, _ in own_parameters(kind)]
        values = {key: value for key, value in entry.items() if key != "name"}
        # A file of before an element had one of its numbers holds the law that is its default.
        if not set(required_parameters(kind)) <= set(values) <= set(expected):
            raise ValueError(f"{path}: element {name} must hold {expected}, but holds {sorted(values)}.")
        numbers = {key: _finite_number(path, name, key, value) for key, value in values.items()}
        elements.append(kind(**numbers))
    mass = _finite_number(path, "the model", "mass", content.get("mass"))
    if not mass > 0:
        raise ValueError(f"{path}: mass of the model must be positive, but is {mass}.")
    return Isolator(mass, tuple(elements), content["excitation"])


def _finite_number(path: Path, owner: str, key: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ValueError(f"{path}: {key} of {owner} must be a finite number, but is {value!r}.")
    return float(value)
