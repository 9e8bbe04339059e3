"""Is a coefficient that follows the chamber pressure found where it is, and not found where it is not?

Run `python benchmarks/pressure.py`, then `python benchmarks/pressure.py --report`. Its seeds are those of the
table in docs/validation.md. A run can be stopped and goes on where it stopped: a line of the file is a
campaign. About a minute a campaign.

The plant is the paper's y direction with every coefficient moved by up to 10 %, on the rig simulator, as in
the blind trial. It is tested at three pressures, 200 kPa, then 8 to 20 % more, then 8 to 20 % less, with a
stepped sine at two levels each; the linear stiffness scatters from record to record by a standard deviation
drawn between 0 and 0.2 %. Of even seeds one coefficient follows the pressure: linear stiffness, linear
damping and cubic stiffness in turn, of either sign and 2 to 20 detection limits large, but at most as large
as the coefficient itself. One limit is 3.5 standard errors of the change on the twin that hides nothing. The
campaign declares the six laws of the paper and the pressures, and not that anything follows them.

A campaign counts as found where the loop names the hidden effect or a set that holds it, and as wrong where
it names an effect of pressure that is not there.
"""

import argparse
import json
import os
import tempfile
import time
from pathlib import Path
from typing import Any

import jax
import numpy as np

from _marks import Marks
from _trial_campaign import CYCLES, SIGNIFICANT, Sketch, sketch
from _trial_effects import generator, log_uniform
from _trial_judge import wilson
from isojax import compile_quickly, rig
from isojax.elements import CATALOGUE
from isojax.identification import close_loop, fit, read_campaign, scales
from isojax.identification.diagnosis._score import score_test
from isojax.identification.fitting import Search

RESULTS = Path(__file__).parent / "results" / "pressure.jsonl"
REFERENCE = 2e5
HIDDEN = {
    "pressure_stiffness": (rig.PressureStiffness, 0),
    "pressure_damping": (rig.PressureDamping, 3),
    "pressure_cubic_stiffness": (rig.PressureCubicStiffness, 2),
}
"""Law of the rig, and which of the six coefficients it changes."""

SMALLEST, LARGEST = 2.0, 20.0
"""Sizes, in detection limits."""


def plans_of(drawn: Sketch) -> tuple[rig.Plan, ...]:
    """Give two levels of stepped sines at each of three pressures."""
    draw = generator(drawn.seed, "pressure")
    shares = 1.0, 1.0 + draw.uniform(0.08, 0.2), 1.0 - draw.uniform(0.08, 0.2)
    frequencies = drawn.plans[0].frequencies  # pyright: ignore[reportAttributeAccessIssue]
    levels = drawn.levels[0], drawn.levels[2]
    one = rig.SteppedSine(levels, frequencies, CYCLES, ("forward",))
    return tuple(rig.AtPressure(one, round(share * REFERENCE, -2)) for share in shares)


def limit_of(drawn: Sketch, name: str, folder: Path) -> float:
    """Give the detection limit of a change on the twin that hides nothing."""
    path = rig.write_campaign(folder, drawn.plant, plans_of(drawn), drawn.seed, "twin", drawn.bench)
    innocent = fit(drawn.model, read_campaign(path))
    magnitudes = scales(innocent.campaign)
    probes = tuple(CATALOGUE[one].guess(magnitudes) for one in HIDDEN)
    test = score_test(innocent.estimate, Search(magnitudes), probes)
    return SIGNIFICANT * next(score.error for score in test.scores if score.element.name == name)


