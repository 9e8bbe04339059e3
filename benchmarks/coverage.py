"""Do the 95 % intervals hold the truth where few records tell how much the stiffness scatters?

Run `python benchmarks/coverage.py --seeds 400000:400050`, then `python benchmarks/coverage.py --report`. A
run can be stopped and goes on where it stopped: a line of the file is a fit. About five seconds a fit. The
plant is the paper's y direction with every coefficient moved by up to 10 %, on the rig simulator, as in the
blind trial, and nothing is hidden. Each seed is tested with two, three, four and six stepped sines of eight
dwells: two levels, three, two up and down, three up and down. The stiffness scatters from record to record
by a standard deviation drawn between 0 and 0.2 %.

A row keeps, of each declared coefficient, of the force at the fold and of the largest transmissibility, how
far the fit is from the truth in its own standard errors; beside it the same with the scatter taken as known.
The report prints for both the share within 1.96, and for the first the 95 % interval of that share (Wilson)
and the rms.
"""

import argparse
import json
import tempfile
import time
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

import isojax as ij
from _set_up_jax import set_up_jax
from _trial_campaign import Sketch, sketch
from _trial_judge import wilson
from _trial_run import crowded
from isojax import rig
from isojax.identification import Fit
from isojax.identification.fitting import invert_information

RESULTS = Path(__file__).parent / "results" / "intervals.jsonl"
CYCLES = 12
FOLD_FREQUENCY, DRIVE = 0.735, 0.5
"""Frequency of the drive at the fold, over that of the linear spring; amplitude of the drive under which the
transmissibility is asked for, over the lowest level."""

BAND = np.linspace(0.85, 1.05, 41)
"""Frequencies of the transmissibility over the natural frequency of the linear spring."""

LAYOUTS = {2: ((0, 2), False), 3: ((0, 1, 2), False), 4: ((0, 2), True), 6: ((0, 1, 2), True)}
"""Levels of the sketch that are tested, and whether also backward, by the count of records."""


def records_of(drawn: Sketch, count: int) -> rig.SteppedSine:
    """Give the test plan with so many records."""
    levels, both = LAYOUTS[count]
    frequencies = drawn.plans[0].frequencies  # pyright: ignore[reportAttributeAccessIssue]
    ways = ("forward", "backward") if both else ("forward",)
    return rig.SteppedSine(tuple(drawn.levels[place] for place in levels), frequencies, CYCLES, ways)


def answers(model: ij.Isolator, drawn: Sketch, fit: Fit | None = None) -> dict[str, tuple[float, np.ndarray]]:
    """Give fold force and largest transmissibility with their derivatives by the six coefficients."""
    natural = float(np.sqrt(drawn.base[0] / float(model.mass)) / (2.0 * np.pi))
    names = tuple(entry.name for entry in drawn.model.parameters if entry.name != "mass")
    branch = ij.continue_branch(
        model, parameter="amplitude", frequency=FOLD_FREQUENCY * natural, start=1.0, stop=400.0
    )
    found = {}
    folds = [point for point in branch.special_points if point.kind == "fold"]
    if folds:
        fold = ij.sensitivity(folds[0], parameters=names)
        found["fold force"] = float(fold.values["value"]), np.array(fold.derivatives["value"])

    def largest(isolator: ij.Isolator) -> jax.Array:
        ratio = ij.transmissibility(isolator, DRIVE * drawn.levels[0], BAND * natural).magnitude
        return jnp.max(ratio)

    peak = ij.sensitivity(largest, model, parameters=names)
    found["peak transmissibility"] = float(peak.values["value"]), np.array(peak.derivatives["value"])
    return found


