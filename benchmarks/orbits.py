"""Periodic orbits and Floquet multipliers against closed forms, published charts and SciPy.

Run: python benchmarks/orbits.py

Prints each comparison with PASS or FAIL against its mark; ends with code 1 if any fails. The SciPy reference
(tests/stability/scipy_orbits.py: DOP853 at rtol 1e-12 between kinks, variational equations, Newton) shares no
code with isojax.
"""

import sys
import time
from pathlib import Path
from typing import ClassVar

import jax

jax.config.update("jax_enable_x64", True)

import equinox as eqx  # noqa: E402  (float64 first)
import jax.numpy as jnp  # noqa: E402
import numpy as np  # noqa: E402
import scipy.special  # noqa: E402

import isojax as ij  # noqa: E402
from isojax._parameters import parameter  # noqa: E402

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "stability"))
from scipy_orbits import EQ_36, Y_DIRECTION, Z_DIRECTION, flow, polynomial, shoot  # noqa: E402  (path first)

POINTS = 100
"""Random points of the paper's models that are compared with SciPy."""

verdicts: list[bool] = []


def mark(words: str, value: float, limit: float) -> None:
    """Print one comparison."""
    verdicts.append(bool(value <= limit))
    print(f"  {'PASS' if verdicts[-1] else 'FAIL'}  {words}: {value:.2e} (mark {limit:.0e})", flush=True)


class MathieuPair(ij.AbstractElement):
    """Two internal states that obey p'' + (rate + depth x) p = 0, and push nothing.

    With a linear isolator whose x is a sine, this is Mathieu's equation exactly.

    Attributes:
        rate: [1/s^2].
        depth: [1/(m s^2)].

    Source: McLachlan 1947, Theory and Application of Mathieu Functions, ch. 2.
    """

    name: ClassVar[str] = "mathieu_pair"
    words: ClassVar[str] = "parametrically excited pair"
    strength: ClassVar[str] = "depth"
    internal_states: ClassVar[int] = 2

    rate: jax.Array = parameter(symbol="alpha", unit="1/s^2")
    depth: jax.Array = parameter(symbol="beta", unit="1/(m s^2)")

    @classmethod
    def guess(cls, scales):
        return cls(1.0, 0.0)

    @classmethod
    def typical_strength(cls, scales):
        return 1.0

    def state_rate(self, x, v, s):
        return s[1], -(self.rate + self.depth * x) * s[0]


def matched(ours: np.ndarray, theirs: np.ndarray) -> float:
    """Largest distance of two sets of two multipliers, paired the better way round."""
    straight, crossed = np.abs(ours - theirs).max(), np.abs(ours - theirs[::-1]).max()
    return float(min(straight, crossed))


def linear_isolator() -> None:
    print("Linear isolator: multipliers against exp(lambda T)")
    mass = 800.0

    @jax.jit
    @jax.vmap
    def found(stiffness, damping, frequency):
        model = ij.Isolator(mass, (ij.LinearStiffness(stiffness), ij.LinearDamping(damping)))
        orbit = ij.find_periodic_orbit(model, ij.Harmonic(100.0, frequency))
        receptance = 1.0 / (
            stiffness - mass * (2 * jnp.pi * frequency) ** 2 + 2j * jnp.pi * frequency * damping
        )
        return orbit.floquet.multipliers, orbit.amplitude / (100.0 * jnp.abs(receptance)) - 1.0

    random = np.random.default_rng(3)
    stiffness, frequency = random.uniform(1e5, 2e6, 24), random.uniform(1.0, 8.0, 24)
    damping = 2.0 * np.sqrt(mass * stiffness) * np.r_[random.uniform(-0.01, 0.3, 20), 1.2, 2.0, 0.0, 0.99]
    multipliers, excess = found(*map(jnp.asarray, (stiffness, damping, frequency)))
    half, root = -damping / (2 * mass), np.sqrt((damping / (2 * mass)) ** 2 - stiffness / mass + 0j)
    exact = np.exp(np.stack([half + root, half - root], axis=-1) / frequency[:, None])
    worst = max(matched(a, b) for a, b in zip(np.asarray(multipliers), exact, strict=True))
    mark("24 isolators, under-, overdamped and unstable, largest error of a multiplier", worst, 1e-10)
    mark(
        "their amplitude, relative, read off 128 samples by a parabola", float(jnp.max(jnp.abs(excess))), 1e-4
    )


