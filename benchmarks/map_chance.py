"""Are the chances of a map those of as many maps of drawn coefficients, and what do they cost?

Run `python benchmarks/map_chance.py`. A campaign of the blind trial with two fitted records is fitted, and
the fitted model is mapped on 200 x 100 cells around its lens of folds, with the errors of the fit. The same
400 draws of the coefficients are then mapped in full, one after the other, and counted cell by cell. The
report gives the largest difference of each chance over the cells in which it lies between 0.05 and 0.95, and
the seconds of processor time beside that of the plain map, compiled; beside them the error that the map
itself reports. PASS or FAIL beside the marks of 0.03 and of 15 plain maps; the exit status is 1 after a FAIL.
The full maps take minutes of one core. `--times 8` shows what is left of the chances where errors are large.
"""

import argparse
import tempfile
import time
from pathlib import Path

import jax
import numpy as np

import isojax as ij
from _marks import Marks
from _trial_campaign import sketch
from covered import records_of
from isojax import compile_quickly, rig
from isojax.models import coefficient_errors
from isojax.stability.map._chance import find_chances, quasi_draws
from isojax.stability.map._map import solve_map
from isojax.stability.map._sought import MapRun, Sought
from isojax.stability.map._surface import MapWindow

CELLS = 200, 100
MARK, MOST_COST = 0.03, 15.0
"""Largest error of a chance, and time over that of the plain map."""


def fitted(seed: int, records: int):
    """Fit a campaign of the blind trial that hides nothing."""
    drawn = sketch(seed, "coverage", ())
    with tempfile.TemporaryDirectory() as folder:
        plan = (records_of(drawn, records),)
        path = rig.write_campaign(Path(folder), drawn.plant, plan, seed, "blind", drawn.bench)
        return ij.fit(drawn.model, ij.read_campaign(path))


def window(model: ij.Isolator) -> tuple[np.ndarray, np.ndarray]:
    """Give the grid around the lens of the folds."""
    natural = float(np.sqrt(float(model["linear_stiffness.coefficient"]) / float(model.mass)) / (2.0 * np.pi))
    band = np.linspace(0.55, 0.95, 80) * natural
    forces = np.linspace(5.0, 500.0, 400)
    several = np.asarray(ij.stability_map(model, forces, band, coexisting=True).count) > 1
    rows, columns = np.flatnonzero(several.any(axis=1)), np.flatnonzero(several.any(axis=0))
    if not rows.size:
        raise SystemExit("The fitted model has no lens of folds in the window: take another --seed.")
    low, high = forces[rows[[0, -1]]], band[columns[[0, -1]]]
    return (
        np.linspace(0.9 * low[0], 1.1 * low[1], CELLS[0]),
        np.linspace(high[0] - 0.05 * natural, high[1] + 0.05 * natural, CELLS[1]),
    )


def main() -> None:
    """Print the differences and the cost."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seed", type=int, default=500_011)
    parser.add_argument("--records", type=int, default=2)
    parser.add_argument("--draws", type=int, default=400)
    parser.add_argument("--times", type=float, default=1.0, help="multiple of the errors of the fit")
    options = parser.parse_args()
    jax.config.update("jax_enable_x64", True)
    compile_quickly()
    fit = fitted(options.seed, options.records)
    forces, band = window(fit.model)
    errors = coefficient_errors(fit)
    errors = errors._replace(root=options.times * errors.root)
    plain = ij.stability_map(fit.model, forces, band, coexisting=True)

    run = MapRun(True, plain.integrator, 32768, None, None, None)

    def find(model: ij.Isolator, amplitudes: np.ndarray) -> tuple[ij.stability.StabilityMap, Sought]:
        return solve_map(model, MapWindow(amplitudes, band), run)

    ij.stability_map(fit.model, forces, band, coexisting=True, fit=fit)
    seconds = []
    for own in (None, fit):
        begin = time.process_time()
        ij.stability_map(fit.model, forces, band, coexisting=True, fit=own)
        seconds.append(time.process_time() - begin)
    steps = quasi_draws(errors, options.draws)
    chances = find_chances(errors, forces, find, steps)
    begin = time.process_time()
    stable, coexisting = np.zeros(CELLS), np.zeros(CELLS)
    for place, step in enumerate(steps):
        smap, _ = find(errors.moved(jax.numpy.asarray(step)), forces)
        stable += ~np.any(np.asarray(smap.spectral_radius) >= 1.0, axis=0)
        coexisting += np.asarray(smap.count) > 1
        if place % 50 == 49:
            print(f"{place + 1} maps, {time.process_time() - begin:.0f} s", flush=True)
    print(
        f"{len(steps)} draws, {int(np.sum(np.asarray(plain.count) > 1))} of {plain.count.size} cells coexist"
    )
    marks = Marks()
    for name, counted, given in (
        ("P(stable)", stable, chances.stable),
        ("P(coexisting)", coexisting, chances.coexisting),
    ):
        truth = counted / len(steps)
        known = np.isfinite(given)
        between = known & (truth > 0.05) & (truth < 0.95)
        off = np.abs(given - truth)[known]
        between = between[known]
        marks.judge(
            f"{name}: {int(between.sum())} cells between 0.05 and 0.95, "
            f"there off by {off[between].max():.4f} at most (mark {MARK}), "
            f"{np.sqrt(np.mean(off[between] ** 2)):.4f} rms; "
            f"elsewhere {off[~between].max():.4f} at most; above {MARK} in {int(np.sum(off > MARK))} cells, "
            f"not known in {int(np.sum(~known))}",
            off[between].max() <= MARK,
        )
    print(f"      the map itself says {chances.error:.4f}")
    marks.judge(
        f"plain map {seconds[0]:.2f} s, with chances {seconds[1]:.2f} s "
        f"of processor time: {seconds[1] / seconds[0]:.1f} times (mark {MOST_COST:g})",
        seconds[1] <= MOST_COST * seconds[0],
    )
    marks.leave()


if __name__ == "__main__":
    main()
