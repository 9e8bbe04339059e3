"""Judge the closed loop under random base excitation with equal sensors, alike noisy, on base and mass.

Run `python benchmarks/equal_sensors.py --seeds 0:80 --hidden nothing`, and `--seeds 0:20` with the laws. Rows
go to `results/equal_sensors.jsonl`, from which `--report` prints the table again. A run can be stopped at any
time and goes on where it stopped. `--check` compares the simulator, which shares no code with the models,
with SciPy.

The mass is 0.5 to 500 kg, the natural frequency 3 to 30 Hz, zeta 0.02 to 0.08. A cubic spring has 5 to 40 %
of the force of the linear one at the largest motion. Both are declared, with a linear damper. Two to four
records of 4096 samples, 40 a natural period, have levels up to four times the lowest; sometimes one more is
held out. The base shakes between 0.3 to 0.6 and 2.5 to 4.2 natural frequencies. Half of the campaigns are
periodic, with their period declared: four periods of 1024 samples, after three that are not recorded. The
others start from rest and do not repeat. The acceleration of the base and the absolute one of the mass are
measured. Both have white noise of 0.05 to 1 % of the rms acceleration of the base, alike in all records.

The measured base drives the model, so that its noise reaches the output through the isolator. A law is
hidden at 5 to 15 detection limits of 3.5 standard errors. Its strength is such that it changes the output
by so much over the noise, beside the best change of the declared coefficients and initial states. The noise
of the output has the density `1 + |H|^2` times that of a sensor, with the transmissibility H of the linear
part.
"""

import math
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.signal import bilinear, lfilter

from _judged_loops import Row, failed, judged, names, options_of, run_tasks, seeds_of, write_campaign
from _marks import Marks
from _simulated_motion import (
    FINE,
    SAMPLES,
    Oscillator,
    Signal,
    check_laws,
    drawn_lines,
    on_fine_grid,
    simulate,
)
from _trial_effects import generator, log_uniform
from _trial_judge import wilson
from blind_trial import read

HIDDEN = ("nothing", "coulomb_friction", "maxwell_branch", "bouc_wen")
COUNT, PERIOD, RUN_IN = 4096, 1024, 3

LIMIT = 3.5
"""Standard errors that are one detection limit."""

SMALLEST, LARGEST = 5.0, 15.0
SMALL = 1e-4
"""Change behind a derivative, and first strength of a hidden law, in natural units."""

DECLARED = ("linear_stiffness.coefficient", "cubic_stiffness.coefficient", "linear_damping.coefficient")
MOST_NAMED, RIGHT, COVERED, NORMAL = 0.05, 0.9, 0.95, 1.959964


class Plan(NamedTuple):
    """What is done with a plant.

    Attributes:
        drives: of each record on the fine grid; less the acceleration of the base.
        levels: rms of the drives, natural units.
        fitted: how many of the records are fitted; one that may follow is held out.
        periodic: whether the drives repeat.
        noise: rms in both channels, natural units.
    """

    drives: list[Signal]
    levels: list[float]
    fitted: int
    periodic: bool
    noise: float

    @property
    def skipped(self) -> int:
        """Samples before each record."""
        return RUN_IN * PERIOD if self.periodic else 0


def drawn(seed: int) -> tuple[Oscillator, Plan, dict[str, float]]:
    """Draw plant, plan and natural units: mass [kg], frequency [Hz] and displacement [m]."""
    draw = generator(seed, "equal sensors")
    units = {
        "mass": log_uniform(draw, 0.5, 500.0),
        "frequency": log_uniform(draw, 3.0, 30.0),
        "displacement": log_uniform(draw, 1e-5, 1e-2),
    }
    damping, share = float(draw.uniform(0.02, 0.08)), float(draw.uniform(0.05, 0.4))
    band = float(draw.uniform(0.3, 0.6)), float(draw.uniform(2.5, 4.2))
    periodic, fitted = bool(draw.random() < 0.5), int(draw.integers(2, 5))
    levels = np.geomspace(1.0, draw.uniform(2.0, 4.0), fitted).tolist()
    levels += [math.sqrt(levels[-1])] * bool(draw.random() < 0.5)
    noise = log_uniform(draw, 5e-4, 1e-2) * float(np.sqrt(np.mean(np.square(levels))))
    period, count = (PERIOD, RUN_IN * PERIOD + COUNT) if periodic else (2 * COUNT, COUNT)
    lines = [drawn_lines(draw, band, period, level, equal=False) for level in levels]
    drives = [on_fine_grid(one, 0, count) for one in lines]
    return hardened(damping, drives, share), Plan(drives, levels, fitted, periodic, noise), units


def hardened(damping_ratio: float, drives: list[Signal], share: float) -> Oscillator:
    """Give a plant whose cubic spring has a share of the linear one's force at the largest motion."""
    plant = Oscillator(damping_ratio)
    for _ in range(30):
        largest = max(float(np.max(np.abs(simulate(plant, fine).displacement))) for fine in drives)
        wanted = share / largest**2
        if abs(plant.hardening / wanted - 1.0) < 0.02:
            break
        plant = plant._replace(hardening=math.sqrt(wanted * (plant.hardening or wanted)))
    return plant