def mathieu() -> None:
    print("Mathieu's equation y'' + (a - 2 q cos 2 tau) y = 0 against the stability chart")
    mass, stiffness, damping, frequency, push = 1.0, 400.0, 2.0, 2.0, 1.0
    omega = 2 * np.pi * frequency
    size = push / abs(stiffness - mass * omega**2 + 1j * omega * damping)

    @jax.jit
    @jax.vmap
    def block(a, q):
        pair = MathieuPair((omega / 2) ** 2 * a, (omega / 2) ** 2 * 2.0 * q / size)
        model = ij.Isolator(mass, (ij.LinearStiffness(stiffness), ij.LinearDamping(damping), pair))
        orbit = ij.find_periodic_orbit(model, ij.Harmonic(push, frequency))
        return orbit.floquet.monodromy[2:, 2:], orbit.floquet.spectral_radius

    # One turn of the drive is a turn of pi in tau: even characteristic values have trace +2, odd ones -2.
    edges = [(scipy.special.mathieu_a(n, q), q, 2.0 * (-1.0) ** n) for n in range(4) for q in (0.5, 2.0, 5.0)]
    edges += [
        (scipy.special.mathieu_b(n, q), q, 2.0 * (-1.0) ** n) for n in range(1, 5) for q in (0.5, 2.0, 5.0)
    ]
    # Abramowitz & Stegun 1964, table 20.1, q = 5: a0, a1, a2 and b1, b2.
    table = [
        (-5.80004602, 2.0),
        (1.85818754, -2.0),
        (7.44910974, 2.0),
        (-5.79008060, -2.0),
        (2.09946045, 2.0),
    ]
    edges += [(a, 5.0, sign) for a, sign in table]
    random = np.random.default_rng(4)
    inside = np.stack([random.uniform(-2.0, 12.0, 60), random.uniform(0.0, 5.0, 60)])
    a, q = np.r_[[e[0] for e in edges], inside[0]], np.r_[[e[1] for e in edges], inside[1]]
    matrices, radius = (np.asarray(value) for value in block(jnp.asarray(a), jnp.asarray(q)))
    traces = np.trace(matrices, axis1=1, axis2=2)
    count = len(edges) - len(table)
    off = np.abs(traces[: len(edges)] - [e[2] for e in edges])
    mark(f"{count} edges of the chart, |trace| = 2", float(off[:count].max()), 1e-8)
    mark("5 characteristic values as printed to 8 decimals, |trace| = 2", float(off[count:].max()), 1e-6)
    mark("determinant one everywhere", float(np.abs(np.linalg.det(matrices) - 1.0).max()), 1e-8)

    def in_a_tongue(a: float, q: float) -> bool:
        if a < scipy.special.mathieu_a(0, q):
            return True
        return any(scipy.special.mathieu_b(n, q) < a < scipy.special.mathieu_a(n, q) for n in range(1, 6))

    chart = np.array([in_a_tongue(*point) for point in inside.T])
    wrong = np.sum(chart != (radius[len(edges) :] > 1.0 + 1e-7))
    mark(
        f"of 60 random points ({chart.sum()} unstable by the chart) those judged otherwise", float(wrong), 0.0
    )


@eqx.filter_jit
def batch(models, amplitudes, frequencies, starts):
    """Orbits of many models at once, from given starts."""

    def one(model, amplitude, frequency, start):
        orbit = ij.find_periodic_orbit(model, ij.Harmonic(amplitude, frequency), start=start)
        return orbit.y0, orbit.floquet.multipliers, orbit.floquet.monodromy, orbit.error

    return jax.vmap(one)(models, amplitudes, frequencies, starts)


