"""Writing a campaign to disk in the form of campaign.toml, with the truth beside it."""

import csv
import io
import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ._bench import DEFAULT_BENCH, Bench, SimulatedRecord, run
from ._instruments import Instrument
from ._law import Law
from ._plan import Plan
from ._plant import BASE_NAMES, Plant

_UNITS = {"acceleration": "m/s^2", "velocity": "m/s", "displacement": "m"}

_FLOOR = ("", "[floor]", 'quantity = "acceleration"', 'column = "floor"', 'unit = "m/s^2"')


def write_campaign(
    folder: str | Path,
    plant: Plant,
    plan: Plan | Sequence[Plan],
    seed: int,
    title: str,
    bench: Bench = DEFAULT_BENCH,
    file_format: Literal["npz", "csv"] = "npz",
    declared: tuple[str, ...] = BASE_NAMES,
) -> Path:
    """Run a plan and write campaign.toml, one file and (for dwells) one schedule per record, and truth.json.

    Args:
        folder: made if it is not there.
        plant: the plant.
        plan: what to test, or several plans one after the other.
        seed: as in `run`; the same seed writes the same bytes.
        title: of the campaign.
        bench: how it is measured.
        file_format: of the records: compressed NPZ of float32, or CSV.
        declared: base laws that [model] names.

    Returns:
        Path of campaign.toml.
    """
    folder = Path(folder)
    records = run(plant, plan, seed, bench)
    folder.mkdir(parents=True, exist_ok=True)
    for record in records:
        columns: dict[str, Any] = {
            "force": record.force.astype(np.float32),
            bench.output: record.output.astype(np.float32),
        }
        if record.floor is not None:
            columns["floor"] = record.floor.astype(np.float32)
        content = _npz(columns) if file_format == "npz" else _csv(columns)
        _write(folder / f"{record.name}.{file_format}", content)
        if record.schedule:
            _write(folder / f"{record.name}_schedule.csv", _schedule(record))
    _write(folder / "truth.json", (json.dumps(truth(plant, bench), indent=1) + "\n").encode())
    campaign = folder / "campaign.toml"
    _write(campaign, _toml(records, plant, title, bench, file_format, declared).encode())
    return campaign


def truth(plant: Plant, bench: Bench) -> dict[str, Any]:
    """What a campaign hides: effect, spec, base, noise and drift, as in truth.json."""
    specs = [_spec(effect) for effect in plant.hidden]
    return {
        "effect": "+".join(spec["kind"] for spec in specs) or "none",
        "spec": {} if not specs else specs[0] if len(specs) == 1 else {"kind": "several", "parts": specs},
        "base": plant.base_coefficients,
        "noise": bench.noise,
        "drift": bench.drift,
    }


def _spec(effect: Law | Instrument) -> dict[str, Any]:
    return {
        "kind": effect.name,
        "q": [
            np.asarray(value, dtype=float).tolist() for name, value in vars(effect).items() if name[0] != "_"
        ],
    }


def _terms(declared: tuple[str, ...], kind: str) -> list[str]:
    """Terms of one kind as [model] writes them: "cubic" for "cubic_damping"."""
    return [name.removesuffix(f"_{kind}") for name in declared if name.endswith(kind)]


def _write(path: Path, content: bytes) -> None:
    """Write a file whole or not at all."""
    partial = path.with_name(path.name + ".part")
    partial.write_bytes(content)
    os.replace(partial, path)


def _npz(columns: dict[str, Any]) -> bytes:
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **columns)
    return buffer.getvalue()


def _csv(columns: dict[str, np.ndarray]) -> bytes:
    buffer = io.StringIO()
    np.savetxt(
        buffer,
        np.stack(list(columns.values()), axis=1),
        "%.9g",
        delimiter=",",
        header=",".join(columns),
        comments="",
    )
    return buffer.getvalue().encode()


def _schedule(record: SimulatedRecord) -> bytes:
    buffer = io.StringIO()
    rows = csv.writer(buffer, lineterminator="\n")
    rows.writerow(["start_s", "frequency_hz", "cycles"])
    rows.writerows([f"{value:.6f}" for value in dwell] for dwell in record.schedule)
    return buffer.getvalue().encode()


def _toml(
    records: Sequence[SimulatedRecord],
    plant: Plant,
    title: str,
    bench: Bench,
    file_format: str,
    declared: tuple[str, ...],
) -> str:
    """Text of campaign.toml."""
    lines = [
        "[campaign]",
        f"title = {json.dumps(title)}",
        f"mass = {float(plant.mass)!r}",
        "",
        "[input]",
        'quantity = "force"',
        'column = "force"',
        'unit = "N"',
        "",
        "[output]",
        f'quantity = "{bench.output}"',
        f'column = "{bench.output}"',
        f'unit = "{_UNITS[bench.output]}"',
        *(_FLOOR if records[0].floor is not None else ()),
        "",
        "[sampling]",
        f"rate = {float(bench.rate)!r}",
        "",
        "[model]",
        *(f"{kind} = {json.dumps(_terms(declared, kind))}" for kind in ("stiffness", "damping")),
    ]
    for record in records:
        lines += ["", "[[record]]", f'file = "{record.name}.{file_format}"']
        lines += [f'schedule = "{record.name}_schedule.csv"'] if record.schedule else []
        lines += [
            f"level = {float(record.level)!r}",
            f'direction = "{record.direction}"',
            f"repeat = {record.repeat}",
            f'role = "{record.role}"',
        ]
        lines += [f"period = {record.period}"] if record.period is not None else []
        lines += [f"settle = {record.settle}"] if record.settle else []
        lines += [f"pressure = {record.pressure!r}"] if record.pressure is not None else []
    return "\n".join(lines) + "\n"