def output(plant: Oscillator, plan: Plan, start: tuple[float, float] = (0.0, 0.0)) -> list[Signal]:
    """Give the absolute acceleration of each record."""
    motions = [simulate(plant, fine, start).acceleration - fine[::FINE] for fine in plan.drives]
    return [one[plan.skipped :] for one in motions]


def whitened(plant: Oscillator, records: list[Signal]) -> Signal:
    """Make the noise of the output white, of an rms like that of a sensor; join the records.

    With `A = s^2 + 2 zeta s + 1` and the transmissibility `(2 zeta s + 1) / A` the filter is `A / B`, where
    `|B|^2 = |A|^2 + |2 zeta s + 1|^2`: `B = s^2 + b s + sqrt(2)` with `b^2 = 8 zeta^2 - 2 + 2 sqrt(2)`.
    """
    zeta = plant.damping_ratio
    middle = math.sqrt(8.0 * zeta**2 - 2.0 + 2.0 * math.sqrt(2.0))
    given = bilinear([1.0, 2.0 * zeta, 1.0], [1.0, middle, math.sqrt(2.0)], SAMPLES / (2.0 * math.pi))
    return np.concatenate([lfilter(*given, one) for one in records])


def derivatives(plant: Oscillator, plan: Plan) -> Float[np.ndarray, "time column"]:
    """Give the whitened change of the output with each declared coefficient and initial state."""
    plain = output(plant, plan)

    def change(moved: list[Signal]) -> list[Signal]:
        return [(one - other) / SMALL for one, other in zip(moved, plain, strict=True)]

    more = 1.0 + SMALL
    coefficients = [
        whitened(plant, change(output(other, plan)))
        for other in (
            plant._replace(stiffness=more),
            plant._replace(hardening=more * plant.hardening),
            plant._replace(damping_ratio=more * plant.damping_ratio),
        )
    ]
    # The initial state of a record that begins after others is that of its own first sample: a run from rest
    # shows what a slight motion there leaves, but for the cubic spring.
    start = plan._replace(drives=[fine[plan.skipped * FINE :] for fine in plan.drives], periodic=False)
    rest = output(plant, start)
    states = []
    for slight in ((SMALL, 0.0), (0.0, SMALL)):
        moved = [one - other for one, other in zip(output(plant, start, slight), rest, strict=True)]
        for place in range(len(moved)):
            alone = [one * (number == place) / SMALL for number, one in enumerate(moved)]
            states.append(whitened(plant, alone))
    return np.stack([*coefficients, *states], axis=1)


def hidden(seed: int, law: str, plant: Oscillator, plan: Plan) -> tuple[Oscillator, float]:
    """Give the plant with a law, and how large that is in detection limits."""
    draw = generator(seed, "equal sensors", law)
    if law == "nothing":
        return plant, 0.0
    wanted = log_uniform(draw, SMALLEST, LARGEST)
    fitted = plan._replace(drives=plan.drives[: plan.fitted])
    motion = max(float(np.std(simulate(plant, fine).displacement)) for fine in fitted.drives)
    beta = log_uniform(draw, 0.3, 2.0) / motion
    shape = {
        "coulomb_friction": (),
        "maxwell_branch": (log_uniform(draw, 0.4, 2.0),),
        "bouc_wen": (beta, float(draw.uniform(-0.5, 0.5)) * beta),
    }[law]
    declared, _ = np.linalg.qr(derivatives(plant, fitted))
    plain = whitened(plant, output(plant, fitted))
    strength = SMALL
    for _ in range(10):
        other = plant._replace(law=law, numbers=(strength, *shape))
        change = whitened(plant, output(other, fitted)) - plain
        size = float(np.linalg.norm(change - declared @ (declared.T @ change))) / (LIMIT * plan.noise)
        if abs(size / wanted - 1.0) < 0.05:
            break
        strength *= min(max(wanted / size, 0.2), 20.0)
    return other, size


def run_one(task: tuple[int, str], reports: bool) -> Row:
    """Simulate a campaign, and close the loop on it."""
    seed, law = task
    plant, plan, units = drawn(seed)
    plant, size = hidden(seed, law, plant, plan)
    angular = 2.0 * math.pi * units["frequency"]
    stiffness = units["mass"] * angular**2
    row: Row = {
        "seed": seed,
        "hidden": law,
        "limits": size,
        "damping_ratio": plant.damping_ratio,
        "hardening": plant.hardening,
        "numbers": plant.numbers,
        "units": units,
        "levels": plan.levels,
        "fitted": plan.fitted,
        "periodic": plan.periodic,
        "noise": plan.noise,
        "truth": {
            "linear_stiffness.coefficient": stiffness,
            "cubic_stiffness.coefficient": stiffness * plant.hardening / units["displacement"] ** 2,
            "linear_damping.coefficient": 2.0 * plant.damping_ratio * units["mass"] * angular,
        },
    }

    def write(folder: Path) -> Path:
        return write_records(folder, seed, plant, plan, units)

    return row | judged(write, reports)