@eqx.filter_jit
def balanced(models, amplitudes, frequencies):
    """Starts by harmonic balance."""
    return jax.vmap(lambda m, a, f: ij.harmonic_balance(m, ij.Harmonic(a, f)).y0)(
        models, amplitudes, frequencies
    )


def stacked(models: list) -> ij.Isolator:
    return jax.tree.map(lambda *leaves: jnp.stack(leaves), *models)


def papers_models() -> None:
    print(f"The paper's models at {POINTS} random points against SciPy")
    y, z = ij.paper.y_direction(), ij.paper.z_direction()
    eq36 = y.replace(abs_quadratic_damping__coefficient=-3.6880e3, cubic_damping__coefficient=0.0)
    laws = {"y": polynomial(**Y_DIRECTION), "z": polynomial(**Z_DIRECTION), "eq36": polynomial(**EQ_36)}
    random = np.random.default_rng(5)
    lens = ij.stability_map(
        y, [146.0, 148.0, 150.0, 173.0, 175.0, 177.0, 191.5, 192.5, 193.5], [4.1, 4.2, 4.4], coexisting=True
    )
    several = np.argwhere(np.asarray(lens.count) == 3)
    print(f"  {len(several)} cells of a coarse map lie inside the lens of folds, three orbits each")
    names, models, force, frequency, starts = [], [], [], [], []
    for row, column in several:
        for orbit in range(3):
            names.append("y")
            models.append(y)
            force.append(float(lens.amplitudes[row]))
            frequency.append(float(lens.frequencies[column]))
            starts.append(np.asarray(lens.y0[orbit, row, column]))
    rest = POINTS - len(names)
    for place in range(rest):
        name, model = (("y", y), ("z", z), ("eq36", eq36))[place % 3]
        names.append(name)
        models.append(model)
        force.append(random.uniform(1.0, 450.0))
        frequency.append(random.uniform(1.0, 8.0))
    some = (stacked(models[-rest:]), jnp.asarray(force[-rest:]), jnp.asarray(frequency[-rest:]))
    starts.extend(np.asarray(balanced(*some)))
    begun = time.perf_counter()
    found = batch(stacked(models), jnp.asarray(force), jnp.asarray(frequency), jnp.asarray(np.array(starts)))
    y0, multipliers, monodromy, error = (np.asarray(value) for value in found)
    print(f"  isojax: {time.perf_counter() - begun:.1f} s with compilation")
    begun = time.perf_counter()
    worst = {"orbit": 0.0, "multiplier": 0.0, "coefficient": 0.0}
    close, unstable = 0, 0
    for place, name in enumerate(names):
        reference = shoot(laws[name], force[place], frequency[place], y0[place])
        omega = 2 * np.pi * frequency[place]
        swing = np.hypot(reference.y0[0], reference.y0[1] / omega) * np.array([1.0, omega])
        worst["orbit"] = max(worst["orbit"], float(np.max(np.abs(y0[place] - reference.y0) / swing)))
        sums = [np.trace(monodromy[place]) - np.trace(reference.monodromy)]
        sums += [np.linalg.det(monodromy[place]) - np.linalg.det(reference.monodromy)]
        worst["coefficient"] = max(worst["coefficient"], float(np.max(np.abs(sums))))
        unstable += reference.spectral_radius > 1.0
        if abs(reference.multipliers[0] - reference.multipliers[1]) < 1e-3:
            close += 1
        else:
            off = matched(multipliers[place], reference.multipliers)
            worst["multiplier"] = max(worst["multiplier"], off)
    print(f"  SciPy: {time.perf_counter() - begun:.1f} s; {unstable} of the orbits are unstable")
    mark("state at t = 0, over the size of the motion", worst["orbit"], 1e-7)
    mark(
        f"multipliers of the {POINTS - close} orbits where they differ by more than 1e-3",
        worst["multiplier"],
        1e-7,
    )
    mark(f"trace and determinant of the monodromy, all {POINTS}", worst["coefficient"], 1e-7)
    mark("isojax's own estimate of its error", float(error.max()), 1e-9)


