"""Find the folds of the paper's y model and print them beside a table found by others.

Run `python benchmarks/folds.py` (about two minutes, most of it compiling; one core). Printed: the fold forces
at six frequencies from one batch of branches, the largest multiplier of the saddles between them, the closed
curve of folds with its two cusps, and the derivative of a fold force by each coefficient beside central
differences; seconds of the first call, which compiles, and of the second; PASS or FAIL a line. The exit
status is 1 after a FAIL.

The table: RK4 shooting with variational equations, 800 kg, damping of eq. (18), forces good to 0.01 N.
"""

import sys
import time
from collections.abc import Callable
from typing import Any

import jax

TABLE = {
    4.0: (211.67, 211.31, 1.023),
    4.1: (194.01, 190.62, 1.089),
    4.2: (178.12, 171.89, 1.120),
    4.4: (150.66, 144.52, 1.105),
    4.6: (128.87, 128.11, 1.026),
}
"""Frequency [Hz] to upper fold [N], lower fold [N] and largest multiplier of the saddles."""

LENS = (4.0, 4.65)
"""Where the table says that the lens ends: just below the one, about the other [Hz]."""


def timed(call: Callable[[], Any]) -> tuple[Any, float, float]:
    """Give the answer, the seconds of the first call and those of the second."""
    answer, seconds = None, []
    for _ in range(2):
        start = time.perf_counter()
        answer = jax.block_until_ready(call())
        seconds.append(time.perf_counter() - start)
    return answer, *seconds


def say(words: str, passed: bool) -> bool:
    """Print one line with its verdict."""
    print(f"{words:<96} {'PASS' if passed else 'FAIL'}", flush=True)
    return passed


def fold_table(model: Any) -> list[bool]:
    """Compare the folds at the frequencies of the table, and at one above its lens."""
    import jax.numpy as jnp

    import isojax as ij

    frequencies = jnp.array([*TABLE, 4.7])
    branch, first, again = timed(
        lambda: ij.continue_branch(model, parameter="amplitude", frequency=frequencies, start=1.0, stop=400.0)
    )
    largest = jnp.nanmax(branch.points.spectral_radius, axis=1)
    verdicts = []
    for place, (frequency, row) in enumerate(TABLE.items()):
        folds = [float(point.amplitude) for point in branch.special_points if point.branch == place]
        for name, wanted, found in zip(
            ("upper", "lower"), row[:2], [*folds, *[float("nan")] * 2][:2], strict=True
        ):
            words = f"{frequency:.1f} Hz, {name} fold: {found:9.4f} N, table {wanted:.2f} N (within 0.01)"
            verdicts.append(say(words, abs(found - wanted) <= 0.01))
        words = f"{frequency:.1f} Hz, largest multiplier: {float(largest[place]):.4f}, table {row[2]:.3f}"
        verdicts.append(say(words, abs(float(largest[place]) - row[2]) <= 1e-3))
    above = [point for point in branch.special_points if point.branch == len(TABLE)]
    verdicts.append(say(f"4.7 Hz: {len(above)} folds, table none", not above))
    print(f"six branches: first call {first:.1f} s, second {again:.2f} s\n")
    return verdicts


def lens(model: Any) -> list[bool]:
    """Follow the curve of folds and find its cusps."""
    import isojax as ij

    curve, first, again = timed(
        lambda: ij.fold_curve(model, amplitude_range=(1.0, 500.0), frequency_range=(3.0, 8.0))
    )
    cusps = sorted((float(cusp.frequency), float(cusp.amplitude)) for cusp in curve.cusps)
    verdicts = [
        say(
            f"curve of folds: {curve.amplitude.size} points, closed: {bool(curve.closed)}",
            bool(curve.closed) and ij.is_successful(curve.result),
        ),
        say(f"cusps: {len(cusps)}, table 2", len(cusps) == 2),
    ]
    if len(cusps) == 2:
        (low, low_force), (high, high_force) = cusps
        words = f"lower cusp: {low:.6f} Hz, {low_force:.5f} N; table just below {LENS[0]:.1f} Hz"
        verdicts.append(say(words, LENS[0] - 0.1 < low < LENS[0]))
        words = f"upper cusp: {high:.6f} Hz, {high_force:.5f} N; table about {LENS[1]:.2f} Hz"
        verdicts.append(say(words, abs(high - LENS[1]) < 0.01))
    print(f"curve with cusps: first call {first:.1f} s, second {again:.2f} s\n")
    return verdicts


def slopes(model: Any) -> list[bool]:
    """Compare the derivatives of a fold force with extrapolated central differences."""
    import isojax as ij

    def fold(model: Any) -> Any:
        branch = ij.continue_branch(model, parameter="amplitude", frequency=4.3, start=1.0, stop=400.0)
        return branch.special_points[0].amplitude

    exact, first, again = timed(lambda: jax.jacfwd(fold)(model))
    verdicts = []
    for entry in model.parameters:
        value = float(entry.value)

        def moved(share: float, name: str = entry.name, value: float = value) -> float:
            return float(fold(model.replace(**{name.replace(".", "__"): value * (1.0 + share)})))

        coarse, fine = ((moved(h) - moved(-h)) / (2 * h * value) for h in (2e-3, 1e-3))
        difference = (4 * fine - coarse) / 3
        off = abs(float(exact[entry.name]) / difference - 1.0)
        words = (
            f"d fold / d {entry.name}: {float(exact[entry.name]):.8e} N/({entry.spec.unit}), off by {off:.1e}"
        )
        verdicts.append(say(words, off < 1e-6))
    print(f"derivatives by all coefficients: first call {first:.1f} s, second {again:.2f} s\n")
    return verdicts


def main() -> int:
    """Run all of it."""
    jax.config.update("jax_enable_x64", True)
    import isojax as ij

    model = ij.paper.y_direction()
    verdicts = fold_table(model) + lens(model) + slopes(model)
    print(f"{sum(verdicts)} of {len(verdicts)} lines passed")
    return 0 if all(verdicts) else 1


if __name__ == "__main__":
    sys.exit(main())
