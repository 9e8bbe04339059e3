"""Bifurcations, chaos, derivatives and spread maps against publications, SciPy and one device.

Run: python benchmarks/published.py

Prints each figure with PASS or FAIL against its mark; ends with code 1 if any fails. SciPy stands for
`_shooting.py` beside this file (DOP853 at rtol 1e-12, cut at kinks, variational equations, roots), which uses
nothing of isojax.

Sources: Ueda 1979, J. Stat. Phys. 20:181 (the equation); Sprott 2003, Chaos and Time-Series Analysis, app. A
(its exponent); Jordan & Smith 2007, Nonlinear Ordinary Differential Equations (periods of the two wells);
Swift & Wiesenfeld 1984, Phys. Rev. Lett. 52:705 (no doubling before a broken symmetry); Feigenbaum 1978,
J. Stat. Phys. 19:25 (ratio of doublings); Guckenheimer & Holmes 1983, sec. 2.1 (van der Pol, averaged).
"""

import os
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import jax

jax.config.update("jax_enable_x64", True)

import equinox as eqx  # noqa: E402  (float64 first)
import jax.numpy as jnp  # noqa: E402
import numpy as np  # noqa: E402

import isojax as ij  # noqa: E402
from _shooting import Law, bifurcation, flow, largest_exponent, symmetric_orbit  # noqa: E402

ONE = 1.0 / (2.0 * np.pi)
"""Frequency of sin t [Hz]."""

FEIGENBAUM = 4.669201609
"""Limit of the ratio of successive doublings."""

DOUBLINGS = 5
"""Of the cascade, that are followed."""

verdicts: list[bool] = []


def mark(words: str, value: float, limit: float) -> None:
    """Print one figure that must not exceed its mark."""
    verdicts.append(bool(value <= limit))
    print(f"  {'PASS' if verdicts[-1] else 'FAIL'}  {words}: {value:.2e} (mark {limit:.0e})", flush=True)


def same(words: str, ours: object, theirs: object) -> None:
    """Print what must be the same as what is given."""
    verdicts.append(ours == theirs)
    print(f"  {'PASS' if verdicts[-1] else 'FAIL'}  {words}: {ours} (must be {theirs})", flush=True)


def ueda(damping: float) -> ij.Isolator:
    """Give x'' + damping x' + x^3 = B sin t."""
    return ij.Isolator(1.0, (ij.LinearDamping(damping), ij.CubicStiffness(1.0)))


def first(branch: ij.Branch, kind: str, periods: int = 1) -> ij.SpecialPoint:
    """Give the first bifurcation of a kind."""
    return next(p for p in branch.special_points if p.kind == kind and p.periods == periods)


def cascade() -> None:
    print("Ueda's equation x'' + 0.1 x' + x^3 = B sin t: broken symmetry, then doublings")
    model, law = ueda(0.1), Law(k=(0.0, 0.0, 1.0), c=(0.1, 0.0, 0.0))
    steps = ij.Integrator(steps_per_period=512)
    branch = ij.continue_branch(
        model, parameter="amplitude", frequency=ONE, start=0.05, stop=15.0, integrator=steps
    )
    kinds = sorted({point.kind for point in branch.special_points})
    same("what the symmetric branch meets, 0.05 < B < 15", kinds, ["fold", "symmetry_breaking"])
    point = first(branch, "symmetry_breaking")
    found = [(point, 0.5)]
    for number in range(DOUBLINGS):
        # Each doubled orbit leaves the one before by less, and doubles again sooner.
        branch = ij.switch_branch(branch, point, step=0.02 / 2**number, most=150)
        point = first(branch, "period_doubling", 2**number)
        found.append((point, float(point.periods)))
    ours = np.array([float(point.amplitude) for point, _ in found])
    theirs = np.array(
        [
            bifurcation(
                law, ONE, np.asarray(point.y0), float(point.amplitude) * (1.0 + 1e-5 / turns), turns, -1.0
            )
            for point, turns in found
        ]
    )
    print(f"  symmetry breaks at B = {ours[0]:.9f}, SciPy {theirs[0]:.9f}")
    mark("off by", abs(ours[0] / theirs[0] - 1.0), 1e-8)
    for number, (own, other) in enumerate(zip(ours[1:], theirs[1:], strict=True)):
        print(f"  period {2**number} doubles at B = {own:.9f}, SciPy {other:.9f}")
        mark("off by", abs(own / other - 1.0), 1e-8)
    gaps = np.diff(ours[1:])
    ratios = gaps[:-1] / gaps[1:]
    print(
        f"  ratios of successive gaps: {', '.join(f'{r:.4f}' for r in ratios)}; their limit {FEIGENBAUM:.4f}"
    )
    mark("the last, against Feigenbaum's number", abs(ratios[-1] / FEIGENBAUM - 1.0), 1e-2)
    limit = ours[-1] + gaps[-1] / (FEIGENBAUM - 1.0)
    print(f"  the cascade ends at B = {limit:.6f}")
    for share, chaotic in ((0.995, False), (1.005, True)):
        start = np.asarray(found[1][0].y0)
        exponent = ij.largest_lyapunov_exponent(
            model, ij.Harmonic(share * limit, ONE), start=start, settle=400, periods=2000, integrator=steps
        )
        same(
            f"at {share} of it, exponent {float(exponent.value):+.4f} /s, chaotic",
            float(exponent.value) > 0.0,
            chaotic,
        )


