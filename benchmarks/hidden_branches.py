"""Responses that a curve does not reach, an isola and subharmonics, found without being asked for.

Run: python benchmarks/hidden_branches.py

Each case is one call of `ij.frequency_response` with nothing but model, drive and band. What it finds beside
the curve is compared with the balance of one harmonic in closed form (isola), with Nayfeh & Mook 1979, sec.
4.2 (subharmonic of order 1/3), and with SciPy's integration of the equation of motion. Ends with code 1 if a
mark is missed. The last lines give the time of the plain curve and of the curve with the search.
"""

import functools
import math
import sys
import time

import jax

jax.config.update("jax_enable_x64", True)

import numpy as np  # noqa: E402  (float64 first)
from scipy.integrate import solve_ivp  # noqa: E402
from scipy.optimize import brentq  # noqa: E402

import isojax as ij  # noqa: E402

TURN = 2.0 * math.pi

ISOLA = ij.Isolator(
    1.0,
    (
        ij.elements.LinearStiffness(1.0),
        ij.elements.LinearDamping(0.25),
        ij.elements.AbsQuadraticDamping(-0.2),
        ij.elements.CubicDamping(0.045),
    ),
)
"""Damping that rises, falls and rises again: one force holds three amplitudes at resonance."""

THIRD = ij.Isolator(
    1.0,
    (ij.elements.LinearStiffness(1.0), ij.elements.CubicStiffness(0.01), ij.elements.LinearDamping(0.004)),
)
"""Duffing's oscillator, so weakly nonlinear that perturbation holds."""

HALF = ij.Isolator(
    1.0,
    (
        ij.elements.LinearStiffness(1.0),
        ij.elements.QuadraticStiffness(0.3),
        ij.elements.CubicStiffness(0.1),
        ij.elements.LinearDamping(0.04),
    ),
)
"""A lopsided spring: near twice its natural frequency a subharmonic of order 1/2."""

LINEAR = ij.Isolator(1.0, (ij.elements.LinearStiffness(1.0), ij.elements.LinearDamping(0.1)))

CASES = {
    "isola, F = 0.105 N": (ISOLA, 0.105, (0.05, 0.4)),
    "subharmonic of order 1/3": (THIRD, 8.0, (0.3, 0.7)),
    "subharmonic of order 1/2": (HALF, 1.5, (0.2, 0.5)),
    "linear, nothing to find": (LINEAR, 1.0, (0.05, 0.6)),
    "paper's y model, 150 N": (ij.paper.y_direction(), 150.0, (3.5, 6.0)),
}

verdicts: list[bool] = []


def mark(words: str, value: float, limit: float) -> None:
    """Print one comparison."""
    verdicts.append(bool(value <= limit))
    print(f"  {'PASS' if verdicts[-1] else 'FAIL'}  {words}: {value:.2e} (mark {limit:.0e})", flush=True)


def timed(call) -> tuple[float, ij.FrequencyResponse]:
    """Give the seconds of a call, and what it gives."""
    begin = time.perf_counter()
    found = call()
    jax.block_until_ready(jax.tree.leaves(found))
    return time.perf_counter() - begin, found


def returns(rates, state, period: float) -> float:
    """Give how far SciPy's motion is from its start after a period, over the start."""
    run = solve_ivp(rates, (0.0, period), state, method="DOP853", rtol=1e-12, atol=1e-14)
    return float(np.max(np.abs(run.y[:, -1] - state)) / np.max(np.abs(state)))


def largest_miss(curve, rates, count: int = 7) -> float:
    """Give the largest `returns` of some points of a branch."""
    points = curve.branch.points
    places = np.linspace(0, points.frequency.size - 1, count).astype(int)
    frequency, states = np.asarray(points.frequency), np.asarray(points.y0)
    misses = [
        returns(functools.partial(rates, TURN * frequency[k]), states[k], curve.branch.periods / frequency[k])
        for k in places
    ]
    return max(misses)


