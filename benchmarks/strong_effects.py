"""Judge the closed loop on effects as large as the base: dry friction, wire rope, end stops, strong springs.

Run `python benchmarks/strong_effects.py --seeds 0:3`. Rows go to `results/strong_effects.jsonl`, from which
`--report` prints the table again. A run can be stopped at any time and goes on where it stopped. `--check`
compares the simulator, which shares no code with the models, with SciPy.

The plant is `z'' + 2 zeta z' + z + g = drive` in natural units, zeta 0.02 to 0.06, scaled to 0.01 to 10,000
kg, 2 to 200 Hz and a displacement of 1e-5 to 1e-2 m. g is one of ten laws, or nothing. Declared are a linear
spring and a linear damper; force and acceleration are measured at 40 samples a natural period. Levels 0.5, 1
and 2 are fitted, 1.5 is held out. The drive lies between 0.3 and 3 natural frequencies, or is a sine:

- multisine: rms 0.5 times the level, period 40 natural periods; four of them after one that is not recorded.
- random: as strong, 160 natural periods from rest, normal noise that does not repeat.
- chirp: amplitude 0.35 times the level, 0.4 to 2.2 natural frequencies and back in 160 natural periods.
- stepped: 0.25 times the level, 15 cycles each 0.05 from 0.6 to 1.6 natural frequencies and back.

The noise is white, 0.4 % of the rms acceleration of its record. Friction may hold a weakly driven mass
throughout. The noise of such a record is 0.04 % of the largest rms acceleration in the campaign.

Strong springs and stops move irregularly where the drive is random: two motions with all but equal damping
separate within the record. No free run of a fit can follow the measured one then. `reach` in a row is the
error of the true law's own free run with a damping that is off by a ten-thousandth, a usual standard error.
Free runs are judged where `reach` is below a half of the noise. The other campaigns are counted as irregular.
"""

import math
import sys
from pathlib import Path

import numpy as np

from _judged_loops import (
    ROLES,
    Row,
    failed,
    free_run,
    judged,
    names,
    options_of,
    run_tasks,
    seeds_of,
    share_of,
    write_campaign,
)
from _marks import Marks
from _simulated_motion import (
    FINE,
    SAMPLES,
    Oscillator,
    Signal,
    check_laws,
    drawn_lines,
    fine_times,
    on_fine_grid,
    simulate,
)
from _trial_effects import generator, log_uniform
from blind_trial import read

RANGES: dict[str, tuple[tuple[float, float], ...]] = {
    "cubic_damping": ((0.1, 0.6),),
    "coulomb_friction": ((0.15, 0.5),),
    "dahl_friction": ((0.15, 0.5), (2.0, 8.0)),
    "maxwell_branch": ((0.3, 1.0), (0.4, 2.0)),
    "cubic_stiffness": ((0.1, 0.5),),
    "quadratic_stiffness": ((0.015, 0.05),),
    "end_stop": ((1.0, 10.0), (0.5, 1.0)),
    "abs_quadratic_damping": ((0.1, 0.6),),
    "position_damping": ((0.1, 0.6),),
    "quintic_stiffness": ((0.1, 0.5),),
    "nothing": (),
}
"""Least and largest number of each law, in the order of `Oscillator.numbers`."""

SAME = {"end_stop": ("freeplay",), "dahl_friction": ("bouc_wen",)}
"""Names that are right as well: a gap in a second spring is an end stop, and gamma = 0 makes Dahl's law of
Bouc and Wen's."""

DRIVES = ("multisine", "random", "chirp", "stepped")
FITTED, HELD_OUT = (0.5, 1.0, 2.0), 1.5
BAND = (0.3, 3.0)
PERIODS = 160
PERIOD = 40 * SAMPLES
CYCLES = 15
NOISE = 0.004
STILL = 0.1
"""Share of the largest rms acceleration that counts for the noise of a record that hardly moves."""

TRIES = 5
"""Times that the law is halved where the plant runs away."""

OFF = 1e-4
"""Relative error of the damping behind `reach`."""

RIGHT, ABOVE_NOISE, REGULAR = 0.9, 1.3, 0.5


def drawn(seed: int, law: str, drive: str) -> tuple[Oscillator, dict[str, float]]:
    """Draw the plant, and mass [kg], natural frequency [Hz] and displacement [m] of its natural units."""
    draw = generator(seed, "strong", law, drive)
    numbers = tuple(float(draw.uniform(*ends)) for ends in RANGES[law])
    units = {
        "mass": log_uniform(draw, 0.01, 1e4),
        "frequency": log_uniform(draw, 2.0, 200.0),
        "displacement": log_uniform(draw, 1e-5, 1e-2),
    }
    return Oscillator(float(draw.uniform(0.02, 0.06)), law=law, numbers=numbers), units


