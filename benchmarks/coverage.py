"""Do the 95 % intervals hold the truth where few records tell how much the stiffness scatters?

Run `python benchmarks/coverage.py --seeds 400000:400050`, then `python benchmarks/coverage.py --report`. A
run can be stopped and goes on where it stopped: a line of the file is a fit. About five seconds a fit. The
plant is the paper's y direction with every coefficient moved by up to 10 %, on the rig simulator, as in the
blind trial, and nothing is hidden. Each seed is tested with two, three, four and six stepped sines of eight
dwells: two levels, three, two up and down, three up and down. The stiffness scatters from record to record
by a standard deviation drawn between 0 and 0.2 %.

A row keeps, of each declared coefficient, of the force at the fold and of the largest transmissibility,
whether the interval of `isojax.uncertainty` holds the truth, and how far the fit is from the truth in its
standard error. The report prints the share that holds it, the 95 % interval of that share (Wilson), the rms
of the error, and in how many fits the interval is one by draws. No interval is stated where draws lose the
fold: those are left out. A fit that has no fold though the truth has one counts as a miss; the share of the
stated intervals alone is printed too. PASS is for a share of 0.93 to 0.97 over all campaigns, FAIL where even
its interval lies outside; between the two it is undecided. By the count of records there are too few
campaigns for a PASS.
"""

import argparse
import json
import operator
import sys
import tempfile
import time
from collections.abc import Callable
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

RESULTS = Path(__file__).parent / "results" / "intervals.jsonl"
CYCLES = 12
FOLD_FREQUENCY, DRIVE = 0.735, 0.5
"""Frequency of the drive at the fold, over that of the linear spring; amplitude of the drive under which the
transmissibility is asked for, over the lowest level."""

BAND = np.linspace(0.85, 1.05, 41)
"""Frequencies of the transmissibility over the natural frequency of the linear spring."""

MARK = 0.93, 0.97
"""Least and greatest share of intervals that hold the truth."""

LAYOUTS = {2: ((0, 2), False), 3: ((0, 1, 2), False), 4: ((0, 2), True), 6: ((0, 1, 2), True)}
"""Levels of the sketch that are tested, and whether also backward, by the count of records."""


def records_of(drawn: Sketch, count: int) -> rig.SteppedSine:
    """Give the test plan with so many records."""
    levels, both = LAYOUTS[count]
    frequencies = drawn.plans[0].frequencies  # pyright: ignore[reportAttributeAccessIssue]
    ways = ("forward", "backward") if both else ("forward",)
    return rig.SteppedSine(tuple(drawn.levels[place] for place in levels), frequencies, CYCLES, ways)


def answers(model: ij.Isolator, drawn: Sketch) -> dict[str, Callable[[ij.Isolator], jax.Array]]:
    """Give what is asked of models near this one, by its name; no fold force where it has no fold."""
    natural = float(np.sqrt(drawn.base[0] / float(model.mass)) / (2.0 * np.pi))
    names = [entry.name for entry in drawn.model.parameters if entry.name != "mass"]
    asked: dict[str, Callable[[ij.Isolator], jax.Array]] = {name: operator.itemgetter(name) for name in names}
    branch = ij.continue_branch(
        model, parameter="amplitude", frequency=FOLD_FREQUENCY * natural, start=1.0, stop=400.0
    )
    folds = [point for point in branch.special_points if point.kind == "fold"]
    if folds:
        asked["fold force"] = lambda isolator: ij.find_again(folds[0], isolator).amplitude
    curve = ij.transmissibility(model, DRIVE * drawn.levels[0], BAND * natural)
    asked["peak transmissibility"] = lambda isolator: jnp.max(ij.find_again(curve, isolator).magnitude)
    return asked


def run_one(seed: int, count: int, truth: dict[str, float]) -> dict:
    """Fit one campaign and compare with the truth."""
    begin, drawn = time.perf_counter(), sketch(seed, "coverage", ())
    with tempfile.TemporaryDirectory() as folder:
        plan = (records_of(drawn, count),)
        campaign = ij.read_campaign(
            rig.write_campaign(Path(folder), drawn.plant, plan, seed, "blind", drawn.bench)
        )
    fit = ij.fit(drawn.model, campaign)
    asked = answers(fit.model, drawn)
    found = ij.uncertainty(fit, lambda model: jnp.stack([one(model) for one in asked.values()]))
    # None where draws lose their fold, so that no interval is stated. A fit without the fold is a miss.
    off: dict[str, float] = {}
    held: dict[str, bool | None] = dict.fromkeys(truth, False)
    for place, name in enumerate(asked):
        if name in truth:
            low, high = found.interval[:, place].tolist()
            held[name] = low <= truth[name] <= high if np.isfinite(low + high) else None
            off[name] = float((found.value[place] - truth[name]) / found.standard_error[place])
    return {
        "seed": seed,
        "records": count,
        "drift": drawn.bench.drift,
        "scatter": fit.stats.stiffness_scatter,
        "off": off,
        "held": held,
        "curved": [name for name, bent in zip(asked, found.curved, strict=True) if bent],
        "draws_failed": found.failed,
        "seconds": round(time.perf_counter() - begin, 2),
    }


def report(rows: list[dict]) -> bool:
    """Print the coverage of all campaigns and by their count of records; say whether every mark is met."""
    names, met = list(dict.fromkeys(name for row in rows for name in row["held"])), True
    print(
        "| records | quantity | campaigns | not stated | no fold in the fit | hold the truth "
        "| 95 % interval | of the stated intervals | rms error, se | curved | |"
    )
    print("|---" * 11 + "|")
    counts = sorted({row["records"] for row in rows})
    for count in ("all", *counts):
        some = [row for row in rows if count in ("all", row["records"])]
        for name in names:
            asked = [row for row in some if name in row["held"]]
            found = [row for row in asked if name in row["off"]]
            held = np.array([row["held"][name] for row in found if row["held"][name] is not None])
            off, absent = np.array([row["off"][name] for row in found]), len(asked) - len(found)
            # A fit without the fold that the truth has is a wrong answer, and counts as a miss.
            answers = held.size + absent
            low, high = wilson(int(held.sum()), answers)
            share = held.sum() / answers
            # Of so many campaigns a share is known no better than its interval says.
            outside = high < MARK[0] or low > MARK[1]
            verdict = "FAIL" if outside else "" if count != "all" else "undecided"
            if count == "all" and MARK[0] <= share <= MARK[1]:
                verdict = "PASS"
            met &= verdict in ("PASS", "")
            print(
                f"| {count} | {name} | {len(asked)} | {len(found) - held.size} | {absent} | "
                f"{share:.3f} | {low:.2f}-{high:.2f} | {held.mean():.3f} | "
                f"{np.sqrt(np.mean(off**2)):.2f} | {sum(name in row['curved'] for row in some)} | {verdict} |"
            )
    return met


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
        sys.exit(not report(rows))
    set_up_jax(options.cache)
    done = {(row["seed"], row["records"]) for row in rows}
    begin = time.perf_counter()
    for seed in range(*(int(end) for end in options.seeds.split(":"))):
        left = [count for count in options.records if (seed, count) not in done]
        drawn = sketch(seed, "coverage", ())
        asked = answers(drawn.model, drawn) if left else {}
        truth = {name: float(one(drawn.model)) for name, one in asked.items()}
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
