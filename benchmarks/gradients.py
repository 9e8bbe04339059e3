"""Derivatives in both modes of JAX, against each other and against central differences.

Run: python benchmarks/gradients.py

Of each quantity of the paper's y model, by its six coefficients: the largest difference between `jax.jacfwd`
and fourth-order central differences of the same function, and between `jax.grad` and `jax.jacfwd`, both over
the largest derivative, coefficients measured by their own size. Then the seconds of an orbit and of a map of
200 x 200 cells, median of five after one, to be compared between two versions, and the script of the page
docs/howto/sensitivity_study.md. PASS or FAIL beside each mark; the exit status is 1 after a FAIL.
"""

import os
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import jax

jax.config.update("jax_enable_x64", True)

import jax.numpy as jnp  # noqa: E402  (float64 first)
import numpy as np  # noqa: E402

import isojax as ij  # noqa: E402

FORWARD, BOTH = 1e-6, 1e-10
"""Marks: against differences, and of the two modes against each other."""

STEP = 2e-4
"""Of the differences, over each coefficient."""

PAGE = Path(__file__).parents[1] / "docs" / "howto" / "sensitivity_study.md"

verdicts: list[bool] = []


def mark(words: str, value: float, limit: float) -> None:
    """Print one figure that must not exceed its mark."""
    verdicts.append(bool(value <= limit))
    print(f"  {'PASS' if verdicts[-1] else 'FAIL'}  {words}: {value:.1e} (mark {limit:.0e})", flush=True)


def compare(words: str, model: ij.Isolator, quantity: Callable[[ij.Isolator], jax.Array]) -> None:
    """Compare the derivatives of one number of a model."""
    names = [entry.name for entry in model.parameters if entry.name != "mass"]
    size = jnp.asarray([float(model[name]) for name in names])

    def moved(shares: jax.Array) -> jax.Array:
        values = size * (1.0 + shares)
        own = {name.replace(".", "__"): values[place] for place, name in enumerate(names)}
        return quantity(model.replace(**own))

    begin, zero = time.perf_counter(), jnp.zeros(len(names))
    forward, reverse = jax.jacfwd(moved)(zero), jax.grad(moved)(zero)
    places = STEP * jnp.asarray([2.0, 1.0, -1.0, -2.0])[:, None, None] * jnp.eye(len(names))
    values = jnp.stack([jnp.stack([moved(shares) for shares in row]) for row in places])
    difference = jnp.asarray([-1.0, 8.0, -8.0, 1.0]) @ values / (12.0 * STEP)
    largest = float(jnp.max(jnp.abs(forward)))
    print(f"{words}: {float(moved(zero)):.6g}, {time.perf_counter() - begin:.0f} s")
    mark("jacfwd against differences", float(jnp.max(jnp.abs(forward - difference))) / largest, FORWARD)
    mark("grad against jacfwd", float(jnp.max(jnp.abs(reverse - forward))) / largest, BOTH)


def seconds(work: Callable[[], object]) -> float:
    """Give the median seconds of five calls after the first."""
    taken = []
    for _ in range(6):
        begin = time.perf_counter()
        jax.block_until_ready(work())
        taken.append(time.perf_counter() - begin)
    return float(np.median(taken[1:]))


def main() -> None:
    model = ij.paper.y_direction()
    beside, drive = ij.Harmonic(150.0, 4.3), 60.0
    compare(
        "displacement of an orbit beside the fold",
        model,
        lambda one: ij.find_periodic_orbit(one, beside).amplitude,
    )
    compare(
        "its largest multiplier",
        model,
        lambda one: ij.find_periodic_orbit(one, beside).floquet.spectral_radius,
    )
    resonance = ij.find_resonance(model, drive, (4.5, 6.5))
    at_peak = ij.Harmonic(drive, resonance.frequency)
    compare(
        "displacement of an orbit at resonance",
        model,
        lambda one: ij.find_periodic_orbit(one, at_peak).amplitude,
    )
    compare("peak amplitude", model, lambda one: ij.find_again(resonance, one).amplitude)
    compare("frequency of the peak", model, lambda one: ij.find_again(resonance, one).frequency)
    branch = ij.continue_branch(model, parameter="amplitude", frequency=4.3, start=120.0, stop=200.0)
    fold = branch.special_points[0]
    compare("fold force", model, lambda one: ij.find_again(fold, one).amplitude)
    smap = ij.stability_map(model, [100.0, 150.0], [4.3, float(resonance.frequency)])
    compare(
        "largest multiplier of a cell of a map at resonance",
        model,
        lambda one: ij.find_again(smap, one).spectral_radius[0, 1],
    )
    band = np.array([float(resonance.frequency)])
    compare(
        "transmissibility at resonance",
        model,
        lambda one: ij.transmissibility(one, drive, band).magnitude[0],
    )
    compare(
        "phase resonance, its force", model, lambda one: ij.backbone_curve(one, np.array([2e-4])).force[0]
    )
    compare(
        "mean square of a simulated record",
        model,
        lambda one: jnp.mean(ij.simulate(one, at_peak, duration=2.0).displacement ** 2),
    )
    grid = np.linspace(1.0, 120.0, 200), np.linspace(4.0, 8.0, 200)
    print(f"one orbit {1e3 * seconds(lambda: ij.find_periodic_orbit(model, beside).y0):.2f} ms")
    print(f"map of 200 x 200 {1e3 * seconds(lambda: ij.stability_map(model, *grid).multipliers):.0f} ms")
    script = PAGE.read_text(encoding="utf-8").split("```python\n")[1].split("```")[0]
    begin, here = time.perf_counter(), Path.cwd()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        exec(compile(script, PAGE.name, "exec"), {})
        os.chdir(here)
    lines = sum(bool(line.strip()) for line in script.splitlines())
    print(f"the page's script of {lines} lines, {time.perf_counter() - begin:.0f} s")
    sys.exit(0 if all(verdicts) else 1)


if __name__ == "__main__":
    main()
