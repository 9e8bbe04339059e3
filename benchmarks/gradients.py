"""Derivatives in both modes of JAX, against each other and against central differences.

Run: python benchmarks/gradients.py

Of each quantity of the paper's y model, by its six coefficients: the largest difference between `jax.jacfwd`
and fourth-order central differences of the same function, and between `jax.grad` and `jax.jacfwd`, both over
the largest derivative, coefficients measured by their own size. Derivatives of a map that are
read off tables are compared with such differences of single orbits, beside the error that the map reports.
Then the seconds of an orbit and of a map of 200 x 200 cells, median of five after one, to be compared between
two versions, and the script of the page docs/howto/sensitivity_study.md. PASS or FAIL beside each mark; the
exit status is 1 after a FAIL.
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

CLOSE_STEP = 1e-4
"""Of differences of sixth order where cells next to a fold are compared: the response bends within less."""

SAMPLES = 8192
"""Steps a period of the orbits with which others are compared."""

PEAK, AT_PEAK = (120.0, 4.8), 1e-5
"""Drive of an orbit whose displacement is most sensitive, and mark of its derivatives with default steps."""

FINE = 1024
"""Steps a period of a map with which only the reading is in error."""

LEAST_SHARE = 1e-4
"""Of what a relative change of any coefficient moves, below which no derivative is measured by its size."""

CELLS = 12
"""Of a map, at peaks and as many drawn, at which derivatives that are read off are compared."""

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


def default_steps(model: ij.Isolator) -> None:
    """Compare the derivatives of an amplitude with the default steps with those of many.

    Each by the change of the amplitude that a relative change of its coefficient makes.
    """

    def slopes(integrator: ij.Integrator | None) -> np.ndarray:
        moved = jax.grad(lambda one: ij.find_periodic_orbit(one, drive, integrator=integrator).amplitude)
        return np.array([float(slope) for slope in jax.tree.leaves(moved(model))])

    drive = ij.Harmonic(*PEAK)
    usual, many = slopes(None), slopes(ij.Integrator(steps_per_period=SAMPLES // 4))
    print(f"displacement of an orbit at {PEAK[0]:g} N and {PEAK[1]:g} Hz, with default steps")
    mark("each derivative against that with many", float(np.max(np.abs(usual / many - 1.0))), AT_PEAK)


def read_off(model: ij.Isolator, steps: int | None) -> None:
    """Compare derivatives of a map that are read off tables with differences of single orbits.

    At the peaks of rows, at the corners and at cells drawn at random: the largest error of the derivatives of
    the response and of sum and product of the multipliers, over their size, their median over the map, or
    the least share of what a relative change of any coefficient moves: as the map defines what it reports.
    """
    names = [entry.name for entry in model.parameters if entry.name != "mass"]
    size = jnp.asarray([float(model[name]) for name in names])
    integrator = None if steps is None else ij.Integrator(steps_per_period=steps)
    axes = np.linspace(1.0, 120.0, 200), np.linspace(4.0, 8.0, 100)
    smap = ij.stability_map(model, *axes, integrator=integrator)
    slopes = ij.sensitivity(smap, parameters=names)
    if slopes.error is None:
        raise RuntimeError("No derivative of the map was read off.")
    roots, moved = slopes.values["multipliers"], slopes.derivatives["multipliers"]
    whole = jnp.stack(
        [
            slopes.derivatives["response"],
            jnp.real(moved.sum(axis=-1)),
            jnp.real((moved * roots[..., ::-1]).sum(axis=-1)),
        ],
        axis=1,
    )
    rows = np.linspace(0, 199, CELLS).astype(int)
    peaks = np.stack([rows, np.asarray(smap.response).argmax(axis=1)[rows]], axis=1)
    corners = np.array([[row, column] for row in (0, 199) for column in (0, 99)])
    drawn = np.random.default_rng(3).integers(0, [200, 100], (CELLS, 2))
    cells = np.unique(np.concatenate([peaks, corners, drawn]), axis=0).T

    @jax.jit
    @jax.vmap
    def numbers(shares: jax.Array, force: jax.Array, frequency: jax.Array, start: jax.Array) -> jax.Array:
        own = {
            name.replace(".", "__"): size[place] * (1.0 + shares[place]) for place, name in enumerate(names)
        }
        # As it is not known to JAX whether the model is odd.
        orbit = ij.find_periodic_orbit(
            model.replace(**own),
            ij.Harmonic(force, frequency),
            start=start,
            symmetric=True,
            integrator=ij.Integrator(steps_per_period=SAMPLES),
        )
        own_roots = orbit.floquet.multipliers
        return jnp.stack([orbit.amplitude, jnp.real(own_roots.sum()), jnp.real(own_roots.prod())])

    drive = smap.amplitudes[cells[0]], smap.frequencies[cells[1]], smap.y0[tuple(cells)]
    exact = []
    for place in range(len(names)):
        aside = [
            numbers(jnp.tile(share * CLOSE_STEP * jnp.eye(len(names))[place], (cells.shape[1], 1)), *drive)
            for share in (3.0, 2.0, 1.0, -1.0, -2.0, -3.0)
        ]
        weights = jnp.asarray([1.0, -9.0, 45.0, -45.0, 9.0, -1.0]) / (60.0 * CLOSE_STEP * size[place])
        exact.append(jnp.tensordot(weights, jnp.stack(aside), axes=1).T)
    moved = jnp.median(jnp.abs(whole), axis=(-2, -1)) * jnp.abs(size)[:, None]
    usual = (jnp.maximum(moved, LEAST_SHARE * moved.max(axis=0)) / jnp.abs(size)[:, None])[..., None]
    known, exact = whole[:, :, cells[0], cells[1]], jnp.stack(exact)
    error = jnp.abs(known - exact) / jnp.maximum(jnp.abs(exact), usual)
    words = "response", "sum of the multipliers", "product of the multipliers"
    largest = {name: float(error[:, place].max()) for place, name in enumerate(words)}
    taken = f"200 x 100, {smap.integrator.steps_per_period} steps a period, {cells.shape[1]} cells"
    print(f"derivatives of a map of {taken}; reported for reading them off {slopes.error:.1e}")
    if steps is None:
        # What the steps of the map leave is not in what it reports.
        print(f"  largest error: {', '.join(f'{name} {value:.1e}' for name, value in largest.items())}")
        return
    for name, value in largest.items():
        mark(f"{name} against differences of single orbits", value, slopes.error)


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
    default_steps(model)
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
    read_off(model, None)
    read_off(model, FINE)
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
