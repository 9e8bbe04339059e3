"""Put the paper's two models through the paper's own test, and identify them by its route and by others.

Run `python benchmarks/paper_plan.py [--direction y|z|both] [--repeats 3] [--quick]`. The first run
simulates the tests (a few minutes, both directions side by side) and keeps them in benchmarks/out/; later
runs take some two minutes.

Test: dwells of 20 cycles every 0.1 Hz, 4-7 Hz in y and 1.5-4 Hz in z, forward and backward, five force
levels, three repeats, 1 kHz; a shaker with distortion and a drop-out of force, noise of 0.01 m/s^2 on the
acceleration and 0.02 N on the force, and a linear stiffness that scatters by 0.05 % from record to
record. The paper does not print its levels: here they reach about 1 mm in y, where the sweeps jump, and
10 mm in z.

Printed for each direction:

1. the six coefficients: truth; the paper's route (peak and half power) from forward sweeps, backward
   sweeps, averaged; its variants with phase resonance and with the Nyquist circle; the harmonic balance
   of all dwells at once; the fit to the time histories with its standard errors;
2. what each step of the paper's route does to the truth, from the harmonic balance of the known model,
   without noise, distortion or transients: peak for phase resonance, half power for the damping, lines
   0.1 Hz apart, forward and backward sweeps and their average, and how a quadratic through the levels
   magnifies what scatter there is;
3. equivalent stiffness and damping level by level: exact, by the peak, by half power.

Source: the paper, eqs. (7)-(18), (20)-(28).
"""

import argparse
import dataclasses
import textwrap
import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Literal

import jax
import numpy as np

OUT = Path(__file__).resolve().parent / "out"
NAMES = ("k1", "k2", "k3", "c1", "c2", "c3")
MASS = 800.0
FACTORS = np.array([1.0, 8.0 / (3.0 * np.pi), 0.75])
"""Weights of the harmonic balance: K_eq = k1 + (8/3pi) k2 X + (3/4) k3 X^2."""


@dataclasses.dataclass(frozen=True)
class Case:
    """One direction of the paper."""

    direction: Literal["y", "z"]
    truth: tuple[float, ...]
    levels: tuple[float, ...]
    lines: np.ndarray


CASES = {
    "y": Case(
        "y",
        (1.0805e6, -6.974e8, 2.51667e11, 1.027e4, -3.6880e5, 5.3753e6),
        (40.0, 80.0, 120.0, 160.0, 200.0),
        np.arange(40, 71) / 10,
    ),
    "z": Case(
        "z",
        (1.414e5, -4.126e5, -4.289e6, 2638.0, -1393.0, 745.533),
        (60.0, 120.0, 180.0, 240.0, 300.0),
        np.arange(15, 41) / 10,
    ),
}


def folder_of(direction: str, repeats: int) -> Path:
    """Give the folder of the simulated test of one direction."""
    return OUT / f"paper_{direction}_{repeats}"


def write_test(direction: str, repeats: int) -> Path:
    """Give campaign.toml of one direction, simulated on the first call."""
    from isojax import rig

    folder = folder_of(direction, repeats)
    if not (folder / "campaign.toml").exists():
        case = CASES[direction]
        plan = rig.paper_plan(case.direction, case.levels, repeats)
        plant = {"y": rig.y_plant, "z": rig.z_plant}[direction]()
        rig.write_campaign(folder, plant, plan, 7, f"the paper's test, {direction}", rig.Bench(noise=0.01))
    return folder / "campaign.toml"


# --- the known model in harmonic balance ---


def equivalent(case: Case, amplitude, angular):
    """Give K_eq and C_eq of the known model at a displacement amplitude and angular frequency."""
    k, c = np.array(case.truth[:3]) * FACTORS, np.array(case.truth[3:]) * FACTORS
    speed = amplitude * angular
    return k[0] + k[1] * amplitude + k[2] * amplitude**2, c[0] + c[1] * speed + c[2] * speed**2


