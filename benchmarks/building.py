"""Judge the closed loop on a measured building on rubber bearings, on a shake table.

Run `python benchmarks/building.py`. A row is added to `results/building.jsonl`, from which `--report` prints
the figures of the last run again. The data are looked for in ISOJAX_DATA, else in ../shared/data beside the
repository.

The acceleration `u` of the table is the input, the displacement `d1` on the bearings, relative to the
table, the output. The mass is 1 kg, since only ratios to the mass count. A linear spring and a linear
damper are declared. ICA50 and ICA100 are fitted, CNP100 is held out. The records are filtered, so that the
floor of their spectra does not show the noise.

Least squares of free runs in SciPy leave these errors over the rms of each record:

| model | ICA50 | ICA100 | CNP100 |
|---|---|---|---|
| declared | 51.9 % | 48.7 % | 52.1 % |
| with a cubic spring | 43 % | 36 % | 43 % |
| with Dahl's law | 29.9 % | 19.7 % | 41 % |
| with Dahl's law and a cubic spring | 20.4 % | 20.1 % | 35.5 % |
"""

import argparse
import json
import sys
from pathlib import Path

import numpy as np

from _judged_loops import RESULTS, ROLES, Row, failed, free_run, judged, names, worded, write_campaign
from _marks import Marks
from _set_up_jax import set_up_jax
from blind_trial import commit, read
from isojax.elements import CATALOGUE
from measured import data_folder

RECORDS = {"ICA50": "fit", "ICA100": "fit", "CNP100": "holdout"}
RATE = 200.0
HYSTERESIS = ("bouc_wen", "dahl_friction")
CHANNELS = ("The response channel", "The drive and the floor")
"""Groups of the catalogue whose effects are of the measurement and not of the building."""

LARGEST_ERRORS = {"fit": 0.28, "holdout": 0.37}
MOST_SECONDS = 60.0


def write_records(folder: Path) -> Path:
    """Write the campaign, with the two channels that it uses."""
    sections = {
        "campaign": {"title": "building on rubber bearings", "mass": 1.0},
        "input": {"quantity": "base_acceleration", "column": "u", "unit": "m/s^2"},
        "output": {"quantity": "displacement", "column": "d1", "unit": "m"},
        "sampling": {"rate": RATE},
        "model": {"stiffness": ["linear"], "damping": ["linear"]},
    }
    records = []
    for name, role in RECORDS.items():
        with np.load(data_folder() / "building" / f"{name}.npz") as held:
            records.append(({"file": f"{name}.npz", "role": role}, {key: held[key] for key in ("u", "d1")}))
    return write_campaign(folder, sections, records)


def report(row: Row) -> Marks:
    """Print what the loop said, and judge it."""
    print(worded(row))
    marks = Marks()
    if failed(row):
        marks.judge("the loop ends", False)
        return marks
    for place, one in enumerate(row["findings"], 1):
        others = ", ".join(one["indistinguishable"]) or "nothing"
        print(f"finding {place}: {one['effect']}; not distinguishable from it: {others}")
    print(f"verdict {row['outcome']}: {row['reason']}")
    before, after = row["chi2_per_dof"]
    print(f"chi2/dof {before} -> {after}")
    for name, (value, error) in row["coefficients"].items():
        print(f"  {name}: {value} +- {error}")
    found = names(row)
    marks.judge(f"first finding: {found[:1]} (mark: a hysteresis)", bool(set(found[:1]) & set(HYSTERESIS)))
    channel = [name for name in found if CATALOGUE[name].group in CHANNELS]
    marks.judge(f"effects of a channel: {channel} (mark: none)", not channel)
    for role in ROLES:
        before, after = (free_run(row, when, role) for when in ("before", "after"))
        words = f"free run, {role}: {100 * before:.3g} -> {100 * after:.3g} %"
        marks.judge(f"{words} (mark {100 * LARGEST_ERRORS[role]:.0f} %)", after <= LARGEST_ERRORS[role])
    seconds = row["processor_seconds"]
    words = f"processor time {seconds:.0f} s, wall time {row['seconds']:.0f} s"
    marks.judge(f"{words} (mark {MOST_SECONDS:.0f} s of a core)", seconds <= MOST_SECONDS)
    return marks


def main() -> None:
    """Run, or report."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=RESULTS / "building.jsonl", help="one line a run")
    parser.add_argument("--report", type=Path, metavar="FILE", help="print the figures of the last run")
    parser.add_argument("--reports", action="store_true", help="write the report too; its errors count")
    options = parser.parse_args()
    if options.report:
        rows = read(options.report)
        if not rows:
            sys.exit(f"There are no rows in {options.report}.")
    else:
        set_up_jax(None)
        rows = [judged(write_records, options.reports) | {"commit": commit()}]
        with options.out.open("a", encoding="utf-8") as file:
            file.write(json.dumps(rows[-1]) + "\n")
    report(rows[-1]).leave()


if __name__ == "__main__":
    main()