def run_one(seed: int) -> dict[str, Any]:
    """Draw a campaign, close the loop on it, and say what it hides and what was found."""
    begin = time.perf_counter()
    drawn = sketch(seed, "none", ())
    drawn = sketch(seed, "coverage", ()) if drawn.layout != "stepped" else drawn
    plant = drawn.plant
    row: dict[str, Any] = {"seed": seed, "hidden": "", "drift": drawn.bench.drift}
    with tempfile.TemporaryDirectory() as folder:
        if seed % 2 == 0:
            name = tuple(HIDDEN)[seed // 2 % len(HIDDEN)]
            law, place = HIDDEN[name]
            draw = generator(seed, "size", name)
            limit = limit_of(drawn, name, Path(folder) / "twin")
            size = min(limit * log_uniform(draw, SMALLEST, LARGEST), abs(drawn.base[place]))
            size *= float(draw.choice([-1.0, 1.0]))
            plant = plant.plus(law(size, REFERENCE))
            row |= {"hidden": name, "size": size, "limit": limit, "share": size / drawn.base[place]}
        path = rig.write_campaign(Path(folder) / "blind", plant, plans_of(drawn), seed, "blind", drawn.bench)
        campaign = read_campaign(path)
    loop = close_loop(campaign)
    named = [sorted({one.effect, *one.indistinguishable}) for one in loop.findings]
    row |= {"verdict": loop.verdict, "named": named, "chi2_per_dof": loop.after.errors["fit"].chi2_per_dof}
    if any(row["hidden"] == element.name for element in loop.after.model.elements):
        # The model's reference is the mean over the records; the change in N/m a Pa is the same.
        found = f"{row['hidden']}.change"
        share = float(loop.after.model[f"{row['hidden']}.reference"]) / REFERENCE
        entry = loop.after.parameters[found]
        row["off"] = (entry.value - row["size"] * share) / entry.standard_error
    return row | {"seconds": round(time.perf_counter() - begin, 1)}


def report(rows: list[dict[str, Any]]) -> None:
    """Print how often what is hidden was found, and what is not there was not."""
    there, absent = ([row for row in rows if bool(row["hidden"]) == hides] for hides in (True, False))
    found = [row for row in there if any(row["hidden"] in names for names in row["named"])]
    wrong = [
        row
        for row in rows
        if any(row["hidden"] not in names and set(HIDDEN) & set(names) for names in row["named"])
    ]
    clean = [row for row in absent if row not in wrong]
    marks = Marks()
    for words, hits, count, mark in (
        ("found where it is", len(found), len(there), 0.90),
        ("not found where it is not", len(clean), len(absent), 0.95),
    ):
        low, high = wilson(hits, count)
        words = f"{words}: {hits} of {count} (95 %: {low:.2f} to {high:.2f}; mark {mark})"
        marks.judge(words, hits >= mark * count)
    for name in HIDDEN:
        own = [row for row in there if row["hidden"] == name]
        print(f"  {name}: {sum(row in found for row in own)} of {len(own)}")
    alone = sum(any(names == [row["hidden"]] for names in row["named"]) for row in found)
    print(f"named alone, not in a set: {alone} of {len(found)}")
    print(f"a wrong effect of pressure was named in {len(wrong)} of {len(rows)} campaigns")
    others = [row for row in rows if any(not {row["hidden"], *HIDDEN} & set(names) for names in row["named"])]
    print(f"another effect that is not there was named in {len(others)} of {len(rows)} campaigns")
    off = np.array([row["off"] for row in rows if "off" in row])
    if off.size:
        within, rms = np.mean(np.abs(off) < 1.96), np.sqrt(np.mean(off**2))
        print(f"change within 1.96 standard errors of the truth: {within:.2f} of {off.size}, rms {rms:.2f}")
    for row in there:
        if row not in found:
            size = abs(row["size"] / row["limit"])
            print(f"missed: seed {row['seed']}, {row['hidden']}, {size:.1f} limits, named {row['named']}")
    for row in [*wrong, *others]:
        print(f"wrong: seed {row['seed']}, hidden {row['hidden'] or 'nothing'}, named {row['named']}")
    marks.leave()


def main() -> None:
    """Run seeds, or report the file."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", default="520000:520060", help="FIRST:STOP")
    parser.add_argument("--out", type=Path, default=RESULTS, help="one line a campaign")
    parser.add_argument("--report", action="store_true")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="stop after so long")
    asked = parser.parse_args()
    rows = [json.loads(line) for line in asked.out.read_text().splitlines()] if asked.out.exists() else []
    if asked.report:
        report(rows)
    jax.config.update("jax_enable_x64", True)
    compile_quickly()
    begin, done = time.perf_counter(), {row["seed"] for row in rows}
    for seed in range(*map(int, asked.seeds.split(":"))):
        if seed in done or time.perf_counter() - begin > asked.seconds:
            continue
        line = json.dumps(run_one(seed))
        with asked.out.open("a") as file:
            file.write(line + "\n")
            file.flush()
            os.fsync(file.fileno())
        print(line, flush=True)


if __name__ == "__main__":
    main()
