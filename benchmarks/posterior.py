"""Intervals of coefficients three ways: error bars of the fit, profile likelihood, and posterior by NUTS.

Run: python benchmarks/posterior.py            six records, then two; about three minutes on one core
     python benchmarks/posterior.py --draws 500 --records 6

The campaign is simulated by the rig: 800 kg on a linear and a cubic spring with a linear damper, stepped
sines of four dwells at 250 Hz, three levels up and down (or two levels up), a stiffness that scatters from
record to record by 0.05 %. The table has for each coefficient the error bar of the fit; by how much the ends
of the profile interval differ from the symmetric ones, over the half-width; and standard deviation and half
the 95 % interval of the draws over those of the fit. With few records the scatter of the stiffness is hardly
known: the posterior then has long tails, which raise the standard deviation more than the interval. It takes
2 x 10000 draws (`--draws 10000`, about a quarter of an hour) to tell the interval to a few per cent then.

Prints PASS or FAIL for each campaign against the mark of 10 %, on the interval of NUTS and on its standard
deviation; ends with code 1 after a FAIL.
"""

import argparse
import sys
import tempfile
import time
from pathlib import Path

import jax
import numpy as np

jax.config.update("jax_enable_x64", True)

import isojax as ij  # noqa: E402  (float64 first)
from isojax import rig  # noqa: E402

MARK = 0.1
PLANT = rig.Plant((rig.LinearStiffness(8e5), rig.CubicStiffness(8e9), rig.LinearDamping(1.5e3)))
LAYOUTS = {6: ((30.0, 60.0, 90.0), ("forward", "backward")), 2: ((30.0, 90.0), ("forward",))}
"""Levels and directions by the count of records."""

WIDTH = 2.0 * 1.959964
"""95 % interval of a normal law, in standard deviations."""


def fitted(records: int, seed: int):
    """Simulate and fit a campaign."""
    levels, directions = LAYOUTS[records]
    plan = rig.SteppedSine(levels, (4.6, 4.9, 5.1, 5.4), 8, directions)
    with tempfile.TemporaryDirectory() as folder:
        path = rig.write_campaign(
            Path(folder),
            PLANT,
            plan,
            seed,
            f"{records} records",
            rig.Bench(rate=250.0),
            declared=tuple(law.name for law in PLANT.laws),
        )
        return ij.fit(ij.read_campaign(path))


def compare(records: int, seed: int, draws: int) -> dict[str, float]:
    """Print the table of one campaign; give the worst differences of NUTS from the fit."""
    fit = fitted(records, seed)
    begin = time.perf_counter()
    drawn = ij.posterior(fit, draws=draws, seed=seed)
    seconds = time.perf_counter() - begin
    print(
        f"{records} records, scatter of the stiffness {fit.stats.stiffness_scatter:.1e}: 2 x {draws} draws "
        f"in {seconds:.0f} s, r_hat at most {drawn.r_hat.max():.3f}, {drawn.divergent} divergent"
    )
    print("| coefficient | fit | profile, lower | profile, upper | NUTS, sd | NUTS, interval | effective |")
    print("|---|---|---|---|---|---|---|")
    spread = drawn.standard_error
    width = np.diff(drawn.interval, axis=0)[0] / WIDTH
    worst = {"standard deviation": 0.0, "interval": 0.0}
    for place, one in enumerate(drawn.coefficients):
        profile = ij.profile(fit, one.name)
        ends = (profile.interval - profile.symmetric) / (0.5 * WIDTH * one.standard_error)
        ratios = spread[place] / one.standard_error, width[place] / one.standard_error
        worst = {
            what: max(so_far, abs(ratio - 1.0))
            for (what, so_far), ratio in zip(worst.items(), ratios, strict=True)
        }
        print(
            f"| {one.name} | {one.words} | {ends[0]:+.3f} | {ends[1]:+.3f} | {ratios[0]:.3f} | "
            f"{ratios[1]:.3f} | {drawn.effective_draws[place]:.0f} |"
        )
    return worst


def main() -> None:
    """Print the tables and the verdict."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--records", type=int, nargs="+", default=list(LAYOUTS), choices=LAYOUTS)
    parser.add_argument("--draws", type=int, default=2000, help="of each of two chains")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    ij.compile_quickly()
    passed = True
    for records in options.records:
        for what, worst in compare(records, options.seed, options.draws).items():
            passed &= worst <= MARK
            print(f"{'PASS' if worst <= MARK else 'FAIL'}  worst {what} of NUTS: off by {worst:.3f} ({MARK})")
        print()
    sys.exit(0 if passed else 1)


if __name__ == "__main__":
    main()
