"""Time `fit` against SciPy's least squares with a compiled simulator: same records, same start.

Run `python benchmarks/fit_speed.py` (needs the extra `bench`; about two minutes, the first time one more
to simulate the campaign into benchmarks/out/). Printed: seconds of the first call, which compiles, and of
the calls after it (median of `--repeats`; the contestants take turns, so that a busy machine slows all),
the answers beside the truth, peak memory of a process that only reads and fits, the median ratios of the
times, and PASS or FAIL. The exit status is 1 after a FAIL.

Data: the paper's y model, 12 records (3 levels, 2 directions, 2 repeats) of 116 s at 1 kHz, dwells of 20
cycles every 0.1 Hz from 4 to 7 Hz, white noise of 0.01 m/s^2. Six coefficients. All start from the
classical guess, whose time counts for none; each fit gets records read anew, so that nothing is left over
from the last one.

The peers simulate whole records from rest, which these are, and so have no initial states and no
stiffness scales to find. The noise and the force at mid-sample are given to them.

- plain: a Numba kernel, `prange` over the records, and `least_squares` with `jac="2-point"` (seven
  simulations an iteration). This is what `fit` must not be slower than.
- tuned: the kernel runs the seven simulations side by side, so that they share vector registers, and
  leaves the Jacobian behind with each residual, so that a step costs one pass over the data.

`fit` does more in its time: it estimates the noise, chooses the integration steps, eliminates two initial
states a dwell and a stiffness scale a record, and gives error bars. The errors of free runs and restarts on
every record, which it works out when they are first asked for and the peers do not give, are printed apart.
"""

import argparse
import os
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax
import numpy as np
from numba import njit, prange
from scipy.optimize import least_squares

OUT = Path(__file__).resolve().parent / "out" / "fit_speed"
NAMES = ("k1", "k2", "k3", "c1", "c2", "c3")
TRUTH = (1.0805e6, -6.974e8, 2.51667e11, 1.027e4, -3.6880e5, 5.3753e6)
MASS = 800.0
NOISE = 0.01
COLUMNS = 8
"""Simulations side by side: the base, one for each of six coefficients, one idle that fills the registers."""

NUDGE = 1e-6
"""Finite difference, over the coefficient."""


def find_campaign() -> Path:
    """Give campaign.toml, simulated on the first call."""
    from isojax import rig

    if not (OUT / "campaign.toml").exists():
        plan = rig.paper_plan("y", levels=(60.0, 120.0, 180.0), repeats=2)
        bench = rig.Bench(noise=NOISE, drift=0.0)
        rig.write_campaign(OUT, rig.y_plant(), plan, 1, "12 records of 116 s", bench)
    return OUT / "campaign.toml"


def values_of(model) -> list[float]:
    """Give the six coefficients."""
    return [float(entry.value) for entry in model.parameters if entry.name != "mass"]


def isojax_runner(splits: list[tuple[float, float, float]]) -> Callable[[], tuple[float, dict]]:
    """Give the function that reads the records, fits them, and says how long the fit took."""
    from isojax import read_campaign
    from isojax.identification import classical_guess, fit

    start = classical_guess(read_campaign(find_campaign())).model

    def run() -> tuple[float, dict]:
        campaign = read_campaign(find_campaign())
        marks = [time.perf_counter()]
        found = fit(start, campaign, progress=lambda line: marks.append(time.perf_counter()))
        marks.append(time.perf_counter())
        taken = marks[-1] - marks[0]
        if not np.isfinite(found.errors["fit"].rmse):
            raise RuntimeError("The fit failed.")
        after = time.perf_counter() - marks[-1]
        splits.append((marks[1] - marks[0], marks[-1] - marks[1], after))
        return taken, {
            "answer": np.array(values_of(found.model)),
            "errors": np.array(list(found.standard_errors.values())),
            "chi2_per_dof": found.stats.chi2 / found.stats.dof,
            "evaluations": found.stats.steps,
        }

    return run


def compile_plain() -> Callable:
    """Give the plain simulator: one set of coefficients, records over the cores."""

    @njit(parallel=True, error_model="numpy")
    def simulate(k, force, measured, weight, step, residual):
        # k: six coefficients over the mass; force: (record, time, 3) over the mass.
        records, samples = measured.shape
        for record in prange(records):
            x = v = 0.0
            for n in range(samples):
                f0, f1, f2 = force[record, n, 0], force[record, n, 1], force[record, n, 2]
                ax, av = abs(x), abs(v)
                a1 = f0 - x * (k[0] + ax * (k[1] + ax * k[2])) - v * (k[3] + av * (k[4] + av * k[5]))
                residual[record * samples + n] = (a1 - measured[record, n]) * weight
                y, v2 = x + 0.5 * step * v, v + 0.5 * step * a1
                ax, av = abs(y), abs(v2)
                a2 = f1 - y * (k[0] + ax * (k[1] + ax * k[2])) - v2 * (k[3] + av * (k[4] + av * k[5]))
                y, v3 = x + 0.5 * step * v2, v + 0.5 * step * a2
                ax, av = abs(y), abs(v3)
                a3 = f1 - y * (k[0] + ax * (k[1] + ax * k[2])) - v3 * (k[3] + av * (k[4] + av * k[5]))
                y, v4 = x + step * v3, v + step * a3
                ax, av = abs(y), abs(v4)
                a4 = f2 - y * (k[0] + ax * (k[1] + ax * k[2])) - v4 * (k[3] + av * (k[4] + av * k[5]))
                x += step / 6.0 * (v + 2.0 * (v2 + v3) + v4)
                v += step / 6.0 * (a1 + 2.0 * (a2 + a3) + a4)

    return simulate