def chaos() -> None:
    print("Chaos by the largest Lyapunov exponent")
    exponent = ij.largest_lyapunov_exponent(
        ueda(0.05), ij.Harmonic(7.5, ONE), start=(2.5, 0.0), periods=20000
    )
    value, error = float(exponent.value), float(exponent.standard_error)
    other = largest_exponent(Law(k=(0.0, 0.0, 1.0), c=(0.05, 0.0, 0.0)), 7.5, ONE, np.array([2.5, 0.0]), 1000)
    print(
        f"  Ueda's attractor, damping 0.05, B = 7.5: {value:.4f} +- {error:.4f} /s; "
        f"Sprott 0.1034, SciPy {other:.4f}"
    )
    mark("off Sprott's", abs(value - 0.1034), 3e-3)
    mark("off SciPy's mean over 1000 periods", abs(value - other), 1.2e-2)
    print("  two wells, x'' + 0.3 x' - x + x^3 = g sin(1.2 t)")
    wells = ij.Isolator(1.0, (ij.LinearStiffness(-1.0), ij.CubicStiffness(1.0), ij.LinearDamping(0.3)))
    forces = [0.20, 0.28, 0.29, 0.37, 0.50, 0.65]
    diagram = ij.bifurcation_diagram(
        wells, forces, frequency=1.2 * ONE, direction="anew", starts=(1.0, 0.0), settle=600
    )
    for place, (force, period) in enumerate(zip(forces, (1, 2, 4, 5, "chaos", 2), strict=True)):
        words = "chaos" if bool(diagram.chaotic[place]) else int(diagram.period[place])
        same(f"g = {force:.2f}, exponent {float(diagram.lyapunov[place]):+.3f} /s, period", words, period)


def torus() -> None:
    print("Forced van der Pol, x'' - e (1 - x^2) x' + x = F sin(w t): Neimark-Sacker")
    for strength, omega in ((0.02, 1.03), (0.005, 1.0075), (0.3, 1.25)):
        model = ij.Isolator(
            1.0, (ij.LinearDamping(-strength), ij.PositionDamping(strength), ij.LinearStiffness(1.0))
        )
        law = Law(k=(1.0, 0.0, 0.0), c=(-strength, 0.0, 0.0), position=strength)
        detuned = (1.0 - omega**2) / (strength * omega)
        averaged = 2.0 * strength * omega * np.sqrt(0.5) * np.hypot(0.5, detuned)
        branch = ij.continue_branch(
            model, parameter="amplitude", frequency=omega * ONE, start=0.1 * averaged, stop=2.0 * averaged
        )
        point = first(branch, "neimark_sacker")
        force = float(point.amplitude)
        other = bifurcation(law, omega * ONE, np.asarray(point.y0), 1.001 * force, 1.0, None)
        print(f"  e = {strength}, w = {omega}: F = {force:.9f}, SciPy {other:.9f}, averaged {averaged:.6f}")
        mark("off SciPy", abs(force / other - 1.0), 1e-8)
        mark(
            "pair of multipliers off the unit circle",
            float(jnp.max(jnp.abs(jnp.abs(point.multipliers) - 1.0))),
            1e-8,
        )
        if strength < 0.1:
            # The theory is of first order in e.
            mark("off the averaged equations", abs(force / averaged - 1.0), 0.25 * strength)


