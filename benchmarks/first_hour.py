"""Play the first hour of a new user on an own bench, in a fresh environment, with the time of each step.

Run `python benchmarks/first_hour.py [--python PYTHON] [--keep FOLDER] > docs/first_hour.md`; progress goes to
stderr. `isojax.rig`, which shares no code with the models, writes the files of a bench that differs from the
demo's in mass, resonance, rate and noise. They have lines above the heading, time in ms, acceleration in g.
Dry friction is hidden in them. Then a shell runs the commands that a reader of README.md types, and two lines
of the drafted campaign.toml are changed. The exit status is 1 if a command fails, if a picture is missing, if
the friction differs from that of the simulator by more than 2 %, or if all of it takes over ten minutes.
"""

import argparse
import json
import os
import platform
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from isojax import rig

CHECKOUT = Path(__file__).parents[1]

MASS, FRICTION = 120.0, 6.0
"""What the bench weighs, which its owner knows [kg], and what is hidden in it [N]."""

BENCH = rig.Bench(rate=400.0, noise=0.02, drift=0.0005, shaker=rig.Shaker(dropout_frequency=8.2))

ABOVE = """\
Table isolator 2, vertical
Operator: M. Example
Shaker gain 4; accelerometer on the table
"""

EDITS = {
    "mass": f"mass = {MASS:g}      # weighed",
    "stiffness": 'stiffness = ["linear", "cubic"]      # rubber: it stiffens',
}
"""The lines of the draft that its owner changes, by field."""

MAP = "isojax map results/model.json --amplitudes 5 80 100 --frequencies 6 12 100 --out stability"

LONGEST, WORST = 600.0, 0.02
"""All that the first hour may take [s], and the largest error of the friction [share]."""


def write_bench(folder: Path) -> list[str]:
    """Write one CSV for each level and direction, and give their names."""
    plant = rig.Plant(
        (
            rig.LinearStiffness(3.0e5),
            rig.CubicStiffness(4.0e10),
            rig.LinearDamping(360.0),
            rig.CoulombFriction(FRICTION),
        ),
        mass=MASS,
    )
    plan = rig.SteppedSine((18.0, 30.0, 45.0), (7.2, 7.6, 8.0, 8.4, 8.8, 9.4, 10.0), cycles=14)
    names = []
    for record in rig.run(plant, plan, seed=7, bench=BENCH):
        way = "up" if record.direction == "forward" else "down"
        names.append(f"table_{record.level:.0f}N_{way}.csv")
        rows = np.stack([1e3 * record.time, record.force, record.output / 9.80665], axis=1)
        with (folder / names[-1]).open("w", encoding="utf-8") as file:
            file.write(f"{ABOVE}\nTime [ms],Force [N],Acc [g]\n")
            np.savetxt(file, rows, fmt=("%.1f", "%.3f", "%.6f"), delimiter=",")
    return names


def edit(draft: Path) -> list[tuple[str, str]]:
    """Change the lines of the draft that its owner knows better; give each before and after."""
    lines, changed = draft.read_text(encoding="utf-8").splitlines(), []
    for place, line in enumerate(lines):
        new = EDITS.get(line.split("=")[0].strip())
        if new is not None:
            changed.append((line, new))
            lines[place] = new
    if len(changed) != len(EDITS):
        raise SystemExit(f"The draft has other fields than {', '.join(EDITS)}:\n" + "\n".join(lines))
    draft.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return changed


class Shell:
    """A terminal in a folder, with an environment of its own; it keeps what was typed and its times."""

    def __init__(self, folder: Path):
        """Start without what the caller has set for Python or isojax."""
        self.folder = folder
        self.steps: list[tuple[str, float, float]] = []
        self.environment = {
            name: text
            for name, text in os.environ.items()
            if not name.startswith(("PYTHON", "ISOJAX", "JAX", "XLA", "VIRTUAL_ENV"))
        }
        self.environment["PATH"] = f"{folder / '.venv' / 'bin'}{os.pathsep}{os.environ['PATH']}"
        self.environment["COLUMNS"] = "110"

    def type(self, command: str, shown: str | None = None) -> str:
        """Run a command and give what it printed; stop where it fails."""
        print(f"$ {shown or command}", file=sys.stderr, flush=True)
        start, used = time.perf_counter(), processor_seconds()
        done = subprocess.run(
            command, shell=True, cwd=self.folder, env=self.environment, capture_output=True, text=True
        )
        seconds = time.perf_counter() - start, processor_seconds() - used
        self.steps.append((shown or command, *seconds))
        print(f"  {seconds[0]:.1f} s, {seconds[1]:.1f} s of a core", file=sys.stderr, flush=True)
        if done.returncode != 0:
            raise SystemExit(f"{shown or command}: exit code {done.returncode}\n{done.stdout}\n{done.stderr}")
        return done.stdout.strip()