def driven(draw: np.random.Generator, drive: str, level: float) -> tuple[Signal, int]:
    """Give a drive on the fine grid, and how many samples go before the record."""
    count = PERIODS * SAMPLES
    if drive == "multisine":
        lines = drawn_lines(draw, BAND, PERIOD, 0.5 * level, equal=True)
        return on_fine_grid(lines, 0, PERIOD + count), PERIOD
    if drive == "random":
        return on_fine_grid(drawn_lines(draw, BAND, 2 * count, 0.5 * level, equal=False), 0, count), 0
    if drive == "chirp":
        time = fine_times(count) / SAMPLES
        half = PERIODS / 2.0
        up = np.minimum(time, half)
        back = time - up
        cycles = 0.4 * up + 0.9 * up**2 / half + 2.2 * back - 0.9 * back**2 / half
        return 0.35 * level * np.sin(2.0 * np.pi * cycles), 0
    counts = dwells()
    fine = [np.sin(2.0 * np.pi * CYCLES * np.arange(one * FINE) / (one * FINE)) for one in counts]
    return 0.25 * level * np.concatenate(fine)[: -FINE + 1], 0


def dwells() -> list[int]:
    """Give the samples of each dwell of a stepped sine: whole ones, so that 15 cycles fill them."""
    shares = np.linspace(0.6, 1.6, 21)
    return [round(CYCLES * SAMPLES / share) for share in (*shares, *shares[-2::-1])]


def moved(oscillator: Oscillator, drives: list[tuple[Signal, int]]) -> list[Signal]:
    """Give the acceleration of each record."""
    return [simulate(oscillator, fine).acceleration[skip:] for fine, skip in drives]


def run_one(task: tuple[int, str, str], reports: bool) -> Row:
    """Simulate a campaign, and close the loop on it."""
    seed, law, drive = task
    plant, units = drawn(seed, law, drive)
    levels = (*FITTED, HELD_OUT)
    drives = [driven(generator(seed, law, drive, str(level)), drive, level) for level in levels]
    for _ in range(TRIES):
        motions = moved(plant, drives)
        if all(np.all(np.isfinite(one)) for one in motions):
            break
        plant = plant._replace(numbers=(0.5 * plant.numbers[0], *plant.numbers[1:]))  # it runs away
    else:
        raise RuntimeError(f"The plant of seed {seed} with {law} runs away.")
    largest = max(float(np.std(one)) for one in motions)
    errors = [
        NOISE
        * max(float(np.std(one)), STILL * largest)
        * generator(seed, law, drive, str(level), "noise").standard_normal(one.size)
        for one, level in zip(motions, levels, strict=True)
    ]
    measured = [one + error for one, error in zip(motions, errors, strict=True)]
    near = moved(plant._replace(damping_ratio=(1.0 + OFF) * plant.damping_ratio), drives)
    parts = {"fit": slice(0, 3), "holdout": slice(3, 4)}
    off = [one - other for one, other in zip(near, motions, strict=True)]
    row: Row = {
        "seed": seed,
        "law": law,
        "drive": drive,
        "damping_ratio": plant.damping_ratio,
        "numbers": plant.numbers,
        "units": units,
        "rms": [float(np.std(one)) for one in motions],
        "noise": {role: share_of(errors[part], measured[part]) for role, part in parts.items()},
        "reach": {role: share_of(off[part], measured[part]) for role, part in parts.items()},
    }

    def write(folder: Path) -> Path:
        return write_records(folder, drive, units, levels, drives, measured)

    return row | judged(write, reports)


def write_records(
    folder: Path,
    drive: str,
    units: dict[str, float],
    levels: tuple[float, ...],
    drives: list[tuple[Signal, int]],
    measured: list[Signal],
) -> Path:
    """Write a campaign in SI units."""
    acceleration = (2.0 * math.pi * units["frequency"]) ** 2 * units["displacement"]
    rate = SAMPLES * units["frequency"]
    more = {"multisine": {"period": PERIOD}, "stepped": {"schedule": "dwells.csv"}}.get(drive, {})
    if drive == "stepped":
        counts = np.array(dwells())
        starts = np.cumsum(counts) - counts
        rows = [
            f"{float(s / rate)!r},{float(CYCLES * rate / n)!r},{CYCLES}"
            for s, n in zip(starts, counts, strict=True)
        ]
        (folder / "dwells.csv").write_text("\n".join(["start_s,frequency_hz,cycles", *rows]) + "\n")
    sections = {
        "campaign": {"title": f"strong effect, {drive}", "mass": units["mass"]},
        "input": {"quantity": "force", "column": "force", "unit": "N"},
        "output": {"quantity": "acceleration", "column": "acceleration", "unit": "m/s^2"},
        "sampling": {"rate": rate},
        "model": {"stiffness": ["linear"], "damping": ["linear"]},
    }
    records = [
        (
            {
                "file": f"level{place}.npz",
                "role": "fit" if level in FITTED else "holdout",
                "level": level,
                **more,
            },
            {
                "force": units["mass"] * acceleration * fine[::FINE][skip:],
                "acceleration": acceleration * signal,
            },
        )
        for place, (level, (fine, skip), signal) in enumerate(zip(levels, drives, measured, strict=True))
    ]
    return write_campaign(folder, sections, records)