def torus_curves() -> None:
    print("Curves of Neimark-Sacker bifurcations of the forced van der Pol oscillator, and their resonances")
    for strength, skew, band, push, step in (
        (0.02, 0.0, (1.002, 1.02), (0.005, 0.06), 0.05),
        (0.3, 0.1, (1.02, 2.4), (0.05, 8.0), 0.02),
    ):
        spring = (ij.LinearDamping(-strength), ij.PositionDamping(strength), ij.LinearStiffness(1.0))
        model = ij.Isolator(1.0, (*spring, ij.QuadraticStiffness(skew)) if skew else spring)
        law = Law(k=(1.0, 0.0, 0.0), c=(-strength, 0.0, 0.0), position=strength, even=skew)
        curve = ij.neimark_sacker_curve(
            model, amplitude_range=push, frequency_range=(band[0] * ONE, band[1] * ONE), step=step
        )
        omega, force = np.asarray(curve.frequency) / ONE, np.asarray(curve.amplitude)
        print(
            f"  e = {strength}, {skew} x^2: {force.size} points, w = {omega.min():.5f} to {omega.max():.5f}, "
            f"rotation number {float(curve.rotation_number.min()):.4f} to "
            f"{float(curve.rotation_number.max()):.4f}"
        )
        same("followed to its ends", bool(ij.is_successful(curve.result)), True)
        off = 0.0
        for place in range(0, force.size, 8):
            y0 = np.asarray(curve.y0[place])
            end, matrix, _ = flow(law, float(force[place]), float(curve.frequency[place]), y0, 1.0)
            angle = abs(np.angle(np.linalg.eigvals(matrix)[0]))
            gaps = [np.abs(end - y0).max(), abs(np.linalg.det(matrix) - 1.0)]
            off = max(off, *gaps, abs(angle - float(curve.angle[place])))
        mark("every eighth point: orbit, det M = 1 and angle, off SciPy", off, 1e-7)
        if not skew:
            detuned = (1.0 - omega**2) / (strength * omega)
            averaged = 2.0 * strength * omega * np.sqrt(0.5) * np.hypot(0.5, detuned)
            worst = float(np.max(np.abs(force / averaged - 1.0)))
            mark("curve off the averaged equations", worst, 0.25 * strength)
        for point in curve.special_points:
            turns = 0.5 if curve.symmetric else 1.0
            y0, push_there = np.asarray(point.y0), float(point.amplitude)
            _, matrix, _ = flow(law, push_there, float(point.frequency), y0, turns)
            matrix = -matrix if curve.symmetric else matrix
            cosine = {"1_1": 1.0, "1_2": -1.0, "1_3": -0.5, "1_4": 0.0}[point.kind[-3:]]
            gap = max(abs(np.linalg.det(matrix) - 1.0), abs(0.5 * np.trace(matrix) - cosine))
            words = f"{point.kind} at w = {float(point.frequency) / ONE:.7f}, F = {push_there:.7f}: off SciPy"
            mark(words, float(gap), 1e-7)
            if not skew:
                mean = strength * float(point.frequency) / ONE
                mark("its force off e w (averaged)", abs(push_there / mean - 1.0), strength)


PAPER = {"k": (1.0805e6, -6.974e8, 2.51667e11), "c": (1.027e4, -3.6880e5, 5.3753e6), "mass": 800.0}
"""The y model, eqs. (13) and (18) of the paper, typed in anew."""

DRIVE = ("drive.amplitude", "drive.frequency")

