"""The command line: inspect, close-loop, fit, map, effects, demo."""

import argparse
import contextlib
import json
import math
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ._arguments import MAP_STEPS, command_line, in_options
from ._interrupt import INTERRUPTED, prompt_interrupt
from ._languages import printable
from ._output_folder import KeptElsewhereError, check_folder, discard, kept_file, output_folder
from ._progress import LOOP_SHARES, Counted, KeyFigure, Notice, Stage, before, silent, watched
from ._quantities import CONDITIONS

if TYPE_CHECKING:
    import numpy as np
    from rich.console import Console

    from .identification import Fit, SavedFit
    from .inference import NextRecord
    from .models import Isolator
    from .records import Campaign

# Each command imports what it needs when it needs it: a bad argument or file is refused before JAX or
# matplotlib has started.

_TERMINAL = 120

_NOT_CONVERGED = 1

_WRITTEN_ELSEWHERE = 3

_READING, _REPORT = 2.0, 30.0
"""Usual shares of the time of a loop, beside `LOOP_SHARES`."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        arguments: words after the command's name; those of the process if omitted.

    Returns:
        Exit code: 0, 1 where the fit or every cell of the map did not converge (what was found is written all
        the same), 2 where an argument or a file is bad, 3 where the results had to be written elsewhere, 130
        after Ctrl-C.
    """
    commands = {"inspect": _inspect, "close-loop": _close_loop, "fit": _fit, "map": _map, "effects": _effects}
    asked = command_line(commands).parse_args(arguments)
    asked.kept = lambda: "nothing is written"
    try:
        with prompt_interrupt(lambda: f"interrupted; {asked.kept()}"):
            return asked.run(asked)
    except (ValueError, OSError) as error:
        print(printable(f"isojax: {in_options(' '.join(str(error).split()), asked)}"), file=sys.stderr)
        return _WRITTEN_ELSEWHERE if isinstance(error, KeptElsewhereError) else 2
    except KeyboardInterrupt:
        print(f"isojax: interrupted; {asked.kept()}", file=sys.stderr)
        return INTERRUPTED


def _start_jax() -> None:
    """Set how JAX computes and compiles, before it is first asked to."""
    import jax

    from ._compiling import compile_quickly, compiled_code_folder

    jax.config.update("jax_enable_x64", True)
    compile_quickly()
    folder = compiled_code_folder()
    if folder is not None:
        jax.config.update("jax_compilation_cache_dir", str(folder))
        # To read code back takes a hundredth of a second, about as long as to compile the least of it.
        jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.1)


def _progress(asked: argparse.Namespace) -> contextlib.AbstractContextManager[Callable[[str], None]]:
    """Give what shows progress on stderr: a line a stage, every step of it, or nothing."""
    from rich.console import Console

    from ._stage_lines import stage_lines

    if asked.quiet:
        return contextlib.nullcontext(silent)
    return stage_lines(Console(stderr=True, highlight=False), steps=asked.verbose)


def _results(asked: argparse.Namespace) -> "Console":
    """Give what shows results; where no terminal reports its width, wide enough for every table.

    Where the result itself is printed words go to stderr, or nowhere where they are not wanted.
    """
    from rich.console import Console

    out = sys.stderr if asked.json else sys.stdout
    quiet = asked.json and getattr(asked, "quiet", False)
    return Console(file=out, highlight=False, width=None if out.isatty() else _TERMINAL, quiet=quiet)


def _print_json(asked: argparse.Namespace, content: Callable[[], object]) -> None:
    if asked.json:
        print(json.dumps(content(), indent=1, allow_nan=False))


def _inspect(asked: argparse.Namespace) -> int:
    from .records import draft_campaign, find_data_files, inspect_file

    if asked.rate is not None and not 0.0 < asked.rate < math.inf:
        raise ValueError(f"--rate must be a finite number above 0 [Hz], but is {asked.rate:g}.")
    if asked.draft is not None and Path(asked.draft).exists():
        raise ValueError(f"--draft {asked.draft} exists already; it is not overwritten.")
    found, schedules = find_data_files(asked.files)
    files = []
    with _progress(asked) as progress:
        progress(Stage("inspection"))
        for file in found:
            progress(Counted(str(file), len(files) / len(found)))
            files.append(inspect_file(file, asked.rate))
        progress(KeyFigure("1 file read" if len(files) == 1 else f"{len(files)} files read"))

    from . import plot
    from ._read_campaign import read_campaign
    from .models import write_whole
    from .reporting import inspection_dict, inspection_summary, png_bytes

    for target in (Path(one) for one in (asked.picture, asked.draft) if one is not None):
        check_folder(target.parent)
    console = _results(asked)
    console.print(inspection_summary(files))
    _print_json(asked, lambda: [inspection_dict(one) for one in files])
    if asked.draft is not None:
        draft = Path(asked.draft)
        drafted = draft_campaign(files, draft.parent, schedules)
        draft.parent.mkdir(parents=True, exist_ok=True)
        write_whole(draft, drafted)
        try:
            count = len(read_campaign(draft).records)
            _say(console, f"{draft}: {count} records are read by it. Check what it says was guessed.")
        except ValueError as error:
            _say(console, f"{draft} is written, but must be mended: {error}")
    if asked.picture is not None:
        picture = Path(asked.picture)
        drawn = png_bytes(plot.inspection(files))
        picture.parent.mkdir(parents=True, exist_ok=True)
        write_whole(picture, drawn)
        _say(console, f"see {asked.picture}")
    return 0