def run_one(seed: int, count: int, truth: dict[str, tuple[float, np.ndarray]]) -> dict:
    """Fit one campaign and compare with the truth."""
    begin, drawn = time.perf_counter(), sketch(seed, "coverage", ())
    with tempfile.TemporaryDirectory() as folder:
        plan = (records_of(drawn, count),)
        campaign = ij.read_campaign(
            rig.write_campaign(Path(folder), drawn.plant, plan, seed, "blind", drawn.bench)
        )
    found = ij.fit(drawn.model, campaign)
    estimate = found.estimate
    inflation = max(1.0, estimate.chi2 / estimate.dof)
    before = invert_information(estimate.point.reduced.matrix[:-1, :-1], inflation).covariance
    off, off_before = {}, {}
    for name, value, slope in _quantities(found, drawn, truth):
        off[name] = value / float(np.sqrt(slope @ found.covariance @ slope))
        off_before[name] = value / float(np.sqrt(slope @ before @ slope))
    return {
        "seed": seed,
        "records": count,
        "drift": drawn.bench.drift,
        "scatter": found.stats.stiffness_scatter,
        "off": off,
        "off_scatter_known": off_before,
        "seconds": round(time.perf_counter() - begin, 2),
    }


def _quantities(found: Fit, drawn: Sketch, truth: dict[str, tuple[float, np.ndarray]]):
    """List name, error and derivative of what is asked for."""
    listed = [entry.name for entry in drawn.model.parameters if entry.name != "mass"]
    order = [found.free.index(name) for name in listed]
    for place, name in enumerate(listed):
        slope = np.zeros(len(order))
        slope[order[place]] = 1.0
        yield name, float(found.model[name]) - float(drawn.model[name]), slope
    for name, (value, derivative) in answers(found.model, drawn).items():
        if name in truth:
            slope = np.zeros(len(order))
            slope[order] = derivative
            yield name, value - truth[name][0], slope


def report(rows: list[dict]) -> None:
    """Print the coverage by the count of records."""
    names = list(dict.fromkeys(name for row in rows for name in row["off"]))
    print(
        "| records | fits | quantity | scatter known | scatter integrated | 95 % interval | rms error, se |"
    )
    print("|---|---|---|---|---|---|---|")
    for count in sorted({row["records"] for row in rows}):
        some = [row for row in rows if row["records"] == count]
        for name in names:
            new = np.array([row["off"][name] for row in some if name in row["off"]])
            old = np.array([row["off_scatter_known"][name] for row in some if name in row["off"]])
            low, high = wilson(int(np.sum(np.abs(new) < 1.96)), new.size)
            print(
                f"| {count} | {new.size} | {name} | {np.mean(np.abs(old) < 1.96):.3f} | "
                f"{np.mean(np.abs(new) < 1.96):.3f} | {low:.2f}-{high:.2f} | {np.sqrt(np.mean(new**2)):.2f} |"
            )


def main() -> None:
    """Run what is not there yet, or report."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seeds", default="400000:400050", help="first:stop")
    parser.add_argument("--records", type=int, nargs="+", default=list(LAYOUTS), choices=LAYOUTS)
    parser.add_argument("--out", type=Path, default=RESULTS, help="one line a fit")
    parser.add_argument("--minutes", type=float, default=np.inf, help="begin no fit after so long")
    parser.add_argument("--cache", type=Path, help="folder in which compiled code is kept between runs")
    parser.add_argument("--report", action="store_true", help="print the table")
    options = parser.parse_args()
    rows = [json.loads(line) for line in options.out.read_text().splitlines()] if options.out.exists() else []
    if options.report:
        report(rows)
        return
    set_up_jax(options.cache)
    done = {(row["seed"], row["records"]) for row in rows}
    begin = time.perf_counter()
    for seed in range(*(int(end) for end in options.seeds.split(":"))):
        left = [count for count in options.records if (seed, count) not in done]
        drawn = sketch(seed, "coverage", ())
        truth = answers(drawn.model, drawn) if left else {}
        for count in left:
            if time.perf_counter() - begin > 60.0 * options.minutes:
                return
            row = run_one(seed, count, truth)
            with options.out.open("a") as file:
                file.write(json.dumps(row) + "\n")
            print(f"{seed} {count} records {row['seconds']:.1f} s", flush=True)
        if crowded():
            jax.clear_caches()


if __name__ == "__main__":
    main()