def find_amplitudes(case: Case, level: float, frequency: float) -> np.ndarray:
    """Give every amplitude that balances the first harmonic, ascending."""
    angular = 2 * np.pi * frequency
    k, c = np.array(case.truth[:3]) * FACTORS, np.array(case.truth[3:]) * FACTORS
    # ((K_eq - m w^2) X)^2 + (C_eq w X)^2 = F^2 is a polynomial in X, scaled to roots of order one.
    unit = level / (k[0] + c[0] * angular)
    reach = unit ** np.arange(1, 4)
    spring = np.append(0.0, (k - [MASS * angular**2, 0.0, 0.0]) * reach)
    damper = np.append(0.0, c * angular ** np.arange(1, 4) * reach)
    poly = np.polynomial.polynomial
    balance = poly.polyadd(poly.polymul(spring, spring), poly.polymul(damper, damper))
    balance[0] -= level**2
    roots = poly.polyroots(balance)
    real = roots[(np.abs(roots.imag) < 1e-9 * np.abs(roots)) & (roots.real > 0)].real
    return np.sort(real) * unit


def shaker_force(level: float, frequency, drops: bool):
    """Give the force amplitude that the shaker of the simulated bench makes of a level."""
    return level * (1.0 - 0.12 * np.exp(-(((frequency - 5.2) / 0.5) ** 2)) * drops)