NAMES = (
    "linear_stiffness.coefficient",
    "abs_quadratic_stiffness.coefficient",
    "cubic_stiffness.coefficient",
    "linear_damping.coefficient",
    "abs_quadratic_damping.coefficient",
    "cubic_damping.coefficient",
    "mass",
    *DRIVE,
)
"""Parameters, in the order of `PAPER`, then the drive."""


def differences(function: Callable[[np.ndarray], np.ndarray], at: np.ndarray, share: float) -> np.ndarray:
    """Give central differences of fourth order by each parameter, one step a share of it."""
    rows = []
    for place, value in enumerate(at):

        def moved(steps: int, place: int = place) -> np.ndarray:
            there = at.copy()
            there[place] *= 1.0 + steps * share
            return function(there)

        rows.append((8.0 * (moved(1) - moved(-1)) - (moved(2) - moved(-2))) / (12.0 * share * value))
    return np.array(rows)


def law_of(at: np.ndarray) -> Law:
    """Give the reference's law."""
    return Law(k=tuple(at[:3]), c=tuple(at[3:6]), mass=at[6])


def with_values(at: np.ndarray) -> ij.Isolator:
    """Give our model."""
    given = {name.replace(".", "__"): value for name, value in zip(NAMES[:7], at[:7], strict=True)}
    return ij.paper.y_direction().replace(**given)


def beside(
    quantity: str, exact: np.ndarray, own: np.ndarray, other: np.ndarray, names: tuple[str, ...]
) -> None:
    """Print the derivatives of a quantity by all parameters, and mark the worst."""
    print(f"  {quantity}: by, exact, off own differences, off SciPy's differences")
    for row in zip(names, exact, np.abs(own / exact - 1.0), np.abs(other / exact - 1.0), strict=True):
        print("    {:<36} {:+.9e}  {:.1e}  {:.1e}".format(*row))
    mark(
        f"{quantity}, worst of {len(names)} off own central differences",
        float(np.max(np.abs(own / exact - 1))),
        1e-6,
    )
    mark(f"{quantity}, worst off SciPy's central differences", float(np.max(np.abs(other / exact - 1))), 1e-4)


def orbit_slopes() -> None:
    @eqx.filter_jit
    def found(model: ij.Isolator, force: jax.Array, frequency: jax.Array, start: jax.Array) -> jax.Array:
        orbit = ij.find_periodic_orbit(model, ij.Harmonic(force, frequency), start=start, symmetric=True)
        return jnp.stack([orbit.floquet.spectral_radius, orbit.amplitude])

    for force in (150.0, 160.0):
        orbit = ij.find_periodic_orbit(ij.paper.y_direction(), ij.Harmonic(force, 4.3))
        print(
            f"The y model at {force:.0f} N, 4.3 Hz: "
            f"multipliers {np.asarray(orbit.floquet.multipliers).round(4)}"
        )
        at = np.array([*PAPER["k"], *PAPER["c"], PAPER["mass"], force, 4.3])
        start = np.asarray(orbit.y0)
        exact = ij.sensitivity(orbit, parameters=NAMES).derivatives

        def ours(at: np.ndarray, start: np.ndarray = start) -> np.ndarray:
            return np.asarray(found(with_values(at), at[7], at[8], jnp.asarray(start)))

        def theirs(at: np.ndarray, start: np.ndarray = start) -> np.ndarray:
            return np.array(symmetric_orbit(law_of(at), at[7], at[8], start))

        own, other = differences(ours, at, 1e-4), differences(theirs, at, 1e-4)
        for place, quantity in enumerate(("spectral_radius", "amplitude")):
            beside(quantity, np.asarray(exact[quantity]), own[:, place], other[:, place], NAMES)