def _say(console: "Console", words: str) -> None:
    from ._languages import as_rich

    console.print(as_rich(words, keep="\n"), soft_wrap=True)


def _close_loop(asked: argparse.Namespace) -> int:
    from .records import refuse_contradictions

    begin = time.perf_counter()
    with output_folder(asked.out) as folder, _progress(asked) as progress:
        progress(Stage("reading of the campaign", _READING, (*LOOP_SHARES, _REPORT)))
        measured = _read(asked.campaign, progress)
        if not asked.anyway:
            refuse_contradictions(measured)

        from .reporting import close_loop, loop_summary, result_dict

        _start_jax()
        kept = _kept(asked, folder, progress)
        try:
            loop = close_loop(measured, progress=before(progress, _REPORT), anyway=True, checkpoint=kept)
        except ValueError:
            discard(folder)  # the same would be refused again
            raise
        progress(Stage("report", _REPORT))
        with watched(progress):
            loop.report(folder, markdown=asked.markdown)
        discard(folder)
        asked.kept = lambda: f"the results are in {folder}"
    console = _results(asked)
    console.print(loop_summary(loop.loop))
    _say(console, f"{time.perf_counter() - begin:.1f} s with compiling; see {folder / 'report.html'}")
    _print_json(asked, lambda: result_dict(loop.loop, loop.health))
    return _exit_code(loop.after)


def _kept(asked: argparse.Namespace, folder: Path, progress: Callable[[str], None]) -> Path:
    """Give the file in which the loop keeps its answers; those of an earlier run only where asked for."""
    kept = kept_file(folder)
    if asked.resume and not kept.exists():
        progress(Notice(f"no unfinished run is kept in {folder}: beginning anew"))
    if kept.exists() and not asked.resume:
        progress(Notice(f"what an unfinished run kept in {folder} is not used without --resume"))
        discard(folder)
    asked.kept = lambda: (
        f"what is finished is kept in {folder}; --resume goes on from there"
        if kept.exists()
        else "nothing is written"
    )
    return kept


def _read(campaign: str | Path, progress: Callable[[str], None]) -> "Campaign":
    from ._read_campaign import read_campaign

    measured = read_campaign(campaign)
    progress(KeyFigure(f"{len(measured.records)} records read, {measured.timing}"))
    return measured


def _fit(asked: argparse.Namespace) -> int:
    from .records import find_suspicions, refuse_contradictions

    begin, guessing, fitting = time.perf_counter(), *LOOP_SHARES[:2]
    where = contextlib.nullcontext(None) if asked.out is None else output_folder(asked.out)
    with where as folder, _progress(asked) as progress:
        progress(Stage("reading of the campaign", _READING, (guessing, fitting)))
        measured = _read(asked.campaign, progress)
        if not asked.anyway:
            refuse_contradictions(measured)

        from .identification import classical_guess, fit, fit_report
        from .reporting import (
            check_first_dicts,
            check_first_words,
            fit_text,
            model_text,
            write_model_files,
        )

        _start_jax()
        progress(Stage("classical guess", guessing, (fitting,)))
        guess = classical_guess(measured)
        progress(KeyFigure(" ".join(guess.notes)))
        progress(Stage("fit of the declared model", fitting))
        fitted = fit(guess.model, measured, progress=progress, anyway=asked.anyway)
        progress(KeyFigure(f"chi2/dof {fitted.stats.chi2 / fitted.stats.dof:.4g}"))
        report = "\n".join((*check_first_words(find_suspicions(measured)), fit_report(fitted)))
        if folder is not None:
            texts = {"model.json": model_text(fitted), "fit.json": fit_text(fitted)}
            write_model_files(folder, {**texts, "fit.txt": report + "\n"})
    console = _results(asked)
    _say(console, report)
    _say(console, f"{time.perf_counter() - begin:.1f} s with compiling")
    _print_json(
        asked, lambda: {"check_first": check_first_dicts(find_suspicions(measured))} | fitted.to_dict()
    )
    return _exit_code(fitted)