def several_harmonics() -> None:
    print("The y model under a sine with a second and a third harmonic, delayed, against SciPy")
    added, delay = ((0.1, 0.7, 2), (0.3, -0.5, 3)), 2e-3
    parts = [ij.elements.DriveHarmonics(*one) for one in added]
    model = ij.paper.y_direction().with_elements(*parts, ij.elements.InputDelay(delay))
    law = polynomial(**Y_DIRECTION, delay=delay, harmonics=added)
    random, count = np.random.default_rng(8), 24
    force, frequency = random.uniform(1.0, 300.0, count), random.uniform(1.5, 8.0, count)
    state, coefficient, apart, lost = 0.0, 0.0, 0.0, 0
    for push, rate in zip(force, frequency, strict=True):
        ours = ij.find_periodic_orbit(model, ij.Harmonic(push, rate))
        if not ij.is_successful(ours.result):
            lost += 1
            continue
        theirs = shoot(law, push, rate, np.asarray(ours.y0))
        size = np.hypot(theirs.y0[0], theirs.y0[1] / (2 * np.pi * rate)) * np.array([1.0, 2 * np.pi * rate])
        state = max(state, float(np.max(np.abs(ours.y0 - theirs.y0) / size)))
        matrix = np.asarray(ours.floquet.monodromy)
        sums = np.trace(matrix - theirs.monodromy), np.linalg.det(matrix) - np.linalg.det(theirs.monodromy)
        coefficient = max(coefficient, float(np.max(np.abs(sums))))
        if abs(theirs.multipliers[0] - theirs.multipliers[1]) > 1e-3:
            apart = max(apart, matched(np.asarray(ours.floquet.multipliers), theirs.multipliers))
    mark(f"of {count} orbits those not found", float(lost), 0.0)
    mark("state at t = 0, over the size of the motion", state, 1e-7)
    mark("multipliers where they differ by more than 1e-3", apart, 1e-7)
    mark("trace and determinant of the monodromy", coefficient, 1e-7)
    folds = ij.frequency_response(model, 175.0, (4.0, 6.5), periods=()).special_points
    off = []
    for point in folds:
        rate = float(point.frequency)
        end, matrix, _ = flow(law, 175.0, rate, np.asarray(point.y0), 1.0 / rate)
        off.append(np.max(np.abs((end - point.y0) / np.max(np.abs(point.y0)))))
        off.append(np.min(np.abs(np.linalg.eigvals(matrix) - 1.0)))
    print(f"  folds of the response at 175 N: {', '.join(f'{float(one.frequency):.4f} Hz' for one in folds)}")
    verdicts.append([one.kind for one in folds] == ["fold", "fold"])
    mark("there SciPy's motion closes, with a multiplier of one", float(max(off, default=np.nan)), 1e-6)
    smap = ij.stability_map(model, np.linspace(20.0, 300.0, 15), np.linspace(1.5, 7.0, 23), coexisting=True)
    found = np.argwhere(np.isfinite(np.asarray(smap.spectral_radius)))
    starts, worst = np.asarray(smap.y0), 0.0
    chosen = found[random.permutation(len(found))[:count]]
    for orbit, row, column in chosen:
        start, drive = starts[orbit, row, column], (smap.amplitudes[row], smap.frequencies[column])
        reference = shoot(law, float(drive[0]), float(drive[1]), start)
        wide = abs(reference.multipliers[0] - reference.multipliers[1]) / 0.1
        off = matched(np.asarray(smap.multipliers)[orbit, row, column], reference.multipliers)
        worst = max(worst, off * min(1.0, max(wide, off / 0.1)))
    empty = float(np.sum(np.asarray(smap.count) == 0))
    mark(
        f"multipliers of {count} cells of a map, from 1.5 Hz, where the third harmonic is at resonance",
        worst,
        5e-5,
    )
    mark("its cells without an orbit", empty, 0.0)