def write_records(folder: Path, seed: int, plant: Oscillator, plan: Plan, units: dict[str, float]) -> Path:
    """Write a campaign in SI units, with the noise of both sensors."""
    acceleration = (2.0 * math.pi * units["frequency"]) ** 2 * units["displacement"]
    sections = {
        "campaign": {"title": "equal sensors", "mass": units["mass"]},
        "input": {"quantity": "base_acceleration", "column": "base", "unit": "m/s^2"},
        "output": {"quantity": "acceleration", "column": "mass", "unit": "m/s^2"},
        "sampling": {"rate": SAMPLES * units["frequency"]},
        "model": {"stiffness": ["linear", "cubic"], "damping": ["linear"]},
    }
    records = []
    for place, (fine, moved) in enumerate(zip(plan.drives, output(plant, plan), strict=True)):
        draw = generator(seed, "equal sensors", "noise", str(place))
        base = -fine[::FINE][plan.skipped :]
        fields = {
            "file": f"record{place}.npz",
            "role": "fit" if place < plan.fitted else "holdout",
            "level": acceleration * plan.levels[place],
            **({"period": PERIOD} if plan.periodic else {}),
        }
        channels = {"base": base, "mass": moved}
        noisy = {name: one + plan.noise * draw.standard_normal(one.size) for name, one in channels.items()}
        records.append((fields, {name: acceleration * one for name, one in noisy.items()}))
    return write_campaign(folder, sections, records)


def deviation(row: Row, name: str) -> float:
    """Give how far a declared coefficient lies from the truth [standard errors]; NaN if unknown."""
    value, error = row["declared"].get(name, (None, None))
    return math.nan if value is None or not error else (value - row["truth"][name]) / error


def first(row: Row) -> str:
    """Give the first finding."""
    return (names(row) or ["nothing"])[0]


def in_set(row: Row) -> bool:
    """Say whether the first finding, or what the records do not distinguish from it, is the truth."""
    return any(row["hidden"] in (one["effect"], *one["indistinguishable"]) for one in row["findings"][:1])


def report(rows: list[Row]) -> Marks:
    """Print the table, and judge it."""
    columns = ("campaigns", "errors", "named", "first", "in set", "median s")
    print(f"{'hidden':<20}" + "".join(f"{name:>10}" for name in columns))
    for law in HIDDEN:
        own = [row for row in rows if row["hidden"] == law]
        if own:
            good = [row for row in own if not failed(row)]
            counts = (
                len(own),
                len(own) - len(good),
                sum(bool(names(row)) for row in good),
                sum(first(row) == law for row in good),
                sum(map(in_set, good)),
                round(float(np.median([row["seconds"] for row in own]))),
            )
            print(f"{law:<20}" + "".join(f"{value:>10}" for value in counts))
    marks = Marks()
    marks.judge(
        f"{sum(map(failed, rows))} of {len(rows)} campaigns end in an error", not any(map(failed, rows))
    )
    innocent = [row for row in rows if row["hidden"] == "nothing"]
    if innocent:
        named = sum(bool(names(row)) for row in innocent)
        words = f"something named in {named} of {len(innocent)} campaigns that hide nothing"
        marks.judge(f"{words} (mark {100 * MOST_NAMED:.0f} %)", named <= MOST_NAMED * len(innocent))
    fitted = [row for row in innocent if not failed(row)]
    for name in DECLARED if fitted else ():
        off = np.array([deviation(row, name) for row in fitted])
        covered = int(np.sum(np.abs(off) < NORMAL))
        low, high = wilson(covered, len(fitted))
        spread = f"rms deviation {float(np.sqrt(np.nanmean(off**2))):.2f} standard errors"
        words = f"{name}: 95 % intervals hold the truth in {covered} of {len(fitted)}, {spread}"
        marks.judge(
            f"{words} (interval {100 * low:.0f}-{100 * high:.0f} %, mark 95 %)", low <= COVERED <= high
        )
    hiding = [row for row in rows if row["hidden"] != "nothing"]
    if hiding:
        share = sum(first(row) == row["hidden"] for row in hiding) / len(hiding)
        words = f"right first name in {100 * share:.1f} % of {len(hiding)} campaigns with an effect"
        marks.judge(f"{words} (mark {100 * RIGHT:.0f} %)", share >= RIGHT)
    return marks


def main() -> None:
    """Run, report or check."""
    parser = options_of(__doc__, "equal_sensors.jsonl", "0:20")
    parser.add_argument("--hidden", nargs="+", default=list(HIDDEN), choices=HIDDEN)
    options = parser.parse_args()
    if options.check:
        check_laws(HIDDEN)
    if options.report:
        rows = [row for path in options.report for row in read(path) if row["hidden"] in options.hidden]
    else:
        tasks = [(seed, law) for seed in seeds_of(options.seeds) for law in options.hidden]
        rows = run_tasks(run_one, tasks, ("seed", "hidden"), options)
    if not rows:
        sys.exit("There are no campaigns to report.")
    report(rows).leave()


if __name__ == "__main__":
    main()
