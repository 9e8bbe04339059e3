"""Time `stability_map` against SciPy, Numba and C: one orbit a cell of the paper's y model, 1-120 N x 4-8 Hz.

Run `python benchmarks/map_speed.py` (needs the extra `bench`, and a C compiler for the C peer; about three
minutes). Printed: the first call, which compiles, in a fresh process, with that process's peak memory; then,
of 1000 x 500 cells on two cores, the median seconds of later calls, the contestants taking turns, so that a
busy machine slows all; half the processor time of both cores ("work"), which other programs move less; the
errors of the multipliers against many more steps; seconds of maps of rising size, and of one of 200 x 100
cells without and with its derivatives; PASS or FAIL beside each target, a ratio of times being the median of
those of the turns; and, not judged, ratios of times and of work. The exit status is 1 after a FAIL.

The peers (_map_peers.py, _map_peer.c) solve the same equations by Newton's method with the variational
equations and stop by the same rule. Numba and C take 128 steps of RK4 a period and march up the forces, so
that nearly every cell needs one pass; each comes with the full period and with the half period of an odd
model. C is the same kernel as Numba's, and again with 16 columns of cells side by side in vector registers.
SciPy solves a random sample of cells by the half-period map, scaled to the whole and to both cores.

`stability_map` splits orbits at kinks, solves them at the nodes of a surface and reads each cell off it; a
second row holds it to the peers' 128 steps. The peers do not split, and their error is larger; the last row
of C takes the steps that it needs for the error which the map promises. The rows "z" are of the paper's z
model, 1-500 N. The errors in the lens of folds are those of random cells of a map of all orbits, 1-300 N x
3.5-8 Hz, against single orbits.
It gives the size of the motion and its state too, and reports its error. Its full-period row is of the same
model with an input offset of zero, which is not odd in its coefficients.
"""

import argparse
import json
import math
import os
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from typing import Any

# Two cores for all; threads that wait must not take them from the next contestant.
if hasattr(os, "sched_setaffinity"):
    os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:2])
os.environ["OMP_WAIT_POLICY"] = "passive"

import jax
import numpy as np

ROWS, COLUMNS = 1000, 500
STEPS = 128
LAW = (
    "linear_stiffness", "abs_quadratic_stiffness", "cubic_stiffness",
    "linear_damping", "abs_quadratic_damping", "cubic_damping",
)  # fmt: skip
SAMPLED = 50
"""Every so many columns of frequency are compared with a reference."""

FINEST = 8192
"""Steps a period of the reference."""

CLOSED_TO = 1e-10
"""Relative step of Newton's method after which the reference stops."""

LENS_CELLS = 40
"""Random cells of the map with a lens that are compared, inside the lens and outside."""

SIZES = ((250, 250), (500, 250), (500, 500), (1000, 500))
TURNS_OF_SIZES = 3


def window(rows: int = ROWS, columns: int = COLUMNS, most: float = 120.0) -> tuple[np.ndarray, np.ndarray]:
    """Give forces [N] and frequencies [Hz]."""
    return np.linspace(1.0, most, rows), np.linspace(4.0, 8.0, columns)


def timed(work: Callable[[], Any]) -> tuple[float, Any]:
    """Give the seconds that a call takes, and what it gives."""
    begin = time.perf_counter()
    given = jax.block_until_ready(work())
    return time.perf_counter() - begin, given


def worked(work: Callable[[], Any]) -> tuple[float, float]:
    """Give the seconds that a call takes, and half the processor time of both cores."""
    before = time.process_time()
    seconds, _ = timed(work)
    return seconds, 0.5 * (time.process_time() - before)


def probe() -> None:
    """Make the map once in this process, then again, and print what that took."""
    begin = time.perf_counter()
    jax.config.update("jax_enable_x64", True)
    from isojax import paper
    from isojax.stability import stability_map

    imports = time.perf_counter() - begin
    model, axes = paper.y_direction(), window()
    first, _ = timed(lambda: stability_map(model, *axes))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(json.dumps({"imports": imports, "first": first, "peak": peak}))


