"""Time maps, orbits under vmap and fits on a GPU against the CPU of the same machine, in double precision.

Run: python benchmarks/accelerator.py [--repeats 3] [--cores 0] (needs the extra `bench` and a jaxlib with
CUDA; about four minutes). Each device works in a process of its own, since JAX chooses once where arrays
live. `--cores 2` holds the CPU's process to two cores, as other benchmarks are.

Printed of each task: seconds of the first call, which compiles; the median of later calls on both devices;
how many times faster the GPU is; and how far the answers lie apart. PASS or FAIL stands only beside the
answers. The exit status is 1 after a FAIL.

- map: `stability_map` of the paper's y model, 1000 x 500 cells, 1-120 N x 4-8 Hz, one orbit a cell.
- all orbits: `stability_map(coexisting=True)`, 400 x 200 cells, 1-500 N x 3.5-8 Hz.
- orbits: `find_periodic_orbit` and its multipliers under `jax.jit(jax.vmap(...))`, as a script of one's own
  calls it, 2,000 drives of 1-60 N x 6-8 Hz.
- fit: six coefficients to the 12 records of 116 s at 1 kHz of `fit_speed.py`.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

DRIVES = 40, 50
"""Amplitudes and frequencies of the orbits under vmap."""


def tasks() -> dict[str, Callable[[], dict[str, np.ndarray]]]:
    """Give what is timed: each returns the numbers that both devices must agree on."""
    import jax

    jax.config.update("jax_enable_x64", True)
    import isojax as ij
    from fit_speed import find_campaign, values_of
    from isojax.identification import classical_guess, fit
    from isojax.stability import find_periodic_orbit, stability_map

    model = ij.paper.y_direction()

    def one_orbit() -> dict[str, np.ndarray]:
        smap = stability_map(model, np.linspace(1.0, 120.0, 1000), np.linspace(4.0, 8.0, 500))
        return {"radius": np.asarray(smap.spectral_radius)}

    def all_orbits() -> dict[str, np.ndarray]:
        axes = np.linspace(1.0, 500.0, 400), np.linspace(3.5, 8.0, 200)
        smap = stability_map(model, *axes, coexisting=True)
        return {"count": np.asarray(smap.count), "radius": np.nanmax(smap.spectral_radius, axis=0)}

    forces, band = np.linspace(1.0, 60.0, DRIVES[0]), np.linspace(6.0, 8.0, DRIVES[1])
    force, frequency = (np.ravel(values) for values in np.meshgrid(forces, band, indexing="ij"))

    @jax.jit
    @jax.vmap
    def radius_of(amplitude: jax.Array, frequency: jax.Array) -> jax.Array:
        return find_periodic_orbit(model, ij.Harmonic(amplitude, frequency)).floquet.spectral_radius

    def orbits() -> dict[str, np.ndarray]:
        return {"radius": np.asarray(radius_of(force, frequency))}

    start = classical_guess(ij.read_campaign(find_campaign())).model

    def fitted() -> dict[str, np.ndarray]:
        found = fit(start, ij.read_campaign(find_campaign()))
        if not np.isfinite(found.errors["fit"].rmse):
            raise RuntimeError("The fit failed.")
        return {"coefficients": np.array(values_of(found.model))}

    return {"map": one_orbit, "all orbits": all_orbits, "orbits": orbits, "fit": fitted}


def measure(repeats: int, answers: Path) -> None:
    """Do every task on the device of this process; print its seconds, and keep the answers."""
    import jax

    seconds: dict[str, list[float]] = {}
    kept: dict[str, np.ndarray] = {}
    for name, work in tasks().items():
        seconds[name] = []
        for _ in range(1 + repeats):
            begun = time.perf_counter()
            given = work()
            seconds[name].append(time.perf_counter() - begun)
        kept |= {f"{name}/{what}": values for what, values in given.items()}
        print(f"{jax.devices()[0].platform} {name}: {seconds[name]}", file=sys.stderr, flush=True)
    np.savez(answers, **kept)
    print(json.dumps({"device": jax.devices()[0].device_kind, "seconds": seconds}))


def on(platform: str, options: argparse.Namespace, answers: Path) -> dict:
    """Measure in a process of its own."""
    command = [sys.executable, __file__, "--measure", str(answers), "--repeats", str(options.repeats)]
    environment = {**os.environ, "JAX_PLATFORMS": platform}
    cores = sorted(os.sched_getaffinity(0))[: options.cores or None]

    def hold() -> None:
        if platform == "cpu":
            os.sched_setaffinity(0, cores)

    done = subprocess.run(
        command, check=True, stdout=subprocess.PIPE, text=True, env=environment, preexec_fn=hold
    )
    return json.loads(done.stdout.splitlines()[-1]) | {"cores": len(cores)}


def main() -> None:
    """Measure both and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--repeats", type=int, default=3, help="timed calls after the first")
    parser.add_argument("--cores", type=int, default=0, help="cores of the CPU's process; all if 0")
    parser.add_argument("--platforms", nargs=2, default=("cpu", "cuda"), help="of JAX, the slower one first")
    parser.add_argument("--measure", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.measure:
        measure(options.repeats, options.measure)
        return
    from fit_speed import find_campaign

    find_campaign()  # simulated once for both
    with tempfile.TemporaryDirectory() as folder:
        files = [Path(folder) / f"{place}.npz" for place in range(2)]
        plain, fast = (on(*each) for each in zip(options.platforms, [options] * 2, files, strict=True))
        ours, theirs = (dict(np.load(file)) for file in files)
    print(f"{plain['device']} with {plain['cores']} cores, and {fast['device']}; double precision\n")
    print(f"{'':12s}{'first [s]':>20s}{'later [s]':>20s}{'times faster':>14s}{'answers apart':>16s}")
    met = True
    for name in plain["seconds"]:
        slow, quick = (np.array(one["seconds"][name]) for one in (plain, fast))
        apart = 0.0
        for key in (key for key in ours if key.startswith(f"{name}/")):
            one, other = ours[key], theirs[key]
            same = np.array_equal(np.isnan(one), np.isnan(other))
            largest = np.nanmax(np.abs(one - other) / np.maximum(np.abs(one), 1e-3))
            apart = max(apart, float(largest) if same else float("inf"))
        met &= apart < 1e-4
        later = np.median(slow[1:]), np.median(quick[1:])
        print(f"{name:12s}{slow[0]:10.2f}{quick[0]:10.2f}{later[0]:10.3f}{later[1]:10.3f}", end="")
        print(f"{later[0] / later[1]:14.2f}{apart:16.1e}  {'PASS' if apart < 1e-4 else 'FAIL'}")
    sys.exit(not met)


if __name__ == "__main__":
    main()
