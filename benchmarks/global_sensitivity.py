"""Sobol indices against the closed form of Ishigami's function, and against local ones in the linear limit.

Run: python benchmarks/global_sensitivity.py

Prints each comparison with PASS or FAIL against its mark; ends with code 1 if any fails. Ishigami's function,
sin a + 7 sin^2 b + 0.1 c^4 sin a, has its indices in closed form (Ishigami & Homma 1990). The linear limit is
the amplitude of the paper's y model at 60 N and 4 Hz: with small independent errors s_i the index of each
coefficient is (slope_i s_i)^2 over the sum of all, the slopes being exact derivatives. Several seeds of each,
at the default number of samples.
"""

import sys
import time

import jax

jax.config.update("jax_enable_x64", True)

import jax.numpy as jnp  # noqa: E402  (float64 first)
import numpy as np  # noqa: E402
from scipy import stats  # noqa: E402

import isojax as ij  # noqa: E402

MARK = 0.02
ERRORS = {"linear_stiffness": 1e-4, "abs_quadratic_stiffness": 1e-3, "linear_damping": 1e-3}
"""Relative standard errors of the coefficients."""


def ishigami(x: dict[str, jax.Array]) -> jax.Array:
    return jnp.sin(x["a"]) + 7.0 * jnp.sin(x["b"]) ** 2 + 0.1 * x["c"] ** 4 * jnp.sin(x["a"])


def closed_form() -> tuple[np.ndarray, np.ndarray]:
    """Give first and total indices of Ishigami's function."""
    own, pair = 0.5 * (1.0 + 0.1 * np.pi**4 / 5.0) ** 2, 0.01 * np.pi**8 * (1.0 / 18.0 - 1.0 / 50.0)
    first = np.array([own, 49.0 / 8.0, 0.0])
    return first / (first.sum() + pair), (first + np.array([pair, 0.0, pair])) / (first.sum() + pair)


def amplitude(model: ij.Isolator) -> jax.Array:
    return ij.harmonic_balance(model, ij.Harmonic(60.0, 4.0), harmonics=3).amplitude


def compare(title: str, quantity, ranges, model, seeds: int, first: np.ndarray, total: np.ndarray) -> bool:
    """Print the indices of the first seed, and the worst error of all."""
    begin = time.perf_counter()
    found = [ij.global_sensitivity(quantity, ranges, model, seed=seed) for seed in range(seeds)]
    seconds = time.perf_counter() - begin
    print(f"{title}: {found[0].samples} samples, {len(found)} seeds in {seconds:.1f} s")
    for place, name in enumerate(found[0].inputs):
        print(f"  {name}")
        for word, index, interval, reference in (
            ("first", found[0].first, found[0].first_interval, first),
            ("total", found[0].total, found[0].total_interval, total),
        ):
            low, high = interval[:, place]
            print(f"    {word} {index[place]:.4f} [{low:.4f}, {high:.4f}], reference {reference[place]:.4f}")
    worst = max(
        float(max(np.max(np.abs(one.first - first)), np.max(np.abs(one.total - total)))) for one in found
    )
    inside = np.mean(
        [
            (interval[0] <= truth) & (truth <= interval[1])
            for one in found
            for truth, interval in ((first, one.first_interval), (total, one.total_interval))
        ]
    )
    passed = worst <= MARK
    print(f"  intervals that hold the reference: {inside:.3f} of them")
    print(f"  {'PASS' if passed else 'FAIL'}  worst error of an index: {worst:.4f} (mark {MARK})")
    return passed


def main() -> None:
    """Compare both."""
    circle = {name: (-np.pi, np.pi) for name in "abc"}
    passed = [compare("Ishigami's function", ishigami, circle, None, 20, *closed_form())]
    model = ij.paper.y_direction()
    ranges = {
        f"{name}.coefficient": stats.norm(
            model[f"{name}.coefficient"], share * abs(model[f"{name}.coefficient"])
        )
        for name, share in ERRORS.items()
    }
    slopes = ij.sensitivity(amplitude, model, parameters=tuple(ranges)).derivatives["value"]
    parts = np.square(np.asarray(slopes) * np.array([law.std() for law in ranges.values()]))
    local = parts / parts.sum()
    passed.append(compare("amplitude, linear limit", amplitude, ranges, model, 3, local, local))
    sys.exit(0 if all(passed) else 1)


if __name__ == "__main__":
    main()
