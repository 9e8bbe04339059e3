"""Does a design reach its target, and is nothing better to be found?

Run `python benchmarks/design.py`; it takes five minutes of one core. Two problems:

1. Linear: an isolator of 800 kg whose transmissibility at 10 and 15 Hz is to stay below 0.5 and 0.2. Sought
   are the stiffest spring, the smallest mass, and the highest pressure of a chamber that stiffens with it;
   the closed forms are quadratic equations.
2. Nonlinear: the published isolator, y direction, jumps at the force of its fold at 4.3 Hz. The nearest
   springs (linear, |x|x and cubic, each within a fifth) that push this force to 175 N. Then the same with a
   chance of 0.99, each coefficient known to 0.3 %.

Printed: target and value, objective, closed form where there is one, and the scan of other coefficients; PASS
or FAIL for every limit kept, the closed form to 1e-6 and no better point in the scan. The exit status is 1
after a FAIL.
"""

import argparse
import time
from typing import NamedTuple

import jax
import numpy as np

import isojax as ij
from _marks import Marks
from isojax import compile_quickly
from isojax.inference import at_least, at_most

STIFFNESS = (
    "linear_stiffness.coefficient",
    "abs_quadratic_stiffness.coefficient",
    "cubic_stiffness.coefficient",
)
TARGET = 175.0


class Known(NamedTuple):
    """A model whose coefficients are known to a relative error."""

    model: ij.Isolator
    free: tuple[str, ...]
    covariance: np.ndarray
    result: ij.RESULTS = ij.RESULTS.successful


def judge(marks: Marks, found: ij.inference.Design) -> None:
    """Judge what holds of every design."""
    marks.judge("every limit is kept", all(one.kept for one in found.outcomes))
    marks.judge(f"nothing better in the scan: {found.scan.words}", found.scan.better == 0)


def linear(marks: Marks, scan: int) -> None:
    """Print the linear problems."""
    spring, mass, damping = 2e5, 800.0, 4e3
    rates, limits = 2.0 * np.pi * np.array([10.0, 15.0]), np.array([0.5, 0.2])
    chamber = ij.elements.PressureStiffness(change=1e6, reference=2e5)
    plain = ij.Isolator(mass, (ij.LinearStiffness(spring), ij.LinearDamping(damping)))

    def transmissibility(isolator: ij.Isolator) -> jax.Array:
        return ij.transmissibility(isolator, 10.0, rates / (2.0 * np.pi)).magnitude

    # k^2 + (c w)^2 = T^2 ((k - m w^2)^2 + (c w)^2), its root below m w^2 for k, above k / w^2 for m.
    lost, inverse = (damping * rates) ** 2, mass * rates**2
    stiffest = min(
        np.roots([1.0 - t**2, 2.0 * t**2 * w, c * (1.0 - t**2) - (t * w) ** 2]).max()
        for t, w, c in zip(limits, inverse, lost, strict=True)
    )
    lightest = np.max((spring + np.sqrt((spring**2 + lost) / limits**2 - lost)) / rates**2)
    k1, heavy = STIFFNESS[0], plain.replace(mass=4.0 * mass)
    for model, objective, free, exact in (
        (plain, lambda isolator: -isolator[k1], {k1: (1e5, 1e7)}, stiffest),
        (heavy, lambda isolator: isolator.mass, {"mass": (100.0, 1e4)}, lightest),
        (
            plain.with_elements(chamber),
            lambda isolator: -isolator[k1],
            {"pressure": (1.7e5, 9e5)},
            2e5 * (1.0 + (stiffest - spring) / 1e6),
        ),
    ):
        limit = at_most(transmissibility, limits, name="transmissibility")
        found = ij.design(model, objective, limit, free=free, scan=scan)
        print(repr(found), flush=True)
        off = found.values[0] / exact - 1.0
        marks.judge(
            f"closed form {exact:.7g} {found.units[0]}, off by {off:+.1e} (mark 1e-6)", abs(off) < 1e-6
        )
        judge(marks, found)


def nonlinear(marks: Marks, scan: int, chance: float | None) -> None:
    """Print the nonlinear problem."""
    model = ij.paper.y_direction()

    def fold_force(isolator: ij.Isolator) -> jax.Array:
        branch = ij.continue_branch(isolator, parameter="amplitude", frequency=4.3, start=1.0, stop=600.0)
        folds = [point.amplitude for point in branch.special_points if point.kind == "fold"]
        return folds[0] if folds else np.nan  # pyright: ignore[reportReturnType]

    names = tuple(entry.name for entry in model.parameters if entry.name != "mass")
    errors = np.diag([(0.003 * float(model[name])) ** 2 for name in names])
    begin = time.perf_counter()
    found = ij.design(
        model,
        subject_to=at_least(fold_force, TARGET, chance=chance),
        free={
            name: tuple(sorted((0.8 * float(model[name]), 1.2 * float(model[name])))) for name in STIFFNESS
        },
        fit=None if chance is None else Known(model, names, errors),
        scan=scan,
    )
    print(f"fold force before: {float(fold_force(model)):.5g} N")
    print(repr(found))
    judge(marks, found)
    print(f"{time.perf_counter() - begin:.0f} s\n")


PROBLEMS = {
    "linear": linear,
    "nonlinear": lambda marks, scan: nonlinear(marks, scan, None),
    "chance": lambda marks, scan: nonlinear(marks, scan, 0.99),
}


def main() -> None:
    """Print the problems."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scan", type=int, default=200, help="points with which a design is compared")
    parser.add_argument("--problems", nargs="+", default=list(PROBLEMS), choices=PROBLEMS)
    options = parser.parse_args()
    jax.config.update("jax_enable_x64", True)
    compile_quickly()
    marks = Marks()
    for name in options.problems:
        PROBLEMS[name](marks, options.scan)
    marks.leave()


if __name__ == "__main__":
    main()