def judge_isola(response: ij.FrequencyResponse) -> None:
    """Compare with the balance of one harmonic, `F^2 = a^2 (k - m w^2)^2 + D(w a)^2`."""
    found = [one for one in response.others if bool(one.branch.closed) and one.branch.periods == 1]
    mark("closed curves of one drive period, less one", abs(len(found) - 1), 0)

    def damper(speed):
        return 0.25 * speed - 0.2 * 8.0 / (3.0 * math.pi) * speed**2 + 0.75 * 0.045 * speed**3

    inner, outer = (float(brentq(lambda v: damper(v) - 0.105, *ends)) for ends in ((1.09, 2.26), (2.26, 4.0)))
    # Largest: at the lower frequency, where w a is the speed; by a fine search over the curve.
    speeds = np.linspace(inner, outer, 20001)[1:-1]
    pull = np.sqrt(np.maximum(0.105**2 - damper(speeds) ** 2, 0.0))
    # a (1 - w^2) = +-pull with a = v / w: w^2 +- (pull / v) w - 1 = 0.
    omega = np.concatenate([0.5 * (s * pull / speeds + np.sqrt((pull / speeds) ** 2 + 4.0)) for s in (1, -1)])
    size = np.tile(speeds, 2) / omega
    isola = found[0]
    got, frequency = np.asarray(isola.amplitude), np.asarray(isola.frequency)
    curve = float(np.nanmax(response.amplitude))
    print(f"  curve up to {curve:.3f} m; isola {got.min():.3f} to {got.max():.3f} m")
    mark("its largest displacement, closed form", abs(got.max() / size.max() - 1.0), 1e-2)
    mark("its smallest", abs(got.min() / size.min() - 1.0), 1e-2)
    mark("its lowest frequency", abs(TURN * frequency.min() / omega.min() - 1.0), 1e-2)
    mark("its highest", abs(TURN * frequency.max() / omega.max() - 1.0), 1e-2)

    def rates(omega, t, y):
        x, v = y
        return [v, 0.105 * math.sin(omega * t) - x - 0.25 * v + 0.2 * abs(v) * v - 0.045 * v**3]

    mark("its motions return under SciPy, over their size", largest_miss(isola, rates), 1e-4)


def judge_third(response: ij.FrequencyResponse) -> None:
    """Compare with Nayfeh & Mook 1979, eqs. (4.2.12) to (4.2.18), and with SciPy."""
    tripled = [one for one in response.others if one.branch.periods == 3]
    # Others of three periods are resonances of higher order, such as 2/3.
    found = [one for one in tripled if np.min(np.abs(np.asarray(one.frequency) - 0.6)) < 0.01]
    mark("curves of three drive periods through 0.6 Hz, less one", abs(len(found) - 1), 0)
    third = found[0]
    cubic, half_damping, force = 0.01, 0.002, 8.0

    def squares(omega: float) -> tuple[float, float]:
        pushed, detuning = force / (2.0 * (1.0 - omega**2)), omega - 3.0
        p = 8.0 * detuning / (9.0 * cubic) - 6.0 * pushed**2
        q = (64.0 / (81.0 * cubic**2)) * (9.0 * half_damping**2 + (detuning - 9.0 * cubic * pushed**2) ** 2)
        return p, p * p - q

    begins = brentq(lambda omega: squares(omega)[1], 3.0 + 1e-3, 3.3)
    first = float(np.asarray(third.frequency).min())
    print(f"  begins at {first:.4f} Hz; perturbation {begins / TURN:.4f} Hz")
    mark("where it begins, over the perturbation's", abs(TURN * first / begins - 1.0), 1e-2)

    def rates(omega, t, y):
        return [y[1], force * math.sin(omega * t) - y[0] - cubic * y[0] ** 3 - 2.0 * half_damping * y[1]]

    misses = [largest_miss(one, rates) for one in tripled]
    mark("all motions of three periods return after them under SciPy", max(misses), 1e-5)


def judge_half(response: ij.FrequencyResponse) -> None:
    """Compare with SciPy."""
    found = [one for one in response.others if one.branch.periods == 2]
    mark("no curve of two drive periods", float(not found), 0)

    def rates(omega, t, y):
        x, v = y
        return [v, 1.5 * math.sin(omega * t) - x - 0.3 * x**2 - 0.1 * x**3 - 0.04 * v]

    mark("its motions return after two periods under SciPy", largest_miss(found[0], rates), 1e-5)


def judge_none(response: ij.FrequencyResponse) -> None:
    """Nothing coexists with the curve."""
    mark("curves beside it", len(response.others), 0)


def main() -> int:
    """Run all cases."""
    judges = (judge_isola, judge_third, judge_half, judge_none, judge_none)
    rows = []
    for (words, (model, force, band)), judge in zip(CASES.items(), judges, strict=True):
        plain = functools.partial(ij.frequency_response, model, force, band, periods=())
        search = functools.partial(ij.frequency_response, model, force, band)
        seconds = [timed(call)[0] for call in (plain, search, plain, search)]
        response = search()
        print(f"{words}: {response!r}")
        judge(response)
        rows.append((words, seconds, len(response.others)))
    print("\nseconds                     cold: plain  + search   warm: plain  with search   ratio   found")
    for words, (cold, more, plain, whole), count in rows:
        print(
            f"{words:<30}{cold:>9.1f}{more:>10.1f}{plain:>14.2f}{whole:>13.2f}{whole / plain:>8.1f}{count:>8}"
        )
    print("PASS" if all(verdicts) else "FAIL")
    return 0 if all(verdicts) else 1


if __name__ == "__main__":
    sys.exit(main())
