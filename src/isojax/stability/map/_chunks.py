"""A long list of orbits in chunks, each kept on disk as it is done, so that a killed run goes on."""

import hashlib
import io
import json
import zipfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import jax
import numpy as np
from jax.experimental import multihost_utils

from ..._cores import usable_cores
from ..._kept import package_digest
from ..._progress import Counted
from ...models import write_whole
from ._aligned import aligned
from ._batched_newton import CellSolver, Found, lanes_of
from ._reader import SurfaceReader
from ._single_orbits import SingleOrbits
from ._starts import Candidates


def fingerprint(*parts: object) -> str:
    """Give a short word that distinguishes one map from another."""
    word = hashlib.sha256()
    for part in parts:
        leaves, structure = jax.tree_util.tree_flatten(part)
        word.update(str(structure).encode())
        for leaf in leaves:
            if callable(leaf):
                word.update(repr(leaf).encode())
                continue
            values = np.asarray(leaf)
            # Without its shape, where one axis ends and the next begins would not count.
            word.update(f"{values.shape} {values.dtype}".encode())
            word.update(values.tobytes())
    return word.hexdigest()[:16]


def run_chunks(
    solver: CellSolver | SurfaceReader | SingleOrbits,
    candidates: Candidates,
    chunk: int,
    folder: Path | None,
    name: str,
    progress: Callable[[str], None] | None,
) -> Found:
    """Find the orbits of all candidates, chunk by chunk.

    Under `jax.distributed` each process does its share of the chunks and all get the whole.

    Args:
        solver: what finds the orbits of a chunk.
        candidates: all of them.
        chunk: orbits a chunk.
        folder: where finished chunks are kept, or None.
        name: first word of the files' names.
        progress: called with a line now and then.

    Returns:
        The orbits, in the order of the candidates.
    """
    total = candidates.force.size
    lanes = lanes_of(total, chunk)
    begins = list(range(0, total, lanes))
    states = solver.states
    kinks = solver.surface.polynomials.shape[2] - states - 3
    processes, own = jax.process_count(), jax.process_index()
    paths = [None if folder is None else folder / f"{name}-{place:05d}.npz" for place in range(len(begins))]
    kept = [path is not None and path.exists() for path in paths]
    sizes = [min(lanes, total - begin) for begin in begins]
    asked = sum(size for place, size in enumerate(sizes) if place % processes == own and not kept[place])
    done: list[int] = []
    whole = _blank(total, states, kinks)

    def one(place: int) -> None:
        begin, path = begins[place], paths[place]
        if place % processes != own:
            return
        cells = Candidates(*(values[begin : begin + lanes] for values in candidates))
        if path is not None and kept[place]:
            part = _read(path, cells)
        else:
            part = solver(cells, lanes)
            if path is not None:
                buffer = io.BytesIO()
                content: dict[str, Any] = {**part._asdict(), **_labelled(cells)}
                np.savez(buffer, **content)
                write_whole(path, buffer.getvalue())
            if progress is not None:
                done.append(sizes[place])
                computed = sum(done)
                progress(Counted(f"{computed} of {asked} orbits", computed / asked))
        for target, values in zip(whole, part, strict=True):
            target[begin : begin + lanes] = values

    # A batch keeps one core busy; each core runs its own. Chunks over several devices go one by one.
    cores = 1 if solver.sharding.num_devices > 1 else usable_cores()
    with ThreadPoolExecutor(cores) as pool:
        list(pool.map(one, range(len(begins))))
    if processes > 1:
        gathered = multihost_utils.process_allgather(whole)
        owner = np.repeat(np.arange(len(begins)) % processes, sizes)
        whole = Found(*(np.asarray(values)[owner, np.arange(total)] for values in gathered))
    return whole


def _blank(count: int, states: int, kinks: int) -> Found:
    return Found(
        aligned((count, states)),
        aligned((count, 2)),
        aligned((count, kinks)),
        aligned((count, states), complex),
        aligned((count,)),
        aligned((count,)),
        aligned((count,), np.int8),
    )


def claim_folder(folder: Path, identity: str) -> None:
    """Mark a folder as this map's, or refuse it.

    Args:
        folder: to keep chunks in.
        identity: word for this very map.

    Raises:
        ValueError: if it is no folder, belongs to another map, or its chunks were computed by other code.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError) as problem:
        raise ValueError(
            f"Argument `checkpoint` must name a folder, but a file is in the place of {folder} or of a "
            "folder above it."
        ) from problem
    label, own = folder / "map.json", {"identity": identity, "code": package_digest()}
    if not label.exists():
        if any(folder.glob("*.npz")):
            raise ValueError(f"Argument `checkpoint` names {folder}, which holds chunks of no known map.")
        write_whole(label, json.dumps(own) + "\n")
        return
    try:
        held = json.loads(label.read_text(encoding="utf-8"))
    except ValueError as problem:
        raise ValueError(
            f"Argument `checkpoint` must name the folder of a map, but {label} is damaged ({problem}). "
            "Delete the folder."
        ) from problem
    for key, words in (
        ("identity", "the chunks of another map"),
        ("code", "chunks that other code computed: other versions or sources of isojax, JAX or NumPy"),
    ):
        if held.get(key) != own[key]:
            raise ValueError(
                f"Argument `checkpoint` names {folder}, which holds {words} ({held.get(key)}, not "
                f"{own[key]}). Give an empty folder, or delete this one."
            )


def _labelled(cells: Candidates) -> dict[str, np.ndarray]:
    """Give what a chunk says of the orbits that it holds."""
    return {f"sought_{name}": np.asarray(values) for name, values in cells._asdict().items()}


def _read(path: Path, cells: Candidates) -> Found:
    """Read a finished chunk, which must be that of some orbits."""
    try:
        with np.load(io.BytesIO(path.read_bytes())) as finished:
            part = Found(*(finished[field] for field in Found._fields))
            own = all(np.array_equal(finished[name], values) for name, values in _labelled(cells).items())
    except (zipfile.BadZipFile, EOFError, KeyError, ValueError, OSError) as problem:
        raise ValueError(
            f"Argument `checkpoint` must hold whole chunks, but {path} is damaged ({problem}). Delete this "
            "file; its cells are then found again."
        ) from problem
    if not own:
        raise ValueError(
            f"Argument `checkpoint` must hold each chunk under its own name, but {path} holds other cells. "
            "Delete this file; its cells are then found again."
        )
    return part