def run_probe() -> dict[str, float]:
    """Give seconds of imports and first call, and peak memory [MB], of a fresh process without a cache."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith("JAX_")}
    command = [sys.executable, __file__, "--probe"]
    return json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True, env=kept).stdout)


def distances(trace: np.ndarray, determinant: np.ndarray, reference: Any) -> np.ndarray:
    """Give the distance of the farther multiplier of each cell from the reference's.

    By the reference's characteristic polynomial there over its slope, which counts as 0.1 at least: where the
    two multipliers all but coincide they part like the square root of any error.
    """
    parting = np.sqrt((trace**2 - 4.0 * determinant).astype(complex))
    worst = np.zeros(trace.shape)
    for root in (0.5 * (trace + parting), 0.5 * (trace - parting)):
        polynomial = root**2 - reference.trace * root + reference.determinant
        slope = np.abs(2.0 * root - reference.trace)
        worst = np.maximum(worst, np.abs(polynomial) / np.maximum(slope, 0.1))
    return worst


class Race:
    """Everybody who takes part, and what they found."""

    def __init__(self, cells: int):
        from _map_peers import Task, c_peer, numba_peer, solve_cell
        from isojax import elements, paper
        from isojax.models import Integrator
        from isojax.stability import stability_map

        forces, frequencies = window()
        self.model = paper.y_direction()
        fixed = Integrator(steps_per_period=STEPS)

        def task_of(model: Any, pushes: np.ndarray) -> Task:
            own = [model[f"{name}.coefficient"] if model.element(name) else 0.0 for name in LAW]
            law, mass = np.array([float(value) for value in own]), float(model.mass)
            return Task(law / mass, pushes / mass, frequencies, fixed.map_tolerance)

        other = paper.z_direction()
        task, task_z = task_of(self.model, forces), task_of(other, window(most=500.0)[0])
        offset = self.model.with_elements(elements.InputOffset(0.0))
        wide = window(most=500.0)
        random = np.random.default_rng(3)
        picked = random.integers(ROWS, size=cells), random.integers(COLUMNS, size=cells)
        self.cells, self.picked = cells, picked

        def scipy_cells() -> np.ndarray:
            places = zip(*(place.tolist() for place in picked), strict=True)
            pushes, band = task.forces.tolist(), frequencies.tolist()
            return np.array([solve_cell(task, pushes[i], band[j], True) for i, j in places])

        begin = time.perf_counter()
        in_c, together = c_peer(2, 1), c_peer(2, 16)
        self.compiling = {"C": time.perf_counter() - begin}
        in_numba = numba_peer(2)
        self.run: dict[str, Callable[[], Any]] = {
            "isojax": lambda: stability_map(self.model, forces, frequencies),
            "isojax, 128 steps": lambda: stability_map(self.model, forces, frequencies, integrator=fixed),
            "isojax, full period": lambda: stability_map(offset, forces, frequencies),
            "isojax, full, 128 steps": lambda: stability_map(offset, forces, frequencies, integrator=fixed),
            "isojax, z": lambda: stability_map(other, *wide),
            "isojax, all to 500 N": lambda: stability_map(self.model, *wide, coexisting=True),
            "Numba": lambda: in_numba(task, True, STEPS),
            "Numba, full period": lambda: in_numba(task, False, STEPS),
            "SciPy": scipy_cells,
        }
        self.steps = dict.fromkeys(self.run, STEPS)
        # Closed far better than the peers: the multipliers belong to the state before the last step.
        compared = {"frequencies": frequencies[::SAMPLED].copy(), "tolerance": CLOSED_TO}
        sample = task._replace(**compared)
        self.reference = (together or in_numba)(sample, False, FINEST)
        self.reference_z = (together or in_numba)(task_z._replace(**compared), False, FINEST)
        if in_c is None or together is None:
            return
        # The peers do not split at kinks: so many steps until they keep what the map promises.
        enough = STEPS
        own = task._replace(frequencies=compared["frequencies"])
        while self.worst(together(own, True, enough)) > fixed.map_error:
            enough = 2 * math.ceil(0.55 * enough)
        for name, peer, half, steps in (
            ("C, z", in_c, True, STEPS),
            ("C, 16 cells at once, z", together, True, STEPS),
            ("C", in_c, True, STEPS),
            ("C, full period", in_c, False, STEPS),
            ("C, 16 cells at once", together, True, STEPS),
            ("C, 16 at once, full", together, False, STEPS),
            ("C, 16 at once, same error", together, True, enough),
        ):
            own = task_z if name.endswith(", z") else task
            self.run[name] = lambda peer=peer, own=own, half=half, steps=steps: peer(own, half, steps)
            self.steps[name] = steps

    def worst(self, found: Any) -> float:
        """Give the largest error of a peer's multipliers in the columns that are compared."""
        return float(np.nanmax(distances(found.trace, found.determinant, self.reference)))

    def turns(self, repeats: int) -> None:
        """Let all run in turn; the first round, which compiles, is kept apart."""
        done = {name: timed(work) for name, work in self.run.items()}
        self.first = {name: seconds for name, (seconds, _) in done.items()}
        self.found = {name: given for name, (_, given) in done.items()}
        rounds = [{name: worked(work) for name, work in self.run.items()} for _ in range(repeats)]
        scale = ROWS * COLUMNS / self.cells / 2.0
        self.times, self.work = (
            {
                # SciPy works on one core, and the scale already shares that out over two.
                name: np.array([one[name][clock] for one in rounds])
                * (scale * (1 + clock) if name == "SciPy" else 1.0)
                for name in self.run
            }
            for clock in range(2)
        )

    @property
    def wide(self) -> Any:
        """The map of all orbits."""
        return self.found["isojax, all to 500 N"]

    def ratio(self, one: str, other: str) -> float:
        """Give how many times as long one takes as the other; NaN where the other is missing."""
        if other not in self.times:
            return float("nan")
        return float(np.median(self.times[one] / self.times[other]))

    def work_ratio(self, one: str, other: str) -> float:
        """Give the same of the processor time."""
        if other not in self.work:
            return float("nan")
        return float(np.median(self.work[one]) / np.median(self.work[other]))

    def radius(self, name: str) -> np.ndarray:
        """Give the spectral radius that somebody found."""
        given = self.found[name]
        return np.asarray(given.spectral_radius if hasattr(given, "multipliers") else given.radius)

    def errors(self, name: str) -> np.ndarray:
        """Give the errors of somebody's multipliers in the columns that are compared."""
        given, reference = self.found[name], self.reference_z if name.endswith(", z") else self.reference
        if hasattr(given, "multipliers"):
            roots = np.asarray(given.multipliers)[:, ::SAMPLED]
            return distances(roots.sum(axis=-1).real, roots.prod(axis=-1).real, reference)
        return distances(given.trace[:, ::SAMPLED], given.determinant[:, ::SAMPLED], reference)

    def table(self) -> None:
        """Print times, errors and passes."""
        print(
            f"\n{'':26s}{'first [s]':>10s}{'later [s]':>11s}{'fastest':>10s}{'work [s]':>10s}{'steps':>7s}",
            end="",
        )
        print(f"{'error: median':>15s}{'largest':>9s}{'passes':>8s}{'missing':>9s}")
        for name, times in self.times.items():
            first = self.first[name] * (ROWS * COLUMNS / self.cells / 2.0 if name == "SciPy" else 1.0)
            digits = 0 if name == "SciPy" else 3
            print(f"{name:26s}{first:10.{digits}f}{np.median(times):11.{digits}f}", end="")
            print(f"{times.min():10.{digits}f}", end="")
            print(f"{np.median(self.work[name]):10.{digits}f}", end="")
            given = self.found[name]
            if name == "SciPy":
                near = np.abs(given - self.radius("isojax")[self.picked])
                print(f"   {self.cells} cells, scaled; spectral radius apart by {near.max():.0e} at most")
                continue
            steps = given.integrator.steps_per_period if hasattr(given, "multipliers") else self.steps[name]
            print(f"{steps:7d}", end="")
            if name.startswith("isojax, all"):
                print(f"   {int(given.count.sum())} orbits, up to {int(given.count.max())} a cell")
                continue
            errors = self.errors(name)
            print(f"{np.median(errors):15.1e}{np.nanmax(errors):9.1e}", end="")
            print(f"{given.passes:8.3f}" if hasattr(given, "passes") else " " * 8, end="")
            print(f"{int(np.isnan(self.radius(name)).sum()):9d}")


