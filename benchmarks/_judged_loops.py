"""Campaigns on disk, each given to the public closed loop, and a line of JSON of what became of it."""

import argparse
import functools
import itertools
import json
import math
import multiprocessing
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from pathlib import Path
from typing import Any

import jax
import numpy as np

import isojax as ij
from _set_up_jax import set_up_jax
from _trial_run import crowded
from blind_trial import commit, read
from isojax.identification import Fit, Loop

Row = dict[str, Any]
Task = tuple[Any, ...]

RESULTS = Path(__file__).resolve().parent / "results"
ROLES = ("fit", "holdout")


def write_campaign(
    folder: Path, sections: dict[str, dict[str, Any]], records: Sequence[tuple[dict[str, Any], dict]]
) -> Path:
    """Write campaign.toml and its data files.

    Args:
        folder: where to.
        sections: fields of each section.
        records: of each record its fields, "file" among them, and its columns.

    Returns:
        The path of campaign.toml.
    """
    lines = []
    for name, fields in sections.items():
        lines += [f"[{name}]", *(f"{field} = {_toml(value)}" for field, value in fields.items())]
    for fields, columns in records:
        np.savez(folder / fields["file"], **columns)
        lines += ["[[record]]", *(f"{field} = {_toml(value)}" for field, value in fields.items())]
    path = folder / "campaign.toml"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def _toml(value: Any) -> str:
    """Write a text, a whole or other number, a truth value or a list of texts; JSON writes them alike."""
    return json.dumps(value.item() if isinstance(value, np.generic) else value)


def judged(write: Callable[[Path], Path], reports: bool) -> Row:
    """Close the loop on a campaign, and say what came of it; whatever it raises is the outcome.

    Args:
        write: writes the campaign into a folder and gives the path of its campaign.toml.
        reports: whether the report is written as well; its time does not count.
    """
    row: Row = {}
    with tempfile.TemporaryDirectory() as folder:
        path = write(Path(folder))
        begun, worked = time.perf_counter(), time.process_time()
        try:
            closed = ij.close_loop(ij.read_campaign(path))
            row |= _said_of(closed.loop) | _times(begun, worked)
            if reports:
                closed.report(path.parent / "report")
        except Exception as problem:  # one campaign that fails is a failure of the trial, not its end
            row["outcome"] = f"error: {type(problem).__name__}: {problem}"[:500]
    return _times(begun, worked) | row


def _times(begun: float, worked: float) -> Row:
    """Give wall time and processor time since then [s]."""
    wall, processor = time.perf_counter() - begun, time.process_time() - worked
    return {"seconds": round(wall, 2), "processor_seconds": round(processor, 2)}


def _said_of(loop: Loop) -> Row:
    """Give verdict, findings, free-run errors and coefficients of a loop."""
    after = loop.after
    return {
        "outcome": loop.verdict,
        "reason": loop.last.reason,
        "findings": [
            {"effect": one.effect, "indistinguishable": list(one.indistinguishable)} for one in loop.findings
        ],
        "chi2_per_dof": [_finite(fit.stats.chi2 / fit.stats.dof) for fit in (loop.before, after)],
        "before": _errors(loop.before),
        "after": _errors(after),
        "declared": _coefficients(loop.before),
        "coefficients": _coefficients(after),
    }


def _coefficients(fit: Fit) -> dict[str, tuple[float | None, float | None]]:
    """Give each fitted coefficient and its standard error."""
    return {
        name: (_finite(float(fit.model[name])), _finite(error)) for name, error in fit.standard_errors.items()
    }