def compile_tuned() -> Callable:
    """Give the tuned simulator: residual and finite-difference Jacobian in one pass."""

    @njit(parallel=True, error_model="numpy")
    def simulate(table, force, measured, scale, step, residual, jacobian):
        # table: (6, COLUMNS) coefficients over the mass; scale: of the residual and of each difference.
        records, samples = measured.shape
        for record in prange(records):
            x, v, dx, dv = np.zeros(COLUMNS), np.zeros(COLUMNS), np.zeros(COLUMNS), np.zeros(COLUMNS)
            reading = np.zeros(COLUMNS)
            k1, k2, k3, c1, c2, c3 = table[0], table[1], table[2], table[3], table[4], table[5]
            for n in range(samples):
                f0, f1, f2 = force[record, n, 0], force[record, n, 1], force[record, n, 2]
                for c in range(COLUMNS):
                    y, w = x[c], v[c]
                    ay, aw = abs(y), abs(w)
                    a = f0 - y * (k1[c] + ay * (k2[c] + ay * k3[c])) - w * (c1[c] + aw * (c2[c] + aw * c3[c]))
                    reading[c] = a
                    dx[c], dv[c] = w, a
                    y, w = x[c] + 0.5 * step * w, v[c] + 0.5 * step * a
                    ay, aw = abs(y), abs(w)
                    a = f1 - y * (k1[c] + ay * (k2[c] + ay * k3[c])) - w * (c1[c] + aw * (c2[c] + aw * c3[c]))
                    dx[c] += 2.0 * w
                    dv[c] += 2.0 * a
                    y, w = x[c] + 0.5 * step * w, v[c] + 0.5 * step * a
                    ay, aw = abs(y), abs(w)
                    a = f1 - y * (k1[c] + ay * (k2[c] + ay * k3[c])) - w * (c1[c] + aw * (c2[c] + aw * c3[c]))
                    dx[c] += 2.0 * w
                    dv[c] += 2.0 * a
                    y, w = x[c] + step * w, v[c] + step * a
                    ay, aw = abs(y), abs(w)
                    a = f2 - y * (k1[c] + ay * (k2[c] + ay * k3[c])) - w * (c1[c] + aw * (c2[c] + aw * c3[c]))
                    x[c] += step / 6.0 * (dx[c] + w)
                    v[c] += step / 6.0 * (dv[c] + a)
                row = record * samples + n
                residual[row] = (reading[0] - measured[record, n]) * scale[0]
                for c in range(6):
                    jacobian[row, c] = (reading[c + 1] - reading[0]) * scale[c + 1]

    return simulate


class Peer:
    """SciPy's least squares with a compiled simulator."""

    def __init__(self, tuned: bool):
        from isojax import read_campaign
        from isojax.excitations import tabulate
        from isojax.identification import classical_guess

        campaign = read_campaign(find_campaign())
        self.start = np.array(values_of(classical_guess(campaign).model))
        self.sizes = np.abs(self.start)
        self.measured = np.stack([record.output for record in campaign.records])
        tables = [tabulate(record.input, record.rate, "band_limited", 1)[0] for record in campaign.records]
        self.force, self.step = np.stack(tables) / MASS, 1.0 / campaign.rate
        self.simulate = compile_tuned() if tuned else compile_plain()
        self.tuned = tuned
        self.residual = np.empty(self.measured.size)
        self.jacobian = np.empty((self.measured.size, 6)) if tuned else np.empty((0, 6))
        self.at, self.passes = np.full(6, np.nan), 0

    def evaluate(self, free: np.ndarray) -> None:
        """Simulate all records; the tuned peer does so once a point, for residual and Jacobian."""
        if self.tuned and np.array_equal(free, self.at):
            return
        self.at, self.passes = free.copy(), self.passes + 1
        values = free * self.sizes / MASS
        if not self.tuned:
            self.simulate(values, self.force, self.measured, 1.0 / NOISE, self.step, self.residual)
            return
        table = np.repeat(values[:, None], COLUMNS, axis=1)
        table[range(6), range(1, 7)] += NUDGE * self.sizes / MASS
        scale = np.append(1.0, np.full(6, 1.0 / NUDGE)) / NOISE
        self.simulate(table, self.force, self.measured, scale, self.step, self.residual, self.jacobian)

    def give_residual(self, free: np.ndarray) -> np.ndarray:
        """Give the whitened residual."""
        self.evaluate(free)
        return self.residual.copy()

    def give_jacobian(self, free: np.ndarray) -> np.ndarray:
        """Give its derivatives."""
        self.evaluate(free)
        return self.jacobian.copy()

    def run(self, method: str) -> tuple[float, dict]:
        """Fit, and say how long it took."""
        self.at, self.passes = np.full(6, np.nan), 0
        jacobian: Any = self.give_jacobian if self.tuned else "2-point"
        begin = time.perf_counter()
        found = least_squares(
            self.give_residual, self.start / self.sizes, jacobian, method=method, x_scale="jac"
        )
        return time.perf_counter() - begin, {
            "answer": found.x * self.sizes,
            "chi2_per_dof": 2.0 * found.cost / (self.measured.size - 6),
            "evaluations": self.passes,
        }