def growth(model: Any) -> list[float]:
    """Give the median seconds of maps of rising size."""
    from isojax.stability import stability_map

    def run(size: tuple[int, int]) -> float:
        axes = window(*size)
        return timed(lambda: stability_map(model, *axes))[0]

    rounds = [[run(size) for size in SIZES] for _ in range(1 + TURNS_OF_SIZES)]
    return list(np.median(rounds[1:], axis=0))


def lens_errors(model: Any) -> tuple[float, float, float]:
    """Give the largest error in cells inside the lens of folds and outside, and the reported one."""
    from isojax import Harmonic
    from isojax.stability import find_periodic_orbit, stability_map

    forces, band = np.linspace(1.0, 300.0, 300), np.linspace(3.5, 8.0, 200)
    smap = stability_map(model, forces, band, coexisting=True)
    count, y0, random = np.asarray(smap.count), smap.y0, np.random.default_rng(11)
    largest = []
    for chosen in (count > 1, count == 1):
        worst = 0.0
        for row, column in random.permutation(np.argwhere(chosen))[:LENS_CELLS]:
            drive = Harmonic(float(forces[row]), float(band[column]))
            for own in range(int(count[row, column])):
                exact = find_periodic_orbit(model, drive, start=y0[own, row, column], symmetric=True)
                ours, theirs = (
                    np.asarray(found)
                    for found in (smap.multipliers[own, row, column], exact.floquet.multipliers)
                )
                off = np.abs((ours[:, None] - theirs[None]).prod(axis=1))
                worst = max(worst, float(np.max(off / max(abs(theirs[0] - theirs[1]), 0.1))))
        largest.append(worst)
    return largest[0], largest[1], smap.error