def processor_seconds() -> float:
    """Give the time on a core of all commands that are over [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def processor() -> str:
    """Name the processor, where the system says it."""
    about = Path("/proc/cpuinfo")
    lines = about.read_text(encoding="utf-8").splitlines() if about.exists() else []
    named = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return named[0] if named else platform.machine()


def block(text: str, language: str = "") -> str:
    """Give a fenced block without trailing blanks."""
    return f"```{language}\n" + "\n".join(line.rstrip() for line in text.splitlines()) + "\n```"


def play(folder: Path, python: str) -> tuple[str, list[str]]:
    """Play the hour; give the page, and what went wrong."""
    load = os.getloadavg()[0]
    names = write_bench(folder)
    example = "\n".join((folder / names[0]).read_text(encoding="utf-8").splitlines()[:8])
    shell = Shell(folder)
    shell.type(f"{python} -m venv .venv", "python3 -m venv .venv && source .venv/bin/activate")
    shell.type(f"pip install --disable-pip-version-check '{CHECKOUT}'", "pip install ./isojax")
    seen = shell.type("isojax inspect *.csv --draft campaign.toml")
    changed = edit(folder / "campaign.toml")
    closed = shell.type("isojax close-loop . --out results")
    mapped = shell.type(MAP)

    result = json.loads((folder / "results" / "result.json").read_text(encoding="utf-8"))
    friction = result["after"]["parameters"].get("coulomb_friction.force_level")
    total, used = sum(step[1] for step in shell.steps), sum(step[2] for step in shell.steps)
    faults = [
        f"{name} is missing"
        for name in ("results/report.html", "stability/map.png", "stability/curves.png")
        if not (folder / name).is_file()
    ]
    if total > LONGEST:
        faults.append(f"it took {total:.0f} s")
    if friction is None or abs(friction["value"] / FRICTION - 1) > WORST:
        faults.append(f"the simulator hid {FRICTION} N of friction, but found was {friction}")
    held = [one["error"]["holdout"]["chi2_per_dof"] for one in (result["before"], result["after"])]
    found = "nothing" if friction is None else f"{friction['value']:.3f} ± {friction['standard_error']:.3f} N"

    table = "\n".join(
        f"| {number} | `{command}` | {seconds:.1f} | {busy:.1f} |"
        for number, (command, seconds, busy) in enumerate(shell.steps, start=1)
    )
    edits = "\n".join(f"-{old}\n+{new}" for old, new in changed)
    page = f"""\
# The first hour

`benchmarks/first_hour.py` wrote this page. It plays a new user with an own bench, from an empty folder to a
stability map. It types the commands below into a shell, in a fresh virtual environment, and reads no source.

| step | command | seconds | processor seconds |
|---|---|---|---|
{table}
| | all | {total:.0f} | {used:.0f} |

The machine had {os.cpu_count()} cores ({processor()}), {platform.system()} and \
Python {platform.python_version()}. At the start
{load:.1f} other processes wanted a core, and the commands waited for their turn: the last column is the time
in which they ran, on all cores together. `pip install` downloads JAX, SciPy and what else is needed.

## The files

A simulated bench, which shares no code with the models, made {len(names)} files: stepped sine at three
levels, up and down. The mass is {MASS:g} kg. A dry friction of {FRICTION:g} N is hidden in it. Each file has
lines above its heading, and the units are in the heading:

{block(example)}

## The draft

`isojax inspect` says what is in each file. The first one:

{block(seen.split("table_18N_up.csv")[0].strip())}

`--draft` wrote a campaign.toml that is complete. Two of its guesses were changed:

{block(edits, "diff")}

## The loop

`isojax close-loop` printed:

{block(closed)}

The simulator hid {FRICTION:g} N; found was {found}.
The held-out χ²/dof fell from {held[0]:.4g} to {held[1]:.4g}.

## The map

`isojax map` printed:

{block(mapped)}

Its pictures are `stability/map.png` and `stability/curves.png`.
[Map the stability](howto/map.md) explains them.
"""
    return page.replace(str(folder), "."), faults


def main() -> int:
    """Play the hour in a temporary folder, print the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--python", default="python3", help="makes the environment")
    parser.add_argument("--keep", type=Path, help="an empty folder to play in, instead of a temporary one")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary) if asked.keep is None else asked.keep
        folder.mkdir(parents=True, exist_ok=True)
        page, faults = play(folder.resolve(), asked.python)
    print(page, end="")
    for fault in faults:
        print(fault, file=sys.stderr)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
