"""Judge the diagnosis on campaigns that nobody tuned to: drawn from a seed, diagnosed blind.

Run `python benchmarks/blind_trial.py --seeds 0:200 --out trial.jsonl`, then `... --report trial.jsonl`. A run
can be stopped at any time and goes on where it stopped: a line of the file is a campaign, and what is there
is skipped. About half a minute a campaign and core once the code is compiled. The rows behind the
tables of docs/validation.md are in `results/`; each says of which commit it is.

The plant is the paper's y direction with every coefficient moved by up to 10 %, on the rig simulator, which
shares no code with the models. Levels, noise, distortion and drift of the stiffness (0 to 0.2 %) are drawn;
dwells beside a fold occur. Six records of 32 s at 250 Hz: stepped or swept sines up and down, or stepped ones
with a multisine; two are held out. A campaign hides nothing, one effect, two, or a law that the catalogue
lacks, at 1 to 30 times the detection limit (3.5 standard errors of the strength beside the true model).
`--leave-out` diagnoses those with one effect again while it is no candidate. `--wall-time` times one
diagnosis and a whole loop over six records of 60 s at 250 Hz (or as given), compile included and again in the
same process. `--coverage N` fits the true structure to N campaigns of each of ten effects, or of those of
`--effects`, and asks whether the 95 % intervals hold the truth.

The report prints for each criterion: PASS or FAIL, the figure, how many campaigns it rests on, its 95 %
interval (Wilson), and with `--verbose` each campaign that speaks against it. The exit status is 1 after a
FAIL.
"""

import argparse
import json
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import jax

from _set_up_jax import set_up_jax
from _trial_campaign import CLASSES, kind_of
from _trial_effects import COMMONEST, EFFECTS
from _trial_judge import coverage_markdown, line, markdown, print_table
from _trial_run import crowded, run_one

Task = tuple[int, str, str, tuple[str, ...] | None]


def tasks(options: argparse.Namespace) -> Iterator[Task]:
    """List what was asked for: seed, class, task, and what to hide where it is not drawn."""
    first, _, stop = options.seeds.partition(":")
    seeds = range(int(first), int(stop) if stop else int(first) + 1)
    if options.wall_time:
        yield seeds.start, "wall_time", "wall_time", (options.wall_time,)
        return
    if options.coverage:
        for repeat in range(options.coverage):
            for name in options.effects:
                yield 100_000 + seeds.start + repeat, "coverage", "coverage", (name,)
        return
    for seed in seeds:
        kind = kind_of(seed)
        if options.leave_out and kind == "one":
            yield seed, kind, "leave_out", None
        elif not options.leave_out and kind in options.classes:
            yield seed, kind, "loop", None


def key(row: dict) -> tuple:
    """Give what makes a campaign the same as another."""
    return row["seed"], row["task"], tuple(row.get("names") or ())


def read(path: Path) -> list[dict]:
    """Read the campaigns that are there; a last line that was cut short is as if it were not."""
    if not path.exists():
        return []
    lines = path.read_text().splitlines(keepends=True)
    whole = [text for text in lines if text.strip() and text.endswith("\n")]
    return [json.loads(text) for text in whole]


def commit() -> str | None:
    """Give the commit of this checkout, with which a row says what code it is of."""
    try:
        words = ["git", "describe", "--always", "--dirty"]
        done = subprocess.run(words, cwd=Path(__file__).parent, capture_output=True, text=True, check=False)
    except OSError:
        return None
    return done.stdout.strip() or None


def run(options: argparse.Namespace) -> None:
    """Run what is not there yet."""
    rows = read(options.out)
    if options.out.exists() and not options.out.read_text().endswith("\n"):
        options.out.write_text("".join(json.dumps(row) + "\n" for row in rows))
    done = {key(row) for row in rows}
    begin, version = time.perf_counter(), commit()
    for seed, kind, task, names in tasks(options):
        if (seed, task, tuple(names or ())) in done:
            continue
        if options.minutes and time.perf_counter() - begin > 60.0 * options.minutes:
            print("time is up", flush=True)
            return
        row = run_one(seed, kind, task, names) | {"names": names, "commit": version}
        with options.out.open("a") as file:
            file.write(json.dumps(row) + "\n")
        print(f"{row['total_seconds']:6.1f} s  {line(row)}", flush=True)
        if crowded():
            jax.clear_caches()


def main() -> None:
    """Run, or report."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seeds", default="0:200", help="first:stop")
    parser.add_argument("--out", type=Path, default=Path("trial.jsonl"), help="one line a campaign")
    parser.add_argument(
        "--classes", nargs="+", default=list(CLASSES), choices=CLASSES, help="of those that the seeds draw"
    )
    parser.add_argument("--leave-out", action="store_true", help="the true effect is no candidate")
    parser.add_argument("--coverage", type=int, metavar="N", help="true structure only, N repeats an effect")
    parser.add_argument(
        "--effects",
        nargs="+",
        default=list(COMMONEST),
        choices=sorted(EFFECTS),
        metavar="NAME",
        help="of --coverage, by their catalogue names; the ten commonest if omitted",
    )
    parser.add_argument(
        "--wall-time",
        nargs="?",
        const="250",
        metavar="HZ",
        help="a diagnosis and a loop by the clock, without --cache",
    )
    parser.add_argument("--minutes", type=float, help="begin no campaign after so long")
    parser.add_argument("--cache", type=Path, help="folder in which compiled code is kept between runs")
    parser.add_argument(
        "--report", type=Path, nargs="+", metavar="FILE", help="print the table of these files"
    )
    parser.add_argument("--markdown", action="store_true", help="print it as docs/validation.md shows it")
    parser.add_argument("--verbose", action="store_true", help="list what speaks against each criterion")
    options = parser.parse_args()
    if options.report:
        missing = [str(path) for path in options.report if not path.exists()]
        if missing:
            sys.exit(f"There is no file {', '.join(missing)}: run the trial first.")
        rows = [row for path in options.report for row in read(path)]
        if options.markdown:
            trial = [row for row in rows if row["task"] != "coverage"]
            repeats = [row for row in rows if row["task"] == "coverage"]
            tables = [markdown(trial)] * bool(trial) + [coverage_markdown(repeats)] * bool(repeats)
            print("\n\n".join("\n".join(lines) for lines in tables))
            return
        sys.exit(0 if print_table(rows, options.verbose) else 1)
    set_up_jax(options.cache)
    run(options)


if __name__ == "__main__":
    main()
