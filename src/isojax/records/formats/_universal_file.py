"""Universal files (.uff, .unv): time histories in datasets 58 and 58b, without meshes, modes and spectra."""

import re
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .._wording import listing
from ._limits import check_count, check_demand
from ._samples import Column, as_samples, find_channel, missing_extra

_TIME_RESPONSE = (0, 1)  # function type "general" and "time response"
_TIME_AXES = (0, 1, 17)  # abscissa "unknown", "general" and "time"; 18 is frequency


_BYTE, _LINE = 16, 150
"""Bytes of memory that a byte and a line of the file take."""


def read_universal_columns(file: Path, names: Sequence[str] | None) -> dict[str, Column]:
    """Gives the named time histories of a universal file.

    A channel is named by its first header line, its response entity, its ordinate label or "node:direction",
    as far as that names one channel only.

    Args:
        file: The file, ASCII or binary.
        names: Channel names; None for all time histories.

    Returns:
        Name to column, with the rate and start time that the file states.

    Raises:
        ValueError: If pyuff is not installed, or if the file cannot be read, is cut short, holds no time
            history, or has no or several channels of a name.
    """
    histories = _time_histories(file)
    labels = [_labels(one) for one in histories]
    if names is None:
        unique = [[one for one in own if sum(one in other for other in labels) == 1] for own in labels]
        names = [own[0] for own in unique if own]
    return {name: _dataset_column(file, name, histories[find_channel(file, name, labels)]) for name in names}


def _time_histories(file: Path) -> list[dict[str, Any]]:
    try:
        import pyuff
    except ImportError as error:
        raise missing_extra(file, "pyuff", "universal files") from error
    check_demand(file, _BYTE * file.stat().st_size)
    raw = file.read_bytes()
    check_demand(file, _BYTE * len(raw) + _LINE * (raw.count(b"\n") + raw.count(b"\r")), text=len(raw))
    if not raw.strip():
        raise ValueError(f"{file} is empty; expected a universal file with datasets 58")
    stray = re.search(rb"\r\r\n|\r(?!\n)", raw) is not None and b"58b" not in raw[: 1 << 16]
    with tempfile.TemporaryDirectory() as folder:
        source = file
        if stray:
            source = Path(folder) / "clean.uff"
            source.write_bytes(re.sub(rb"\r+\n?", b"\n", raw))
        universal = pyuff.UFF(str(source))
        types = [int(one) for one in universal.get_set_types()]
        check_count(file, len(types))
        sets = [universal.read_sets(i) for i, one in enumerate(types) if one == 58]
    if not types:
        raise ValueError(f"{file} holds no dataset; expected a universal file with datasets 58")
    found = [one for one in sets if isinstance(one, dict)]
    histories = [one for one in found if _is_time_history(one)]
    if not histories:
        other = sorted({one for one in types if one != 58})
        spectra = [f"{_labels(one)[0]} (function type {one['func_type']})" for one in found]
        held = f"spectra only: {listing(spectra)}" if spectra else f"datasets {other} only"
        raise ValueError(f"{file} holds {held}; expected a real time history (dataset 58, function type 1)")
    return histories


def _is_time_history(one: dict[str, Any]) -> bool:
    real = not np.iscomplexobj(one["data"])
    return real and one["func_type"] in _TIME_RESPONSE and one["abscissa_spec_data_type"] in _TIME_AXES


def _labels(one: dict[str, Any]) -> list[str]:
    written = [one.get("id1"), one.get("rsp_ent_name"), one.get("ordinate_axis_lab")]
    named = [str(text).strip() for text in written if text and str(text).strip() not in ("", "NONE")]
    return list(dict.fromkeys([*named, f"{one.get('rsp_node')}:{one.get('rsp_dir')}"]))


def _dataset_column(file: Path, name: str, one: dict[str, Any]) -> Column:
    samples, announced = as_samples(one["data"], file, name), int(one["num_pts"])
    if announced != samples.size:
        raise ValueError(
            f"{file}: the header of channel `{name}` announces {announced} samples, but {samples.size} follow"
        )
    if one["abscissa_spacing"] == 1:
        step, start = float(one["abscissa_inc"]), float(one["abscissa_min"])
    else:
        times = np.asarray(one["x"], dtype=np.float64)
        steps = np.diff(times)
        step, start = float((times[-1] - times[0]) / (times.size - 1)), float(times[0])
        if np.any(np.abs(steps - step) > 0.5 * abs(step)):
            raise ValueError(
                f"{file}: the time steps of channel `{name}` are uneven; expected a uniform grid"
            )
    if not step > 0:
        raise ValueError(f"{file}: channel `{name}` states a time step of {step} s; it must be above 0")
    return Column(samples, rate=1.0 / step, start=start, unit=_unit(one))


def _unit(one: dict[str, Any]) -> str | None:
    """Gives the label of the ordinate's unit, where the file has one."""
    written = str(one.get("ordinate_axis_units_lab") or "").strip()
    return None if written in ("", "NONE") else written