def fold_slopes() -> None:
    print("The upper fold of the y model at 4.3 Hz")

    def fold(at: np.ndarray) -> ij.SpecialPoint:
        branch = ij.continue_branch(
            with_values(at), parameter="amplitude", frequency=at[7], start=120.0, stop=200.0
        )
        return first(branch, "fold")

    names = (*NAMES[:7], DRIVE[1])
    at = np.array([*PAPER["k"], *PAPER["c"], PAPER["mass"], 4.3])
    point = fold(at)
    start, force = np.asarray(point.y0), float(point.amplitude)

    def theirs(at: np.ndarray) -> np.ndarray:
        return np.array(bifurcation(law_of(at), at[7], start, force, 0.5, 1.0))

    reference = float(theirs(at))
    print(f"  {force:.8f} N, SciPy {reference:.8f} N")
    mark("off by [N]", abs(force - reference), 1e-6)
    exact = np.asarray(ij.sensitivity(point, parameters=names).derivatives["value"])
    own = differences(lambda at: np.asarray(fold(at).amplitude), at, 5e-4)
    beside("fold force", exact, own, differences(theirs, at, 5e-4), names)


SPREAD = """
import sys
import jax
jax.config.update("jax_enable_x64", True)
if len(sys.argv) > 2:
    jax.distributed.initialize(sys.argv[2], num_processes=2, process_id=int(sys.argv[3]))
import numpy as np
from isojax import paper, stability_map
forces, band = np.linspace(20.0, 220.0, 300), np.linspace(4.0, 8.0, 9)
smap = stability_map(paper.y_direction(), forces, band, chunk=1024, coexisting=True)
names = ("spectral_radius", "multipliers", "start", "response", "count")
np.savez(sys.argv[1], **{name: np.asarray(getattr(smap, name)) for name in names})
print(len(jax.local_devices()), jax.process_count())
"""
"""A map with all its orbits, written to the file named first; address and number of a process may follow."""


def started(arguments: list[str], flags: str = "") -> subprocess.Popen[str]:
    """Start the map in an interpreter of its own."""
    environment = {**os.environ, "JAX_PLATFORMS": "cpu", "XLA_FLAGS": flags}
    command = [sys.executable, "-c", SPREAD, *arguments]
    return subprocess.Popen(
        command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def ended(process: subprocess.Popen[str], words: str, wanted: str) -> None:
    """Wait for it, and see that it ran on what it should."""
    out, err = process.communicate(timeout=600)
    if process.returncode:
        raise RuntimeError(err)
    # The transport between processes prints lines of its own before.
    same(f"{words}: devices of the process, processes", out.splitlines()[-1], wanted)


def off(file: Path, alone: Path) -> float:
    """Give the largest difference of all arrays of two maps."""
    with np.load(file) as ours, np.load(alone) as theirs:
        worst = 0.0
        for name in theirs.files:
            if not np.array_equal(np.isnan(ours[name]), np.isnan(theirs[name])):
                return np.inf
            worst = max(worst, float(np.nanmax(np.abs(ours[name] - theirs[name]))))
    return worst


def spread() -> None:
    print("A map of 300 x 9 cells with all its orbits, alone, over two devices and over two processes")
    with tempfile.TemporaryDirectory() as name, socket.socket() as free:
        folder = Path(name)
        files = [folder / f"{word}.npz" for word in ("alone", "devices", "first", "second")]
        ended(started([str(files[0])]), "alone", "1 1")
        ended(started([str(files[1])], "--xla_force_host_platform_device_count=2"), "two devices", "2 1")
        free.bind(("127.0.0.1", 0))
        address = f"127.0.0.1:{free.getsockname()[1]}"
        free.close()
        processes = [started([str(files[2 + own]), address, str(own)]) for own in range(2)]
        for own, process in enumerate(processes):
            ended(process, f"process {own} of two", "1 2")
        with np.load(files[0]) as alone:
            several = int(np.sum(alone["count"] == 3))
        print(f"  {several} cells with three orbits")
        for words, file in zip(
            ("two devices", "process 0 of two", "process 1 of two"), files[1:], strict=True
        ):
            mark(f"{words}, largest difference from one device", off(file, files[0]), 1e-12)


def main() -> None:
    begun = time.perf_counter()
    for part in (cascade, chaos, torus, torus_curves, orbit_slopes, fold_slopes, spread):
        part()
    missed = verdicts.count(False)
    print(f"{len(verdicts) - missed} of {len(verdicts)} marks met in {time.perf_counter() - begun:.0f} s")
    sys.exit(1 if missed else 0)


if __name__ == "__main__":
    main()