def sweep(
    case: Case, level: float, lines: np.ndarray, direction: str, drops: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Follow the branch along a sweep: receptance at ascending lines, and the gaps across which it jumped."""
    order = range(lines.size) if direction == "forward" else range(lines.size - 1, -1, -1)
    receptance, jumped = np.zeros(lines.size, dtype=complex), np.zeros(lines.size - 1, dtype=bool)
    before, previous, place = None, None, None
    for here in order:
        found = find_amplitudes(case, shaker_force(level, lines[here], drops), lines[here])[[0, -1]]
        if before is None:
            # From rest a record settles on the lower branch; beyond the folds there is one only.
            amplitude = found[0]
        else:
            guess = before if previous is None else 2 * before - previous
            amplitude = found[np.argmin(np.abs(np.log(found / max(guess, 1e-9 + 0.5 * before))))]
            assert place is not None
            jumped[min(here, place)] = abs(np.log(amplitude / before)) > 0.25
        spring, damper = equivalent(case, amplitude, 2 * np.pi * lines[here])
        angular = 2 * np.pi * lines[here]
        receptance[here] = 1.0 / (spring - MASS * angular**2 + 1j * damper * angular)
        previous, before, place = before, amplitude, here
    return receptance, jumped


def classical_points(
    case: Case, level: float, lines: np.ndarray, direction: str, drops: bool
) -> dict[str, float]:
    """Give what peak and half power say of one level, and the exact values at the same amplitude."""
    from isojax.identification import find_half_power

    receptance, jumped = sweep(case, level, lines, direction, drops)
    found = find_half_power(lines, receptance, jumped)
    angular = 2 * np.pi * found.peak_frequency
    amplitude = shaker_force(level, found.peak_frequency, drops) * found.peak
    exact = equivalent(case, amplitude, angular)
    return {
        "peak": found.peak_frequency if found.peak_inside else np.nan,
        "amplitude": amplitude,
        "speed": amplitude * angular,
        "stiffness": MASS * angular**2 if found.peak_inside else np.nan,
        "damping": 2.0 * found.damping_ratio * angular * MASS if found.peak_inside else np.nan,
        "exact stiffness": exact[0],
        "exact damping": exact[1],
    }


def law_of(size: np.ndarray, value: np.ndarray) -> np.ndarray:
    """Fit a quadratic through equivalent coefficients and invert it to a force law."""
    known = np.isfinite(value)
    if np.count_nonzero(known) < 3:
        return np.full(3, np.nan)
    scale = np.max(size[known])
    fitted = np.polynomial.polynomial.polyfit(size[known] / scale, value[known], 2)
    return fitted / scale ** np.arange(3) / FACTORS


def laws(points: list[dict[str, float]], stiffness: str, damping: str) -> np.ndarray:
    """Give the six coefficients that follow from the points of all levels."""
    column = {name: np.array([point[name] for point in points]) for name in points[0]}
    return np.concatenate(
        [law_of(column["amplitude"], column[stiffness]), law_of(column["speed"], column[damping])]
    )


def magnified(points: list[dict[str, float]], case: Case) -> np.ndarray:
    """Give the relative error of each coefficient where every point scatters by 0.1 %."""
    column = {name: np.array([point[name] for point in points]) for name in points[0]}
    errors = []
    for size, value in (("amplitude", "exact stiffness"), ("speed", "exact damping")):
        scale = np.max(column[size])
        matrix = (column[size] / scale)[:, None] ** np.arange(3)
        spread = np.linalg.pinv(matrix) * (1e-3 * column[value])
        errors.append(np.sqrt(np.sum(spread**2, axis=1)) / scale ** np.arange(3) / FACTORS)
    return np.concatenate(errors) / np.abs(case.truth)


def print_steps(case: Case) -> None:
    """Print what each step of the paper's route does to the truth."""
    fine = np.arange(case.lines[0], case.lines[-1] + 1e-9, 0.002)

    def follow(lines: np.ndarray, drops: bool) -> dict[str, list[dict[str, float]]]:
        return {
            way: [classical_points(case, level, lines, way, drops) for level in case.levels]
            for way in ("forward", "backward")
        }

    smooth, coarse, dropping = follow(fine, False), follow(case.lines, False), follow(case.lines, True)

    def mean(points, stiffness, damping):
        return np.mean([laws(points[way], stiffness, damping) for way in points], axis=0)

    rows = {
        "exact points, quadratic fit": mean(smooth, "exact stiffness", "exact damping"),
        "peak for phase resonance": mean(smooth, "stiffness", "exact damping"),
        "half power for damping": mean(smooth, "exact stiffness", "damping"),
        "both": mean(smooth, "stiffness", "damping"),
        "both, lines 0.1 Hz apart: forward": laws(coarse["forward"], "stiffness", "damping"),
        "   backward": laws(coarse["backward"], "stiffness", "damping"),
        "   average": mean(coarse, "stiffness", "damping"),
        "   average, the shaker dropping out": mean(dropping, "stiffness", "damping"),
    }
    print("\nBias of each step, noise-free harmonic balance of the known model [% of the coefficient]")
    print(f"{'':36s}" + "".join(f"{name:>10s}" for name in NAMES))
    for words, found in rows.items():
        bias = 100 * (found / np.array(case.truth) - 1)
        print(f"{words:36s}" + "".join(f"{value:10.2f}" for value in bias))
    scatter = 100 * magnified(smooth["forward"], case)
    print(f"{'error from 0.1 % scatter of points':36s}" + "".join(f"{value:10.2f}" for value in scatter))

    print("\nLevel by level, lines 0.002 Hz apart, forward and backward [N, mm, Hz, kN/m, kN s/m]")
    print(f"{'level':>6s} {'sweep':9s}{'X':>8s}{'peak':>8s}{'phase':>8s}", end="")
    print(f"{'K_eq':>10s}{'by peak':>10s}{'off':>8s}{'C_eq':>10s}{'half pw.':>10s}{'off':>8s}")
    for way in ("forward", "backward"):
        for level, point in zip(case.levels, smooth[way], strict=True):
            phase = np.sqrt(point["exact stiffness"] / MASS) / (2 * np.pi)
            off = [100 * (point[name] / point[f"exact {name}"] - 1) for name in ("stiffness", "damping")]
            sizes = (1e3 * point["amplitude"], point["peak"], phase)
            print(f"{level:6.0f} {way:9s}" + "".join(f"{value:8.3f}" for value in sizes), end="")
            for name, bias in zip(("stiffness", "damping"), off, strict=True):
                exact, found = 1e-3 * point[f"exact {name}"], 1e-3 * point[name]
                print(f"{exact:10.6g}{found:10.6g}{bias:7.2f}%", end="")
            print()


# --- the simulated test ---


def by_direction(table, direction: str) -> np.ndarray:
    """Give the six coefficients of the paper's route from one sweep direction; NaN where there are none."""
    found = []
    for law in (table.stiffness, table.damping):
        if law is None or direction not in law.directions:
            found.append(np.full(3, np.nan))
            continue
        polynomial = law.polynomials[law.directions.index(direction)]
        found.append(np.pad(polynomial / FACTORS[: polynomial.size], (0, 3 - polynomial.size)))
    return np.concatenate(found)


def averaged(table) -> np.ndarray:
    """Give the six averaged coefficients; NaN where there are none."""
    return np.mean([by_direction(table, way) for way in ("forward", "backward")], axis=0)


def values_of(model) -> np.ndarray:
    """Give the six coefficients of a model."""
    return np.array([float(entry.value) for entry in model.parameters if entry.name != "mass"])


def identify(case: Case, repeats: int) -> None:
    """Identify one direction by every route and print the table."""
    from isojax import read_campaign
    from isojax.identification import classical_guess, fit, paper_table

    begin = time.perf_counter()
    campaign = read_campaign(write_test(case.direction, repeats))
    guess = classical_guess(campaign)
    assert guess.table is not None
    variants = {
        (damping, resonance): paper_table(guess.responses, campaign.mass, damping, resonance)
        for damping in ("half_power", "circle")
        for resonance in ("peak", "phase")
    }
    ready = time.perf_counter()
    found = fit(guess.model, campaign)
    done = time.perf_counter()
    paper = variants["half_power", "peak"]
    columns = {
        "truth": np.array(case.truth),
        "paper, forward": by_direction(paper, "forward"),
        "paper, backward": by_direction(paper, "backward"),
        "paper, average": averaged(paper),
        "phase resonance": averaged(variants["half_power", "phase"]),
        "circle": averaged(variants["circle", "peak"]),
        "phase + circle": averaged(variants["circle", "phase"]),
        "all dwells": values_of(guess.model),
        "time-history fit": values_of(found.model),
        "+-": np.array([found.standard_errors[name] for name in found.free]),
    }
    print(
        f"{len(campaign.records)} records, {sum(record.output.size for record in campaign.records)} samples;",
        end=" ",
    )
    print(f"levels {', '.join(f'{level:g}' for level in case.levels)} N")
    print(
        f"read and classical routes {ready - begin:.0f} s, fit {done - ready:.0f} s (compilation included)\n"
    )
    print(f"{'':18s}" + "".join(f"{name:>13s}" for name in NAMES))
    for words, row in columns.items():
        print(f"{words:18s}" + "".join(f"{value:13.5g}" for value in row))
    print("\nOff the truth [%], and the fit in standard errors")
    for words, row in list(columns.items())[1:-1]:
        bias = 100 * (row / columns["truth"] - 1)
        print(f"{words:18s}" + "".join(f"{value:13.3f}" for value in bias))
    off = (columns["time-history fit"] - columns["truth"]) / columns["+-"]
    print(f"{'fit, in se':18s}" + "".join(f"{value:13.2f}" for value in off))
    print(
        f"\nfit: chi2/dof {found.stats.chi2 / found.stats.dof:.4f}, noise {found.noise.sigma:.5f} m/s^2,",
        end=" ",
    )
    print(
        f"stiffness scatters by {100 * found.stats.stiffness_scatter:.3f} % between records (true: 0.050 %)"
    )
    for note in paper.notes:
        print(textwrap.fill(f"note: {note}", 108, break_on_hyphens=False))


def main() -> None:
    """Run the directions that were asked for."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--direction", choices=("y", "z", "both"), default="both")
    parser.add_argument("--repeats", type=int, default=3, help="repeats of each level and sweep direction")
    parser.add_argument("--quick", action="store_true", help="one repeat only")
    options = parser.parse_args()
    jax.config.update("jax_enable_x64", True)
    repeats = 1 if options.quick else options.repeats
    chosen = tuple(CASES) if options.direction == "both" else (options.direction,)
    begin = time.perf_counter()
    missing = [name for name in chosen if not (folder_of(name, repeats) / "campaign.toml").exists()]
    if missing:
        with ProcessPoolExecutor(len(missing), mp_context=get_context("spawn")) as pool:
            list(pool.map(write_test, missing, [repeats] * len(missing)))
    print(f"simulated (or found) after {time.perf_counter() - begin:.0f} s")
    for direction in chosen:
        print(f"\n=== {direction} direction ===")
        identify(CASES[direction], repeats)
        print_steps(CASES[direction])
    print(f"\n{time.perf_counter() - begin:.0f} s in all")


if __name__ == "__main__":
    main()
