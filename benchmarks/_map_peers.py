"""Hand-written peers of `stability_map`: SciPy cell by cell, Numba, and C.

The law is k1 x + k2 |x|x + k3 x^3 + c1 v + c2 |v|v + c3 v^3.

All find the orbit of each cell by Newton's method on the period map with the variational equations, as
`stability_map` does, and stop by its rule: the step relative to the motion. The compiled ones march up the
forces in each column of frequency, so that a start costs nothing but an extrapolation from the orbits before.
"""

import ctypes
import math
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

# Numba asks for the package of this name, and would find the script beside this file.
sys.modules.setdefault("coverage", None)  # pyright: ignore[reportArgumentType]

from numba import njit, prange, set_num_threads  # noqa: E402  (after the line above)

C_FLAGS = ("-O3", "-march=native")
DEGREE = 2
"""Of the extrapolation: a secant needs 1.4 passes a cell, a parabola 1.02, a cubic no fewer."""

PASSES = 12


class Task(NamedTuple):
    """What is asked: law and forces are over the mass.

    Attributes:
        law: k1 k2 k3 c1 c2 c3.
        forces: ascending.
        frequencies: [Hz].
        tolerance: of the last step, relative to the motion.
    """

    law: np.ndarray
    forces: np.ndarray
    frequencies: np.ndarray
    tolerance: float


class Answer(NamedTuple):
    """Of the full period's matrix, (force, frequency), NaN where no orbit was found; and passes a cell."""

    radius: np.ndarray
    trace: np.ndarray
    determinant: np.ndarray
    passes: float


Peer = Callable[[Task, bool, int], Answer]
"""Solves a task, given whether by the half-period map, and the steps a period."""


def sine_table(steps: int, half: bool) -> np.ndarray:
    """Give the sine at the stages of all steps."""
    count = steps // 2 if half else steps
    return np.sin(np.pi * np.arange(2 * count + 1) / steps)


def rates(law: np.ndarray, x: float, v: float) -> tuple[float, float, float]:
    """Give the force of the law over the mass and its slopes in x and v."""
    k1, k2, k3, c1, c2, c3 = law
    ax, av = abs(x), abs(v)
    force = x * (k1 + ax * (k2 + ax * k3)) + v * (c1 + av * (c2 + av * c3))
    return force, k1 + ax * (2.0 * k2 + 3.0 * k3 * ax), c1 + av * (2.0 * c2 + 3.0 * c3 * av)


def solve_cell(task: Task, force: float, frequency: float, half: bool) -> float:
    """Find one orbit with SciPy: DOP853 at a relative tolerance of 1e-10, started from the linear answer.

    Returns:
        Spectral radius; NaN where Newton's method did not converge.
    """
    omega = 2.0 * math.pi * frequency
    numbers = [float(value) for value in task.law]

    def field(t: float, y: np.ndarray) -> tuple[float, ...]:
        x, v, a, b, c, d = y
        law, kx, cv = rates(numbers, x, v)  # pyright: ignore[reportArgumentType]
        return v, force * math.sin(omega * t) - law, c, d, -kx * a - cv * c, -kx * b - cv * d

    linear = force / complex(numbers[0] - omega**2, numbers[3] * omega)
    z, size = np.array([linear.imag, linear.real * omega]), abs(linear)
    scale = np.array([size, size * omega, 1.0, 1.0 / omega, omega, 1.0])
    sign, span = (-1.0, 0.5 / frequency) if half else (1.0, 1.0 / frequency)
    for _ in range(PASSES):
        start = [*z, 1.0, 0.0, 0.0, 1.0]
        end = solve_ivp(field, (0.0, span), start, method="DOP853", rtol=1e-10, atol=1e-10 * scale).y[:, -1]
        matrix = sign * end[2:].reshape(2, 2)
        step = np.linalg.solve(np.eye(2) - matrix, sign * end[:2] - z)
        z = z + step
        if np.max(np.abs(step) / [1.0, omega]) <= task.tolerance * math.hypot(z[0], z[1] / omega):
            radius = np.abs(np.linalg.eigvals(matrix)).max()
            return float(radius**2 if half else radius)
    return math.nan


@njit(inline="always")
def _predicted(law, push, omega, known, old_force, old_x, old_v, degree):
    """Extrapolate from the orbits before; the first of a column starts from the linear answer."""
    if known == 0:
        re, im = law[0] - omega * omega, law[3] * omega
        scale = push / (re * re + im * im)
        return -im * scale, re * omega * scale
    points = min(known, degree + 1)
    x = v = 0.0
    for p in range(points):
        weight = push / old_force[0] if points == 1 else 1.0
        for q in range(points):
            if q != p:
                weight *= (push - old_force[q]) / (old_force[p] - old_force[q])
        x += weight * old_x[p]
        v += weight * old_v[p]
    return x, v


@njit(inline="always")
def _stage(k1, k2, k3, c1, c2, c3, x, v, a, b, c, d, drive):
    ax, av = abs(x), abs(v)
    kx, cv = k1 + ax * (2.0 * k2 + 3.0 * k3 * ax), c1 + av * (2.0 * c2 + 3.0 * c3 * av)
    rate = drive - x * (k1 + ax * (k2 + ax * k3)) - v * (c1 + av * (c2 + av * c3))
    return rate, -kx * a - cv * c, -kx * b - cv * d


