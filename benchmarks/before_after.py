"""Compare the answers and the speed of this checkout with those of an earlier commit.

Run `python benchmarks/before_after.py --base COMMIT [--scripts folds orbits examples measured] [--speed]`:
each script runs with the sources of either commit (a temporary git worktree holds the earlier one) and their
outputs are compared line by line. Words must be equal. A number may differ by the standard error printed
behind it (`+-`), others by a thousandth of themselves or two units of their last digit; times are not
compared. `--kept FOLDER` takes `base_NAME.txt` from a folder instead of running the earlier commit again.

`--rows KEPT NEW` compares campaigns of the blind trial, seed by seed: verdict, findings and their sets must
be equal, strengths within their standard errors, chi2/dof within 0.005.

`--speed` times a map and a fit, compiled before, with either commit in turn, three times each.

The exit status is 1 where something differs (a longer time is printed and judged by the reader).
"""

import argparse
import difflib
import json
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
NUMBER = re.compile(r"[-+]?\d+\.?\d*(?:e[-+]?\d+)?")
TIMED = re.compile(r"\bafter \d+ s\b|\d s\b|first call|compile included|seconds")
CLOSE = 1e-3
CHI2_CLOSE = 0.005


@contextmanager
def worktree(commit: str) -> Iterator[Path]:
    """Check an earlier commit out, for a while."""
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder) / "base"
        subprocess.run(["git", "worktree", "add", "--detach", "--quiet", tree, commit], cwd=ROOT, check=True)
        try:
            yield tree
        finally:
            subprocess.run(["git", "worktree", "remove", "--force", tree], cwd=ROOT, check=True)


def environment(tree: Path) -> dict[str, str]:
    """Give the environment in which Python takes isojax from a checkout."""
    data = os.environ.get("ISOJAX_DATA", str(ROOT.parent / "shared" / "data"))
    return {**os.environ, "PYTHONPATH": str(tree / "src"), "ISOJAX_DATA": data}


def output(tree: Path, name: str) -> str:
    """Run a benchmark script of a checkout."""
    command = [sys.executable, str(tree / "benchmarks" / f"{name}.py")]
    done = subprocess.run(
        command, cwd=tree, env=environment(tree), capture_output=True, text=True, check=False
    )
    return done.stdout


def last_digit(text: str) -> float:
    """Give one unit of the last digit of a printed number."""
    mantissa, _, exponent = text.partition("e")
    decimals = len(mantissa.partition(".")[2])
    return 10.0 ** (int(exponent or 0) - decimals)


def differs(before: str, after: str) -> bool:
    """Say whether two printed lines give different answers."""
    if NUMBER.sub("#", before).split() != NUMBER.sub("#", after).split():
        return True
    old, new = NUMBER.findall(before), NUMBER.findall(after)
    errors = [float(one) for one in re.findall(r"\+-\s*(\d+\.?\d*(?:e[-+]?\d+)?)", before)]
    allowed = max(errors, default=0.0)
    for one, other in zip(old, new, strict=True):
        size = max(abs(float(one)), abs(float(other)))
        slack = max(CLOSE * size, 2.0 * last_digit(one), 2.0 * last_digit(other), allowed)
        if abs(float(one) - float(other)) > slack:
            return True
    return False


def compare_outputs(name: str, before: str, after: str) -> int:
    """Print the lines that differ; give their count."""
    old, new = ([text for text in one.splitlines() if not TIMED.search(text)] for one in (before, after))
    shape = [[NUMBER.sub("#", " ".join(text.split())) for text in one] for one in (old, new)]
    count = 0
    for kind, first, last, start, stop in difflib.SequenceMatcher(None, *shape, autojunk=False).get_opcodes():
        if kind == "equal":
            pairs = zip(old[first:last], new[start:stop], strict=True)
            changed = [(one, other) for one, other in pairs if differs(one, other)]
        else:
            changed = [("\n".join(old[first:last]), "\n".join(new[start:stop]))]
        for one, other in changed:
            print(f"  before: {one}\n  after:  {other}")
        count += len(changed)
    print(f"{name}: {len(new)} lines compared, {count} differ")
    return count


