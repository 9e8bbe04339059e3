"""Map very many cells in bounded memory: tile by tile, each written as it is done, going on where it stopped.

Run: python benchmarks/large_map.py [--rows 10000] [--columns 10000] [--tile 1000] [--out DIR]

The paper's y model, 1-120 N x 4-8 Hz, one orbit a cell. Each tile is a map of its own, of which the spectral
radius and the response are kept as a file; a tile whose file exists is left out. Printed: cells, seconds
and microseconds a cell beside those of one map of 100,000 cells, the largest resident memory, the size of
the files, the largest error that a tile reports and cells without an orbit. Without --out the files go to a
temporary folder, which is removed.
"""

import argparse
import math
import os
import resource
import tempfile
import time
from pathlib import Path

import jax

jax.config.update("jax_enable_x64", True)

import numpy as np  # noqa: E402  (float64 first)

from isojax import paper  # noqa: E402
from isojax.stability import stability_map  # noqa: E402

AMPLITUDES, FREQUENCIES = (1.0, 120.0), (4.0, 8.0)
SMALL = 400, 250
"""Rows and columns of the map that the cost of a cell is compared with."""


def make_tile(forces: np.ndarray, band: np.ndarray, file: Path) -> tuple[float, int]:
    """Map one tile and write it whole or not at all; give its error and the cells without an orbit."""
    smap = stability_map(paper.y_direction(), forces, band)
    radius, response = np.asarray(smap.spectral_radius), np.asarray(smap.response)
    unfinished = file.with_suffix(".part")
    with unfinished.open("wb") as stream:
        np.savez(stream, spectral_radius=radius, response=response, error=smap.error)
    os.replace(unfinished, file)
    return float(smap.error), int(np.isnan(radius).sum())


def small_map() -> float:
    """Give the seconds of a map of 100,000 cells, compiled: the median of three."""
    axes = np.linspace(*AMPLITUDES, SMALL[0]), np.linspace(*FREQUENCIES, SMALL[1])
    seconds = []
    for _ in range(4):
        begun = time.perf_counter()
        jax.block_until_ready(stability_map(paper.y_direction(), *axes))
        seconds.append(time.perf_counter() - begun)
    return float(np.median(seconds[1:]))


def main() -> None:
    """Map all tiles and print what it took."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--rows", type=int, default=10_000, help="drive amplitudes")
    parser.add_argument("--columns", type=int, default=10_000, help="frequencies")
    parser.add_argument("--tile", type=int, default=1000, help="rows and columns of a tile at most")
    parser.add_argument("--out", type=Path, help="folder of the files; a temporary one if omitted")
    options = parser.parse_args()
    small = small_map() / math.prod(SMALL)
    with tempfile.TemporaryDirectory() as temporary:
        folder = options.out or Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        forces = np.linspace(*AMPLITUDES, options.rows)
        band = np.linspace(*FREQUENCIES, options.columns)
        begun, made, worst, empty, first = time.perf_counter(), 0, 0.0, 0, 0.0
        for row in range(0, options.rows, options.tile):
            for column in range(0, options.columns, options.tile):
                own = forces[row : row + options.tile], band[column : column + options.tile]
                file = folder / f"tile-{row:06d}-{column:06d}.npz"
                if file.exists():
                    continue
                error, missing = make_tile(*own, file)
                worst, empty, made = max(worst, error), empty + missing, made + own[0].size * own[1].size
                first = first or time.perf_counter() - begun
        seconds = time.perf_counter() - begun
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
        size = sum(file.stat().st_size for file in folder.glob("tile-*.npz")) / 1e6
    cells, each = options.rows * options.columns, math.prod(SMALL)
    print(f"{made:,} of {cells:,} cells made: {seconds:.1f} s, the first tile {first:.1f} s with compiling")
    if made:
        print(f"{1e6 * seconds / made:.3f} us a cell; of a map of {each:,} cells {1e6 * small:.3f}")
    print(f"largest resident memory {peak:.0f} MB; files {size:.0f} MB")
    print(f"largest error that a tile reports {worst:.1e}; cells without an orbit {empty}")


if __name__ == "__main__":
    main()