@njit(parallel=True, error_model="numpy")
def _sweep(law, forces, frequencies, steps, half, sine, tolerance, degree, radius, traces, products, passes):
    k1, k2, k3, c1, c2, c3 = law[0], law[1], law[2], law[3], law[4], law[5]
    count = (sine.size - 1) // 2
    sign = -1.0 if half else 1.0
    for column in prange(frequencies.size):
        omega, h = 2.0 * np.pi * frequencies[column], 1.0 / (steps * frequencies[column])
        g, w = 0.5 * h, h / 6.0
        old_force, old_x, old_v = np.ones(4), np.zeros(4), np.zeros(4)
        for place in range(forces.size):
            push = forces[place]
            px, pv = _predicted(law, push, omega, min(place, 4), old_force, old_x, old_v, degree)
            good = False
            trace = product = np.nan
            for _ in range(PASSES):
                x, v, a, b, c, d = px, pv, 1.0, 0.0, 0.0, 1.0
                for n in range(count):
                    f0, f1, f2 = push * sine[2 * n], push * sine[2 * n + 1], push * sine[2 * n + 2]
                    p1, q1, r1 = _stage(k1, k2, k3, c1, c2, c3, x, v, a, b, c, d, f0)
                    y, v2, s, t, cc2, dd2 = (
                        x + g * v,
                        v + g * p1,
                        a + g * c,
                        b + g * d,
                        c + g * q1,
                        d + g * r1,
                    )
                    p2, q2, r2 = _stage(k1, k2, k3, c1, c2, c3, y, v2, s, t, cc2, dd2, f1)
                    y, v3, s, t = x + g * v2, v + g * p2, a + g * cc2, b + g * dd2
                    cc3, dd3 = c + g * q2, d + g * r2
                    p3, q3, r3 = _stage(k1, k2, k3, c1, c2, c3, y, v3, s, t, cc3, dd3, f1)
                    y, v4, s, t = x + h * v3, v + h * p3, a + h * cc3, b + h * dd3
                    cc4, dd4 = c + h * q3, d + h * r3
                    p4, q4, r4 = _stage(k1, k2, k3, c1, c2, c3, y, v4, s, t, cc4, dd4, f2)
                    x += w * (v + 2.0 * (v2 + v3) + v4)
                    v += w * (p1 + 2.0 * (p2 + p3) + p4)
                    a += w * (c + 2.0 * (cc2 + cc3) + cc4)
                    b += w * (d + 2.0 * (dd2 + dd3) + dd4)
                    c += w * (q1 + 2.0 * (q2 + q3) + q4)
                    d += w * (r1 + 2.0 * (r2 + r3) + r4)
                a, b, c, d = sign * a, sign * b, sign * c, sign * d
                gx, gv = sign * x - px, sign * v - pv
                determinant = (1.0 - a) * (1.0 - d) - b * c
                dx, dv = ((1.0 - d) * gx + b * gv) / determinant, (c * gx + (1.0 - a) * gv) / determinant
                trace, product = a + d, a * d - b * c
                px += dx
                pv += dv
                passes[column] += 1
                motion = np.sqrt(px * px + pv * pv / (omega * omega))
                if max(abs(dx), abs(dv) / omega) <= tolerance * motion:
                    good = True
                    break
            if half:
                trace, product = trace * trace - 2.0 * product, product * product
            root = trace * trace - 4.0 * product
            rho = 0.5 * (abs(trace) + np.sqrt(root)) if root > 0.0 else np.sqrt(abs(product))
            radius[place, column] = rho if good else np.nan
            traces[place, column] = trace if good else np.nan
            products[place, column] = product if good else np.nan
            for p in range(3, 0, -1):
                old_force[p], old_x[p], old_v[p] = old_force[p - 1], old_x[p - 1], old_v[p - 1]
            old_force[0], old_x[0], old_v[0] = push, px, pv


def numba_peer(threads: int) -> Peer:
    """Give the Numba peer: `prange` over the columns, one cell at a time."""
    set_num_threads(threads)

    def solve(task: Task, half: bool, steps: int) -> Answer:
        forces, frequencies, sine = task.forces, task.frequencies, sine_table(steps, half)
        radius, trace, product = (np.empty((forces.size, frequencies.size)) for _ in range(3))
        passes = np.zeros(frequencies.size, dtype=np.int64)
        _sweep(
            task.law, forces, frequencies, steps, half, sine, task.tolerance, DEGREE,
            radius, trace, product, passes,
        )  # fmt: skip
        return Answer(radius, trace, product, passes.sum() / radius.size)

    return solve


def c_peer(threads: int, lanes: int, flags: tuple[str, ...] = C_FLAGS) -> Peer | None:
    """Compile the C peer and give it, or None where there is no compiler.

    Args:
        threads: of OpenMP.
        lanes: columns side by side.
        flags: of the compiler.
    """
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        return None
    source = Path(__file__).with_name("_map_peer.c")
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "peer.so"
        options = [*flags, "-fopenmp", "-shared", "-fPIC", f"-DLANES={lanes}"]
        subprocess.run([compiler, *options, "-o", target, source, "-lm"], check=True)
        sweep = ctypes.CDLL(str(target)).sweep
    sweep.restype = ctypes.c_long

    def numbers(values: np.ndarray) -> ctypes.Array:
        return values.ctypes.data_as(ctypes.POINTER(ctypes.c_double))  # pyright: ignore[reportReturnType]

    def solve(task: Task, half: bool, steps: int) -> Answer:
        shape = (task.forces.size, task.frequencies.size)
        radius, trace, product = (np.empty(shape) for _ in range(3))
        given = [numbers(values) for values in (task.forces, task.frequencies, task.law)]
        # The table must outlive the call.
        sine = sine_table(steps, half)
        passes = sweep(
            *shape, *given, steps, int(half), numbers(sine), ctypes.c_double(task.tolerance), DEGREE, threads,
            *(numbers(values) for values in (radius, trace, product)),
        )  # fmt: skip
        return Answer(radius, trace, product, passes / radius.size)

    return solve