def slopes_ratio(model: Any, repeats: int) -> tuple[float, float]:
    """Give seconds of a plain map of 200 x 100 and of the map with its derivatives by six coefficients."""
    from isojax.stability import sensitivity, stability_map

    axes, names = window(200, 100), [f"{name}.coefficient" for name in LAW]

    def plain() -> Any:
        return stability_map(model, *axes)

    def both() -> Any:
        return sensitivity(plain(), parameters=names).derivatives

    both()
    times = np.array([(timed(plain)[0], timed(both)[0]) for _ in range(repeats)])
    return float(np.median(times[:, 0])), float(np.median(times[:, 1]))


def main() -> None:
    """Run all and print the tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--repeats", type=int, default=5, help="timed turns after the first")
    parser.add_argument("--cells", type=int, default=12, help="cells that SciPy solves")
    parser.add_argument("--probe", action="store_true", help="only make the map once and print what it took")
    options = parser.parse_args()
    if options.probe:
        probe()
        return
    # Before anything else: Linux counts what the parent holds as the child's own peak.
    fresh = run_probe()
    jax.config.update("jax_enable_x64", True)
    race = Race(options.cells)
    busy = os.getloadavg()[0]
    race.turns(options.repeats)
    print(f"load average before and after: {busy:.1f} and {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    print(f"fresh process: imports {fresh['imports']:.1f} s, first call {fresh['first']:.1f} s, ", end="")
    print(f"peak memory {fresh['peak']:.0f} MB; C compiles in {race.compiling['C']:.1f} s")
    race.table()
    apart = {
        name: np.nanmax(np.abs(race.radius(name) - race.radius("isojax")))
        for name in race.run
        if name not in ("isojax", "isojax, all to 500 N", "SciPy", "C, full period")
        and not name.endswith(", z")
    }
    print(
        "\nspectral radius apart from isojax's, at most (near where two multipliers coincide, like the root"
    )
    print("of an error): " + ", ".join(f"{name} {value:.1e}" for name, value in apart.items()))
    reported = {name: race.found[name].error for name in ("isojax", "isojax, z")}
    print("error that the map itself reports: " + ", ".join(f"{n} {e:.1e}" for n, e in reported.items()))
    inside, outside, lens_reported = lens_errors(race.model)
    print(
        f"all orbits with a lens of folds: largest error inside {inside:.1e}, outside {outside:.1e}", end=""
    )
    print(f" of {LENS_CELLS} random cells each, reported {lens_reported:.1e}")

    seconds = growth(race.model)
    per_cell = [value / (rows * columns) for value, (rows, columns) in zip(seconds, SIZES, strict=True)]
    print("\nsize, seconds, microseconds a cell:", end=" ")
    for (rows, columns), value, one in zip(SIZES, seconds, per_cell, strict=True):
        print(f"{rows} x {columns}: {value:.3f}, {1e6 * one:.2f};", end=" ")
    plain, with_slopes = slopes_ratio(race.model, options.repeats)
    print(f"\n200 x 100: plain {plain:.3f} s, with derivatives by six coefficients {with_slopes:.3f} s")

    if "C" not in race.run:
        print("\nNo C compiler (gcc or cc) was found: the C targets are not judged.")
    half, full = "isojax", "isojax, full period"
    compared = [
        ("times as fast as SciPy", 1.0 / race.ratio(half, "SciPy"), 5000.0, False),
        ("of Numba's time, half period", race.ratio(half, "Numba"), 1.0, True),
        ("  at 128 steps", race.ratio("isojax, 128 steps", "Numba"), 1.0, True),
        ("of Numba's time, full period", race.ratio(full, "Numba, full period"), 1.0, True),
        ("  at 128 steps", race.ratio("isojax, full, 128 steps", "Numba, full period"), 1.0, True),
        ("of C's time, half period", race.ratio(half, "C"), 0.8, True),
        ("  z model", race.ratio("isojax, z", "C, z"), 0.8, True),
        ("  at 128 steps", race.ratio("isojax, 128 steps", "C"), 3.0, True),
        ("of C's time, full period", race.ratio(full, "C, full period"), 6.0, True),
        ("  at 128 steps", race.ratio("isojax, full, 128 steps", "C, full period"), 6.0, True),
        ("of C's with 16 cells at once", race.ratio(half, "C, 16 cells at once"), 1.5, True),
        ("  z model", race.ratio("isojax, z", "C, 16 cells at once, z"), 1.5, True),
        ("  full period", race.ratio(full, "C, 16 at once, full"), 6.0, True),
        ("  steps for the error promised", race.ratio(half, "C, 16 at once, same error"), 3.0, True),
        ("all orbits to 500 N over one a cell", race.ratio("isojax, all to 500 N", half), 5.0, True),
        ("200 x 100 with derivatives over plain", with_slopes / plain, 8.0, True),
        ("time a cell, larger map over smaller", max(np.array(per_cell[1:]) / per_cell[:-1]), 1.2, True),
        ("first call in a fresh process [s]", fresh["first"], 10.0, True),
        ("peak memory [MB]", fresh["peak"], 1000.0, True),
        (
            "error over the C or Numba peer's",
            np.nanmax(race.errors(half)) / np.nanmax(race.errors("C" if "C" in race.run else "Numba")),
            1.0,
            True,
        ),
        ("largest error", np.nanmax(race.errors(half)), min(2e-6, reported["isojax"]), True),
        ("  z model", np.nanmax(race.errors("isojax, z")), min(2e-6, reported["isojax, z"]), True),
        ("  inside the lens of folds", inside, min(2e-5, lens_reported), True),
        ("  outside it", outside, min(2e-6, lens_reported), True),
        ("cells with an orbit, of all", float(np.mean(np.isfinite(race.radius(half)))), 1.0, False),
        ("cells with three orbits to 500 N", float((race.wide.count == 3).sum()), 600.0, False),
    ]
    print()
    passed = []
    for words, value, target, below in compared:
        if np.isnan(value):
            continue
        passed.append(value <= target if below else value >= target)
        sign = "<=" if below else ">="
        print(f"{'PASS' if passed[-1] else 'FAIL'}  {words:40s}{value:10.3g}  {sign} {target:g}")
    print("\nfor the record: ratio of the time, of the work (processor time)")
    pairs = [(half, other) for other in ("Numba", "C", "C, 16 cells at once", "C, 16 at once, same error")]
    pairs += [("isojax, z", "C, z"), ("isojax, z", "C, 16 cells at once, z")]
    for one, other in [*pairs, (full, "Numba, full period"), (full, "C, full period")]:
        if other in race.run:
            print(f"{race.ratio(one, other):9.3g}{race.work_ratio(one, other):9.3g}   {one} over {other}")
    sys.exit(0 if all(passed) else 1)


if __name__ == "__main__":
    main()