def van_der_pol() -> None:
    print("Forced van der Pol, x'' - e (1 - x^2) x' + x = F sin(w t), e = 0.3, w = 1.25: Neimark-Sacker")
    strength, frequency = 0.3, 1.25 / (2 * np.pi)
    model = ij.Isolator(
        1.0, (ij.LinearStiffness(1.0), ij.LinearDamping(-strength), ij.PositionDamping(strength))
    )
    law = polynomial(k=(1.0, 0.0, 0.0), c=(-strength, 0.0, 0.0), position=strength, mass=1.0)

    @jax.jit
    def found(force):
        orbit = ij.find_periodic_orbit(model, ij.Harmonic(force, frequency))
        mean = jnp.mean(orbit.displacement[:-1] ** 2)
        return orbit.y0, orbit.floquet.multipliers, orbit.floquet.spectral_radius, mean

    low, high = 0.2, 3.0
    for _ in range(45):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if float(found(middle)[2]) > 1.0 else (low, middle)
    y0, multipliers, radius, mean = found(high)
    print(
        f"  the torus is left at F = {high:.9f}, multipliers {np.asarray(multipliers)[0]:.6f} and conjugate"
    )
    mark("there the mean of x^2 over a period is one (Liouville)", abs(float(mean) - 1.0), 1e-6)
    worst = 0.0
    for share in (0.6, 0.99, 1.0 - 1e-6, 1.0 + 1e-6, 1.01):
        y0, multipliers, radius, _ = found(share * high)
        reference = shoot(law, share * high, frequency, np.asarray(y0))
        worst = max(worst, matched(np.asarray(multipliers), reference.multipliers))
        worst = max(worst, float(np.max(np.abs(y0 - reference.y0))))
        verdicts.append((float(radius) > 1.0) == (share < 1.0) == (reference.spectral_radius > 1.0))
    mark("orbits and multipliers at 0.6, 0.99, 1 -+ 1e-6, 1.01 of this force, against SciPy", worst, 1e-7)


def papers_map() -> None:
    print("Map of the y model, 1000 x 500, 1-120 N x 4-8 Hz, one orbit a cell")
    y = ij.paper.y_direction()
    begun = time.perf_counter()
    smap = ij.stability_map(y, np.linspace(1.0, 120.0, 1000), np.linspace(4.0, 8.0, 500))
    seconds = time.perf_counter() - begun
    print(f"  {seconds:.1f} s with compilation; orbits in {int(smap.count.sum())} of 500000 cells")
    random = np.random.default_rng(6)
    rows, columns = random.integers(0, 1000, POINTS), random.integers(0, 500, POINTS)
    force, frequency = smap.amplitudes[rows], smap.frequencies[columns]
    starts = smap.y0[rows, columns]
    y0, multipliers, _, _ = batch(stacked([y] * POINTS), force, frequency, starts)
    apart = np.abs(np.asarray(multipliers[:, 0] - multipliers[:, 1]))
    ours = zip(np.asarray(smap.multipliers)[rows, columns], np.asarray(multipliers), strict=True)
    off = np.array([matched(*pair) for pair in ours])
    wide = apart > 0.1
    scale = np.max(np.abs(y0), axis=0)
    mark("its own reported error", float(smap.error), 5e-5)
    mark(
        f"multipliers against single orbits, {wide.sum()} of {POINTS} random cells",
        float(off[wide].max()),
        5e-5,
    )
    if not wide.all():
        # Where two multipliers nearly coincide they part like the root of any error; their product does not.
        weighed = (off * np.maximum(apart, off) / 0.1)[~wide]
        mark(
            f"the other {(~wide).sum()}, by the characteristic polynomial over 0.1",
            float(weighed.max()),
            5e-5,
        )
    mark("state at t = 0, over the largest", float(np.max(np.abs(starts - y0) / scale)), 5e-5)


def main() -> None:
    begun = time.perf_counter()
    linear_isolator()
    mathieu()
    van_der_pol()
    papers_models()
    several_harmonics()
    papers_map()
    failed = verdicts.count(False)
    print(f"{len(verdicts) - failed} of {len(verdicts)} marks met in {time.perf_counter() - begun:.0f} s")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