def right(row: Row) -> bool:
    """Say whether the first name is right; where nothing is hidden, whether nothing is named."""
    found, law = names(row), row["law"]
    if failed(row) or law == "nothing":
        return not failed(row) and not found
    return found[:1] in [[name] for name in (law, *SAME.get(law, ()))]


def regular_motion(row: Row) -> bool:
    """Say whether a fit can follow the motion of all records from their starts."""
    return all(row["reach"][role] < REGULAR * row["noise"][role] for role in ROLES)


def down_to_noise(row: Row) -> bool:
    """Say whether the free runs after the loop are as near as the noise allows."""
    return all(free_run(row, "after", role) <= ABOVE_NOISE * row["noise"][role] for role in ROLES)


COLUMNS = ("campaigns", "errors", "right", "alone", "in set", "noise", "of", "irregular", "median s")


def figures(rows: list[Row]) -> tuple[int, ...]:
    """Count what `COLUMNS` names; "noise" are free runs down to it "of" the right and regular campaigns."""
    good = [row for row in rows if right(row)]
    sets = [{one["effect"], *one["indistinguishable"]} for row in rows for one in row.get("findings", [])[:1]]
    laws = [row["law"] for row in rows if row.get("findings")]
    regular = [row for row in good if regular_motion(row)]
    return (
        len(rows),
        sum(map(failed, rows)),
        len(good),
        sum(len(names(row)) == (row["law"] != "nothing") for row in good),
        sum(law in one for law, one in zip(laws, sets, strict=True)),
        sum(map(down_to_noise, regular)),
        len(regular),
        sum(not regular_motion(row) for row in rows),
        round(float(np.median([row["seconds"] for row in rows]))),
    )


def report(rows: list[Row]) -> Marks:
    """Print the table by law and by drive, and judge it."""
    print(f"{'':<24}" + "".join(f"{name:>10}" for name in COLUMNS))
    for key, kinds in (("law", RANGES), ("drive", DRIVES)):
        for kind in kinds:
            own = [row for row in rows if row[key] == kind]
            if own:
                print(f"{kind:<24}" + "".join(f"{value:>10}" for value in figures(own)))
    print(f"{'all':<24}" + "".join(f"{value:>10}" for value in figures(rows)))
    marks = Marks()
    hidden = [row for row in rows if row["law"] != "nothing"]
    innocent = [row for row in rows if row["law"] == "nothing"]
    marks.judge(
        f"{sum(map(failed, rows))} of {len(rows)} campaigns end in an error (mark 0)",
        not any(map(failed, rows)),
    )
    if hidden:
        share = sum(map(right, hidden)) / len(hidden)
        words = f"right first name in {100 * share:.1f} % of {len(hidden)} campaigns with an effect"
        marks.judge(f"{words} (mark {100 * RIGHT:.0f} %)", share >= RIGHT)
    if innocent:
        named = sum(bool(names(row)) for row in innocent)
        marks.judge(f"something named in {named} of {len(innocent)} linear campaigns (mark 0)", named == 0)
    regular = [row for row in rows if right(row) and regular_motion(row)]
    at_noise = sum(map(down_to_noise, regular))
    words = f"fitted and held-out free runs within {ABOVE_NOISE} times the noise in {at_noise}"
    words = f"{words} of {len(regular)} campaigns that are named right and move regularly (mark: all)"
    marks.judge(words, 0 < at_noise == len(regular))
    return marks


def main() -> None:
    """Run, report or check."""
    parser = options_of(__doc__, "strong_effects.jsonl", "0:3")
    parser.add_argument("--laws", nargs="+", default=list(RANGES), choices=list(RANGES), metavar="LAW")
    parser.add_argument("--drives", nargs="+", default=list(DRIVES), choices=DRIVES)
    options = parser.parse_args()
    if options.check:
        check_laws(RANGES)
    if options.report:
        rows = [row for path in options.report for row in read(path)]
        rows = [row for row in rows if row["law"] in options.laws and row["drive"] in options.drives]
    else:
        tasks = [
            (seed, law, drive)
            for seed in seeds_of(options.seeds)
            for law in options.laws
            for drive in options.drives
        ]
        rows = run_tasks(run_one, tasks, ("seed", "law", "drive"), options)
    if not rows:
        sys.exit("There are no campaigns to report.")
    report(rows).leave()


if __name__ == "__main__":
    main()