def peak_megabytes() -> float:
    """Give the peak memory of a process that reads the records and fits them."""
    command = [sys.executable, __file__, "--memory"]
    return float(subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout)


def main() -> None:
    """Run both and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--repeats", type=int, default=5, help="timed calls after the first")
    parser.add_argument(
        "--memory", action="store_true", help="only read, fit, and print the peak memory [MB]"
    )
    options = parser.parse_args()
    jax.config.update("jax_enable_x64", True)
    splits: list[tuple[float, float, float]] = []
    if options.memory:
        isojax_runner(splits)()
        print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
        return
    # Before anything else: Linux counts what the parent holds as the child's own peak.
    memory = peak_megabytes()
    run_isojax = isojax_runner(splits)
    plain, tuned = Peer(tuned=False), Peer(tuned=True)
    first = [run_isojax()[0], plain.run("lm")[0], tuned.run("lm")[0]]
    methods = [min(("lm", "trf"), key=lambda name, peer=peer: peer.run(name)[0]) for peer in (plain, tuned)]
    busy = os.getloadavg()[0]
    turns = [(run_isojax(), plain.run(methods[0]), tuned.run(methods[1])) for _ in range(options.repeats)]
    print(f"load average before and after: {busy:.1f} and {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    found = [one[1] for one in turns[-1]]
    times = np.array([[one[0] for one in turn] for turn in turns])
    ratios = np.median(times[:, :1] / times, axis=0)

    rows: list[tuple[str, list[str]]] = [
        ("", ["isojax.fit", "plain peer", "tuned peer"]),
        ("method", ["", *methods]),
        ("first call, compiles [s]", [f"{value:.2f}" for value in first]),
    ]
    for words, pick in (("later calls, median [s]", np.median), ("  fastest", np.min), ("  slowest", np.max)):
        rows.append((words, [f"{value:.2f}" for value in pick(times, axis=0)]))
    parts = ("  up to the first step", "  rest of the search", "not counted: errors on all records")
    for words, value in zip(parts, np.median(splits[1:], axis=0), strict=True):
        rows.append((words, [f"{value:.2f}"]))
    rows.append(("passes over the data", [f"{one['evaluations']}" for one in found]))
    rows.append(("chi2/dof", [f"{one['chi2_per_dof']:.5f}" for one in found]))
    rows.append(("peak memory [MB]", [f"{memory:.0f}"]))
    print(f"{plain.measured.size} samples, 6 coefficients\n")
    for words, entries in rows:
        print(f"{words:28s}" + "".join(f"{entry:>16s}" for entry in entries))

    answers = np.array([one["answer"] for one in found])
    apart, off = (answers[0] - answers[1:]) / found[0]["errors"], (answers[0] - TRUTH) / found[0]["errors"]
    print(f"\n{'':4s}{'truth':>14s}{'isojax.fit':>16s}{'plain peer':>16s}{'tuned peer':>16s}", end="")
    print(f"{'isojax - plain':>17s}{'isojax - truth':>17s}")
    for place, name in enumerate(NAMES):
        print(
            f"{name:4s}{TRUTH[place]:14.6g}" + "".join(f"{value:16.8g}" for value in answers[:, place]),
            end="",
        )
        print(f"{apart[0, place]:14.2f} se{off[place]:14.2f} se")
    print(f"\nisojax.fit takes {ratios[1]:.2f} of the time of the plain peer, {ratios[2]:.2f} of the tuned.")
    checks = {
        "no slower than the plain peer": float(ratios[1]) <= 1.0,
        "same answer, within two standard errors": bool(np.all(np.abs(apart) < 2.0)),
        "memory under 2 GB": memory < 2000.0,
    }
    for line, passed in checks.items():
        print(f"{'PASS' if passed else 'FAIL'}  {line}")
    sys.exit(0 if all(checks.values()) else 1)


if __name__ == "__main__":
    main()
