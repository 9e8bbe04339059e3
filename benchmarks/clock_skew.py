"""Whether a skew between the clocks of the two channels is named, measured, and kept from its look-alikes.

    python benchmarks/clock_skew.py            judge on seeds 6000 to 6029: half an hour on one core
    python benchmarks/clock_skew.py --tune     seeds 5000 to 5009, on which the effect was made to work

Each campaign is that of the blind trial with nothing hidden. The simulated bench then files every response by
a clock that is 5, 20 or 100 ppm fast or slow: `rig.ClockSkew` reads a spline of the response at the other
clock's instants, before the anti-alias filter, and shares no code with the model. The loop is given the
campaign and no hint. Five more campaigns have a delay or a drift of the stiffness in place of the skew.

Printed: one line a campaign, then the counts with PASS or FAIL. Rows are kept in benchmarks/results; what has
a row is not run again.
"""

import argparse
import json
import sys
import tempfile
from pathlib import Path

import jax

jax.config.update("jax_enable_x64", True)

import numpy as np  # noqa: E402

from _trial_campaign import sketch  # noqa: E402  (float64 first)
from isojax import rig  # noqa: E402
from isojax.identification import close_loop, read_campaign  # noqa: E402

RESULTS = Path(__file__).resolve().parent / "results" / "clock_skew.jsonl"
TUNED = Path(__file__).resolve().parent / "out" / "clock_skew_tuned.jsonl"
SIZES = (5.0, 20.0, 100.0)
FAR = 2.5
"""Standard errors within which each declared coefficient must be."""

MOST_MISSED = 2
"""Campaigns with a skew, of thirty, in which name or coefficients may fail."""


def cases(first: int, campaigns: int) -> list[tuple[str, int, float]]:
    """List kind, seed and size: skews of either sign [ppm], delays [s], drifts of the stiffness [1]."""
    skews = [
        ("clock_skew", first + place, (-1.0) ** place * SIZES[place * len(SIZES) // campaigns])
        for place in range(campaigns)
    ]
    others = [("input_delay", 3e-4), ("stiffness_drift", 0.01), ("input_delay", -1e-3)]
    others += [("stiffness_drift", -0.02), ("input_delay", 2e-3)]
    return skews + [(kind, first + place, size) for place, (kind, size) in enumerate(others)]


def run(kind: str, seed: int, size: float) -> dict:
    """Simulate a campaign, diagnose it, and compare the declared coefficients with those of the plant."""
    drawn = sketch(seed, "none", ())
    hidden = {
        "clock_skew": lambda: rig.ClockSkew(1e-6 * size),
        "input_delay": lambda: rig.InputDelay(size),
        "stiffness_drift": lambda: rig.StiffnessDrift(size * drawn.base[0]),
    }[kind]()
    with tempfile.TemporaryDirectory() as folder:
        plant = drawn.plant.plus(hidden)
        campaign = read_campaign(
            rig.write_campaign(Path(folder), plant, drawn.plans, seed, "skew", drawn.bench)
        )
    loop = close_loop(campaign)
    fit = loop.after
    off = {
        element.name: (float(fit.model[name]) - truth) / fit.standard_errors[name]
        for element, truth in zip(drawn.model.elements, drawn.base, strict=True)
        if (name := f"{element.name}.{element.strength}") in fit.standard_errors
    }
    row = {
        "kind": kind,
        "seed": seed,
        "size": size,
        "layout": drawn.layout,
        "verdict": loop.verdict,
        "findings": [[finding.effect, *finding.indistinguishable] for finding in loop.findings],
        "off": off,
    }
    if fit.model.element("clock_skew") is not None:
        row["rate"] = [float(fit.model["clock_skew.rate"]), fit.standard_errors["clock_skew.rate"]]
    return row


def is_named(row: dict) -> bool:
    """Say whether a skew is the first name of the one finding."""
    return len(row["findings"]) == 1 and row["findings"][0][0] == "clock_skew"


def is_measured(row: dict) -> bool:
    """Say whether every declared coefficient is near the truth."""
    return len(row["off"]) == 6 and max(map(abs, row["off"].values())) < FAR


def shown(row: dict) -> str:
    """Word a row."""
    found = ", ".join(" or ".join(one) for one in row["findings"]) or "nothing"
    worst = max(row["off"], key=lambda name: abs(row["off"][name]))
    rate = "" if "rate" not in row else f", rate {row['rate'][0]:.2f} +- {row['rate'][1]:.2f} ppm"
    unit = {"clock_skew": "ppm", "input_delay": "s", "stiffness_drift": "of k1"}[row["kind"]]
    return (
        f"{row['seed']} {row['layout']:8s} {row['kind']} {row['size']:g} {unit}: {found}{rate}; "
        f"farthest {worst} by {row['off'][worst]:+.2f} standard errors"
    )


def main() -> int:
    """Run what is not yet run, print all of it, and say what passes."""
    parser = argparse.ArgumentParser(description="The clock skew, judged.")
    parser.add_argument("--tune", action="store_true", help="the seeds on which it was made to work")
    parser.add_argument("--cases", default=":", help="part of the list, such as 0:12; the rest is only read")
    options = parser.parse_args()
    first, campaigns = (5000, 10) if options.tune else (6000, 30)
    file = TUNED if options.tune else RESULTS
    file.parent.mkdir(exist_ok=True)
    done = {}
    if file.exists():
        for line in file.read_text(encoding="utf-8").splitlines():
            row = json.loads(line)
            done[row["kind"], row["seed"], row["size"]] = row
    wanted = cases(first, campaigns)
    begin, end = (int(text) if text else None for text in options.cases.split(":"))
    for case in wanted[begin:end]:
        if case in done:
            continue
        done[case] = run(*case)
        with file.open("a", encoding="utf-8") as stream:
            stream.write(json.dumps(done[case]) + "\n")
        print(shown(done[case]), flush=True)
    rows = [done[case] for case in wanted if case in done]
    print(f"\nAll {len(rows)} of {len(wanted)} campaigns")
    for row in rows:
        print(" ", shown(row))
    skews = [row for row in rows if row["kind"] == "clock_skew"]
    others = [row for row in rows if row["kind"] != "clock_skew"]
    good = [row for row in skews if is_named(row) and is_measured(row)]
    wrong = [row for row in others if any(found[0] == "clock_skew" for found in row["findings"])]
    alone = sum(row["findings"] == [["clock_skew"]] for row in skews)
    print(f"named first, and nothing found beside: {sum(map(is_named, skews))} of {len(skews)}")
    print(f"  of these without a look-alike that the records leave: {alone}")
    off = np.abs([own for row in skews for own in row["off"].values()])
    print(f"95 % intervals of declared coefficients with the truth: {np.mean(off < 1.96):.1%} of {off.size}")
    print(
        f"declared coefficients within {FAR} standard errors: {sum(map(is_measured, skews))} of {len(skews)}"
    )
    passed = len(good) >= len(skews) - MOST_MISSED and not wrong and len(rows) == len(wanted)
    print(
        f"both: {len(good)} of {len(skews)}; delays and drifts called a skew: {len(wrong)} of {len(others)}"
    )
    print("PASS" if passed else "FAIL")
    return 0 if passed else 1


if __name__ == "__main__":
    sys.exit(main())