def _errors(fit: Fit) -> dict[str, list[float | None] | None]:
    """Give, by role, the error of the free run and that of the run with every segment restarted."""
    return {
        role: None if one is None else [_finite(one.nrmse), _finite(one.nrmse_segments)]
        for role, one in fit.errors.items()
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def failed(row: Row) -> bool:
    """Say whether the loop raised."""
    return row["outcome"].startswith("error")


def names(row: Row) -> list[str]:
    """Give the effects that were found, in their order."""
    return [one["effect"] for one in row.get("findings", ())]


def free_run(row: Row, when: str, role: str) -> float:
    """Give the error of the free run over the measured rms; NaN where there is none."""
    errors = row.get(when, {}).get(role)
    return math.nan if errors is None or errors[0] is None else errors[0]


def share_of(parts: Iterable[np.ndarray], wholes: Iterable[np.ndarray]) -> float:
    """Give the rms of errors over that of signals about their means, all records together."""
    error = sum(float(np.sum(part**2)) for part in parts)
    return math.sqrt(error / sum(float(np.sum((whole - whole.mean()) ** 2)) for whole in wholes))


def worded(row: Row) -> str:
    """Put outcome, findings and errors in a few words."""
    if failed(row):
        return row["outcome"]
    found = ", ".join(
        " = ".join([one["effect"], *(other for other in one["indistinguishable"] if other != one["effect"])])
        for one in row["findings"]
    )
    errors = "; ".join(
        f"{role} {100 * free_run(row, 'before', role):.3g} -> {100 * free_run(row, 'after', role):.3g} %"
        for role in ROLES
        if row["after"].get(role)
    )
    return f"{row['outcome']}: {found or 'nothing named'}; {errors}"


def options_of(words: str, out: str, seeds: str) -> argparse.ArgumentParser:
    """Give a parser with the options that such a script has.

    Args:
        words: its docstring.
        out: name of the file of rows in `results`.
        seeds: default of --seeds.
    """
    parser = argparse.ArgumentParser(description=words, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", default=seeds, help=f"first:stop; {seeds} if omitted")
    parser.add_argument("--jobs", type=int, default=1, help="processes; 1 runs all in this one")
    parser.add_argument("--out", type=Path, default=RESULTS / out, help="one line a campaign")
    parser.add_argument("--minutes", type=float, help="begin no campaign after so long")
    parser.add_argument("--report", type=Path, nargs="+", metavar="FILE", help="print the table from rows")
    parser.add_argument("--reports", action="store_true", help="write each report too; its errors count")
    parser.add_argument("--check", action="store_true", help="compare the simulator with SciPy")
    return parser


def seeds_of(words: str) -> range:
    """Read first:stop, or one seed."""
    first, _, stop = words.partition(":")
    return range(int(first), int(stop) if stop else int(first) + 1)


def run_tasks(
    run_one: Callable[[Task, bool], Row],
    tasks: Iterable[Task],
    keys: Sequence[str],
    options: argparse.Namespace,
) -> list[Row]:
    """Run what the file of rows has not yet; add a line for each campaign as it comes.

    Args:
        run_one: runs a campaign; at the top of its file, so that other processes find it.
        tasks: of `run_one`.
        keys: what each entry of a task is called in the row.
        options: those of `options_of`.

    Returns:
        All rows of the tasks.
    """
    tasks, version, begun = list(tasks), commit(), time.perf_counter()
    options.out.parent.mkdir(parents=True, exist_ok=True)
    kept = {tuple(row[key] for key in keys): row for row in read(options.out)}

    def late() -> bool:
        return bool(options.minutes) and time.perf_counter() - begun > 60.0 * options.minutes

    missing = [task for task in tasks if task not in kept]
    run = functools.partial(_run, run_one, reports=options.reports)
    for row in _here(run, missing, late) if options.jobs == 1 else _shared(run, missing, options.jobs, late):
        row["commit"] = version
        with options.out.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")
        head = " ".join(str(row[key]) for key in keys)
        times = f"{row['seconds']:6.1f} s ({row['processor_seconds']:6.1f} s of a core)"
        print(f"{times}  {head}  {worded(row)}", flush=True)
        kept[tuple(row[key] for key in keys)] = row
    return [kept[task] for task in tasks if task in kept]


def _run(run_one: Callable[[Task, bool], Row], task: Task, reports: bool) -> Row:
    row = run_one(task, reports)
    if crowded():
        jax.clear_caches()
    return row


def _here(run: Callable[[Task], Row], tasks: list[Task], late: Callable[[], bool]) -> Iterator[Row]:
    set_up_jax(None)
    for task in tasks:
        if late():
            return
        yield run(task)


def _shared(
    run: Callable[[Task], Row], tasks: list[Task], jobs: int, late: Callable[[], bool]
) -> Iterator[Row]:
    rest, running = iter(tasks), set[Future[Row]]()
    with ProcessPoolExecutor(jobs, multiprocessing.get_context("spawn"), set_up_jax, (None,)) as pool:
        while True:
            wanted = 0 if late() else jobs - len(running)
            running |= {pool.submit(run, task) for task in itertools.islice(rest, wanted)}
            if not running:
                return
            done, running = wait(running, return_when=FIRST_COMPLETED)
            yield from (one.result() for one in done)