def compare_rows(kept: Path, new: Path) -> int:
    """Compare campaigns of the blind trial; give how many differ."""
    known = {(row["seed"], row["task"]): row for row in map(json.loads, kept.read_text().splitlines())}
    rows = [json.loads(text) for text in new.read_text().splitlines()]
    count = 0
    for row in rows:
        old = known[row["seed"], row["task"]]
        reasons = list(_differences(old, row))
        if reasons:
            print(f"  seed {row['seed']}: {'; '.join(reasons)}")
        count += bool(reasons)
    print(f"{len(rows)} campaigns compared, {count} differ")
    return count


def _differences(old: dict, new: dict) -> Iterator[str]:
    if "error" in new or "error" in old:
        yield f"error: {old.get('error')!r} -> {new.get('error')!r}"
        return
    if old["verdict"] != new["verdict"]:
        yield f"verdict {old['verdict']} -> {new['verdict']}"
    named = [[one["set"] for one in row["findings"]] for row in (old, new)]
    if named[0] != named[1]:
        yield f"findings {named[0]} -> {named[1]}"
    else:
        for one, other in zip(old["findings"], new["findings"], strict=True):
            if "strength" in one and abs(one["strength"] - other["strength"]) > one["error"]:
                known = f"{one['strength']:.6g} +- {one['error']:.2g}"
                yield f"{one['effect']} {known} -> {other['strength']:.6g}"
    for when in ("before", "after"):
        for role in ("fit", "holdout"):
            one, other = old[when][role], new[when][role]
            if one is not None and not abs(one - other) < CHI2_CLOSE:
                yield f"chi2/dof {when}, {role}: {one:.4f} -> {other:.4f}"


def compare_speed(base: Path) -> None:
    """Time either commit in turn and print medians and their ratio."""
    with tempfile.TemporaryDirectory() as folder:
        file = _campaign(Path(folder))
        taken: dict[str, dict[str, list[float]]] = {"before": {}, "after": {}}
        for _ in range(3):
            for when, tree in (("before", base), ("after", ROOT)):
                command = [sys.executable, str(ROOT / "benchmarks" / "_timed_work.py"), str(file)]
                done = subprocess.run(
                    command, env=environment(tree), capture_output=True, text=True, check=True
                )
                for work, time in json.loads(done.stdout.splitlines()[-1]).items():
                    taken[when].setdefault(work, []).append(time)
    for work in taken["before"]:
        old, new = (float(np.median(taken[when][work])) for when in ("before", "after"))
        print(f"{work}: {old:.3f} s before, {new:.3f} s after, ratio {new / old:.2f}")


def _campaign(folder: Path) -> Path:
    from isojax import rig

    plan = rig.SteppedSine((60.0, 100.0, 150.0), tuple(np.arange(4.0, 7.01, 0.25)), 30)
    return Path(rig.write_campaign(folder, rig.y_plant(), plan, 1, "timed", rig.Bench(rate=250.0)))


def main() -> None:
    """Compare what was asked for."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--base", metavar="COMMIT", help="the earlier commit")
    parser.add_argument("--scripts", nargs="*", default=[], help="benchmark scripts, without .py")
    parser.add_argument("--kept", type=Path, metavar="FOLDER", help="outputs of the earlier commit")
    parser.add_argument("--rows", type=Path, nargs=2, metavar=("KEPT", "NEW"), help="of the blind trial")
    parser.add_argument("--speed", action="store_true", help="time a map and a fit")
    options = parser.parse_args()
    if (options.speed or (options.scripts and not options.kept)) and not options.base:
        parser.error("--base must name the commit to compare with")
    count = compare_rows(*options.rows) if options.rows else 0
    for name in options.scripts if options.kept else ():
        before = (options.kept / f"base_{name}.txt").read_text()
        count += compare_outputs(name, before, output(ROOT, name))
    if options.base:
        with worktree(options.base) as base:
            for name in () if options.kept else options.scripts:
                count += compare_outputs(name, output(base, name), output(ROOT, name))
            if options.speed:
                compare_speed(base)
    sys.exit(1 if count else 0)


if __name__ == "__main__":
    main()
