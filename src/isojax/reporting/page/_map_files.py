"""What a stability map leaves on disk: its arrays, its pictures, the folds around several orbits."""

import io
import json
from pathlib import Path

import numpy as np

from ..._output_folder import check_folder, publish
from ..._results import RESULTS, is_successful
from ...models import EndsEstimated, Estimated, model_to_dict
from ...stability import FoldCurve, StabilityMap, continue_branch, fold_curve
from ..plots import plot_fold_curve, plot_response_curves, plot_response_map, plot_stability_map
from ._png import png_bytes

_CODES = ("successful", "not_converged", "not_finite", "not_accurate", "sticks", "no_further_orbit")
"""Codes of a cell's result, 0 first."""

_ARRAYS = (
    "amplitudes",
    "frequencies",
    "spectral_radius",
    "multipliers",
    "stable",
    "start",
    "direction",
    "phases",
    "sides",
    "split",
    "response",
    "count",
    "y0",
)

_BESIDE = (0.1, 0.2)
"""How far past the map's frequencies and amplitudes its folds are followed, as shares: cusps lie there."""


def map_arrays(smap: StabilityMap) -> dict[str, np.ndarray]:
    """Give the numbers of a map as plain arrays, SI units, under the names of its attributes.

    Args:
        smap: the map.

    Returns:
        The arrays; `result` holds codes whose names are `result_names` and whose meaning is
        `result_words`, and `model` what `save_model` writes.
    """
    arrays = {name: np.asarray(getattr(smap, name)) for name in _ARRAYS}
    for name in ("probability_stable", "probability_coexisting", "chance_error"):
        if getattr(smap, name) is not None:
            arrays[name] = np.asarray(getattr(smap, name))
    for name, error in (smap.standard_errors or {}).items():
        arrays[f"{name}_standard_error"] = np.asarray(error)
    arrays["result"] = result_codes(smap)
    arrays["result_names"] = np.array(_CODES)
    words = [RESULTS[getattr(RESULTS, name)] for name in _CODES]
    arrays["result_words"] = np.array([word or "The orbit was found." for word in words])
    arrays["error"] = np.asarray(smap.error)
    arrays["symmetric"] = np.asarray(smap.symmetric)
    arrays["steps_per_period"] = np.asarray(smap.integrator.steps_per_period)
    arrays["model"] = np.asarray(json.dumps(model_to_dict(smap.model)))
    return arrays


def result_codes(smap: StabilityMap) -> np.ndarray:
    """Give how the search ended in each cell.

    Args:
        smap: the map.

    Returns:
        Places in `result_names`.
    """
    codes = np.ones(smap.spectral_radius.shape, dtype=np.int8)
    for code, name in enumerate(_CODES):
        codes[np.asarray(smap.result == getattr(RESULTS, name))] = code
    return codes


def folds_around(smap: StabilityMap, fit: Estimated | EndsEstimated | None = None) -> FoldCurve | None:
    """Follow the folds around cells with several orbits, from the frequency with the most of them.

    Args:
        smap: the map, with coexisting orbits.
        fit: with whose errors the curve is given its band; the model of the map is its model.

    Returns:
        The curve, also where it could be followed in part only; None where no cell holds several orbits or no
        fold was found near them.
    """
    several = np.asarray(smap.count) > 1
    if not several.any() or smap.amplitudes.size < 2 or smap.frequencies.size < 2:
        return None
    amplitudes, frequencies = np.asarray(smap.amplitudes), np.asarray(smap.frequencies)
    column = int(np.argmax(several.sum(axis=0)))
    wide, high = _BESIDE
    window = (float(amplitudes[0]) * (1.0 - high), float(amplitudes[-1]) * (1.0 + high))
    band = (float(frequencies[0]) * (1.0 - wide), float(frequencies[-1]) * (1.0 + wide))
    branch = continue_branch(
        smap.model,
        parameter="amplitude",
        frequency=float(frequencies[column]),
        start=window[0],
        stop=window[1],
        other_periods=(),
    )
    folds = [point for point in branch.special_points if point.kind == "fold" and is_successful(point.result)]
    if not folds:
        return None
    return fold_curve(smap.model, amplitude_range=window, frequency_range=band, start=folds[0], fit=fit)


def write_map(smap: StabilityMap, folder: str | Path, *, folds: FoldCurve | None = None) -> tuple[str, ...]:
    """Write map.npz, curves.png, map.png, response.png and, where there are folds, folds.png.

    Everything is ready before the first is written. A folds.png of an earlier map goes where this has none.

    Args:
        smap: the map.
        folder: where they go; made if it is not there. Other files in it stay as they are.
        folds: around cells with several orbits.

    Returns:
        Names of the files.

    Raises:
        ValueError: if something else than a folder is in the way.
        KeptElsewhereError: if they could not be written there; it names the folder that has them.
    """
    folder = check_folder(folder)
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **map_arrays(smap))  # type: ignore[arg-type]
    contents: dict[str, bytes | None] = {
        "map.npz": buffer.getvalue(),
        "curves.png": png_bytes(plot_response_curves(smap)),
        "map.png": png_bytes(plot_stability_map(smap, folds=folds)),
        "response.png": png_bytes(plot_response_map(smap, folds=folds)),
    }
    contents["folds.png"] = (
        None if folds is None else png_bytes(plot_fold_curve(folds, excitation=smap.model.excitation))
    )
    publish(folder, contents)
    return tuple(name for name, content in contents.items() if content is not None)
