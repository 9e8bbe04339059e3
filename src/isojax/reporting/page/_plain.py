"""What is in data files and in a map, as plain numbers and words for other programs."""

import dataclasses
import math
from pathlib import Path
from typing import Any

import numpy as np

from ...models import model_to_dict
from ...records import FileInspection
from ...stability import FoldCurve, StabilityMap


def inspection_dict(file: FileInspection) -> dict[str, Any]:
    """Give what is in a data file, without its samples.

    Args:
        file: the inspected file.

    Returns:
        The fields of `FileInspection` and of its channels and dwells, under their names; None where a number
        is not finite.
    """
    return _plain(file)


def map_dict(smap: StabilityMap, folds: FoldCurve | None = None) -> dict[str, Any]:
    """Give what a map says of each cell.

    Args:
        smap: the map.
        folds: around cells with several orbits.

    Returns:
        "model"; "amplitudes" [N or m/s^2] and "frequencies" [Hz]; for each cell, a row each amplitude,
        "count" of orbits and "spectral_radius", the largest multiplier of its orbits (None without orbit);
        "error" of that by integration; "folds", None or "amplitudes" and "frequencies" along the curve,
        whether it is "closed", and its "cusps".
    """
    radius = np.asarray(smap.spectral_radius)
    worst = np.fmax.reduce(radius, axis=0) if radius.ndim == 3 else radius
    return _plain(
        {
            "model": model_to_dict(smap.model),
            "amplitudes": np.asarray(smap.amplitudes).tolist(),
            "frequencies": np.asarray(smap.frequencies).tolist(),
            "count": np.asarray(smap.count).tolist(),
            "spectral_radius": worst.tolist(),
            "error": float(smap.error),
            "folds": None
            if folds is None
            else {
                "amplitudes": np.asarray(folds.amplitude).tolist(),
                "frequencies": np.asarray(folds.frequency).tolist(),
                "closed": bool(folds.closed),
                "cusps": [
                    {"amplitude": float(cusp.amplitude), "frequency": float(cusp.frequency)}
                    for cusp in folds.cusps
                ],
            },
        }
    )


def _plain(value: Any) -> Any:
    """Give what JSON holds; arrays of samples are left out."""
    if dataclasses.is_dataclass(value):
        value = {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
    if isinstance(value, dict):
        return {key: _plain(one) for key, one in value.items() if not isinstance(one, np.ndarray)}
    if isinstance(value, list | tuple):
        return [_plain(one) for one in value]
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value
