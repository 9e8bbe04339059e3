"""A long list of orbits in chunks, each kept on disk as it is done, so that a killed run goes on."""

import hashlib
import io
import json
from collections.abc import Callable
from pathlib import Path

import jax
import numpy as np
from jax.experimental import multihost_utils

from ..models import write_whole
from ._pass import CellSolver, Found
from ._starts import Candidates


def fingerprint(*parts: object) -> str:
    """Give a short word that tells one map from another.

    Args:
        *parts: models, integrators, arrays, numbers.

    Returns:
        Hexadecimal word.
    """
    word = hashlib.sha256()
    for part in parts:
        leaves, structure = jax.tree_util.tree_flatten(part)
        word.update(str(structure).encode())
        for leaf in leaves:
            word.update(np.asarray(leaf).tobytes() if not callable(leaf) else repr(leaf).encode())
    return word.hexdigest()[:16]


def run_chunks(
    solver: CellSolver,
    candidates: Candidates,
    chunk: int,
    folder: Path | None,
    identity: str,
    progress: Callable[[str], None] | None,
) -> Found:
    """Find the orbits of all candidates, chunk by chunk.

    Under `jax.distributed` each process does its share of the chunks and all get the whole.

    Args:
        solver: what finds the orbits of a chunk.
        candidates: all of them.
        chunk: orbits a chunk.
        folder: where finished chunks are kept, or None.
        identity: word for this very map; a folder that holds another's chunks is refused.
        progress: called with a line now and then.

    Returns:
        The orbits, in the order of the candidates.

    Raises:
        ValueError: if `folder` belongs to another map.
    """
    total = candidates.force.size
    # No wider than need be: small maps compile and run a small pass. At least one lane for each device.
    lanes = min(chunk, max(1 << max(total - 1, 0).bit_length(), 1024))
    begins = list(range(0, total, lanes))
    if folder is not None:
        _claim(folder, identity)
    states, kinks = 2 + solver.model.internal_states, solver.kinks
    processes, own = jax.process_count(), jax.process_index()
    parts: list[Found] = []
    for place, begin in enumerate(begins):
        if place % processes != own:
            parts.append(_blank(min(lanes, total - begin), states, kinks))
            continue
        path = None if folder is None else folder / f"chunk-{place:05d}.npz"
        if path is not None and path.exists():
            with np.load(path) as kept:
                parts.append(Found(*(kept[name] for name in Found._fields)))
            continue
        part = solver(Candidates(*(values[begin : begin + lanes] for values in candidates)), lanes)
        if path is not None:
            buffer = io.BytesIO()
            np.savez(buffer, **part._asdict())
            write_whole(path, buffer.getvalue())
        parts.append(part)
        if progress is not None:
            progress(f"{min(begin + lanes, total)} of {total} orbits")
    whole = (
        Found(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))
        if parts
        else _blank(0, states, kinks)
    )
    if processes > 1:
        gathered = multihost_utils.process_allgather(whole)
        owner = np.repeat(np.arange(len(begins)) % processes, [part.radius.size for part in parts])
        whole = Found(*(np.asarray(values)[owner, np.arange(total)] for values in gathered))
    return whole


def _blank(count: int, states: int, kinks: int) -> Found:
    return Found(
        np.full((count, states), np.nan),
        np.full((count, 2), np.nan),
        np.full((count, kinks), np.nan),
        np.full((count, states), np.nan + 0j),
        np.full(count, np.nan),
        np.full(count, np.nan),
        np.zeros(count, np.int8),
    )


def _claim(folder: Path, identity: str) -> None:
    """Mark a folder as this map's, or refuse it."""
    folder.mkdir(parents=True, exist_ok=True)
    label = folder / "map.json"
    if not label.exists():
        if any(folder.glob("chunk-*.npz")):
            raise ValueError(f"Argument `checkpoint` names {folder}, which holds chunks of no known map.")
        write_whole(label, json.dumps({"identity": identity}) + "\n")
        return
    held = json.loads(label.read_text(encoding="utf-8")).get("identity")
    if held != identity:
        raise ValueError(
            f"Argument `checkpoint` names {folder}, which holds the chunks of another map ({held}, not "
            f"{identity}). Give an empty folder, or delete this one."
        )