def _map(asked: argparse.Namespace) -> int:
    amplitudes = _values("--amplitudes", asked.amplitudes)
    frequencies = _values("--frequencies", asked.frequencies)
    _start_jax()

    from .models import fit_at, load_model

    model = load_model(asked.model)
    fit, whose = _fit_beside(Path(asked.model), model, asked.next_record) if asked.chances else (None, "")
    stated = {name: getattr(asked, name) for name in CONDITIONS if getattr(asked, name) is not None}
    model, fit = model.at(**stated), None if fit is None else fit_at(fit, **stated)
    whose = "; ".join(filter(None, (whose, fit.untested if fit else "")))

    import numpy as np

    from .reporting import folds_around, map_dict, map_summary, write_map
    from .stability import stability_map

    seconds, watch = {}, _stopwatch()
    with output_folder(asked.out) as folder, _progress(asked) as progress:
        if asked.checkpoint is not None:
            asked.kept = lambda: (
                f"finished chunks are kept in {asked.checkpoint}; the same command goes on from them"
            )
        progress(Stage("periodic orbits over drive amplitude and frequency", to_come=(0.0,)))
        smap = stability_map(
            model,
            amplitudes,
            frequencies,
            coexisting=asked.coexisting,
            checkpoint=asked.checkpoint,
            progress=progress,
            fit=fit,
        )
        several = int(np.count_nonzero(np.asarray(smap.count) > 1))
        progress(KeyFigure(f"{smap.count.size} cells, {several} with several orbits"))
        seconds["map"] = watch()
        folds = None
        if several and asked.folds:
            progress(Stage("folds around the cells with several orbits", to_come=(0.0,)))
            folds = folds_around(smap, fit)
            seconds["folds"] = watch()
        progress(Stage("pictures"))
        written = write_map(smap, folder, folds=folds)
        seconds["pictures"] = watch()
    console = _results(asked)
    _say(console, map_summary(smap, folds=folds, seconds=seconds, whose=whose))
    _say(console, f"see {', '.join(str(folder / name) for name in written)}")
    _print_json(asked, lambda: map_dict(smap, folds))
    return 0 if np.any(np.asarray(smap.count)) else _NOT_CONVERGED


def _fit_beside(
    path: Path, model: "Isolator", calibration: float | None
) -> "tuple[SavedFit | NextRecord | None, str]":
    """Give the fit that was saved beside a model, where it is of this model and its errors can be carried,
    and whose errors these are in words; with a calibration, that of a further record.
    """
    beside = path.with_name("fit.json")
    if not beside.exists():
        if calibration is not None:
            raise ValueError(f"--next-record needs the fit beside the model, but there is no {beside}.")
        return None, ""

    from .identification import load_fit
    from .inference import next_record
    from .models import coefficient_errors

    try:
        fit = load_fit(beside)
        coefficient_errors(fit, model)
        if calibration is not None:
            further = next_record(fit, calibration=calibration)
            return further, further.words
    except ValueError as problem:
        if calibration is not None:
            raise ValueError(f"--next-record needs another fit than {beside}. {problem}") from problem
        print(f"The map has no chances: {beside} cannot serve. {problem}", file=sys.stderr)
        return None, ""
    return fit, "of the mean over all fitted records"


def _values(option: str, words: Sequence[str]) -> "np.ndarray":
    """Give the values along one side of a map."""
    import numpy as np

    start, stop, count = math.nan, math.nan, 0
    if 2 <= len(words) <= 3:
        with contextlib.suppress(ValueError):
            start, stop, count = float(words[0]), float(words[1]), int((*words, MAP_STEPS)[2])
    if count < 2 or not 0.0 < start < stop < math.inf:
        raise ValueError(
            f"{option} must be START STOP [COUNT], two ascending positive numbers and a count of at least 2, "
            f"but is {' '.join(words)}."
        )
    return np.linspace(start, stop, count)


def _stopwatch() -> Callable[[], tuple[float, float]]:
    """Give what measures the seconds since its last call: compiling, and everything else."""
    from .reporting import compile_seconds

    last = [compile_seconds(), time.perf_counter()]

    def watch() -> tuple[float, float]:
        now = [compile_seconds(), time.perf_counter()]
        compiling, wall = (later - earlier for later, earlier in zip(now, last, strict=True))
        last[:] = now
        return compiling, max(0.0, wall - compiling)

    return watch


def _exit_code(fitted: "Fit") -> int:
    from ._results import is_successful

    return 0 if is_successful(fitted.result) else _NOT_CONVERGED


def _effects(asked: argparse.Namespace) -> int:
    from .reporting import catalogue_table

    _results(asked).print(catalogue_table())
    return 0
