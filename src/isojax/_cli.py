"""The command line: close-loop, fit, map, effects, demo."""

import argparse
import contextlib
import math
import os
import sys
import time
from collections.abc import Callable, Sequence
from importlib.metadata import version
from pathlib import Path

import jax
import numpy as np
from rich.console import Console
from rich.text import Text

from ._compiling import compile_quickly
from ._results import is_successful
from .demo import campaign_folder
from .identification import Fit, classical_guess, fit, read_campaign
from .models import load_model
from .reporting import (
    catalogue_table,
    check_folder,
    close_loop,
    compile_seconds,
    folds_around,
    loop_summary,
    map_summary,
    model_text,
    write_map,
    write_texts,
)
from .stability import stability_map

_WIDTH = 120

_NOT_CONVERGED = 1

_CELLS = 200
"""Values along each side of a map, if not told."""

_EXIT_CODES = (
    "Exit codes: 0 done; 1 the fit did not converge, or no cell of a map did, which the report says; 2 an "
    "argument or a file is bad, and nothing is written."
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        arguments: words after the command's name; those of the process if omitted.

    Returns:
        Exit code: 0, 1 where the fit or every cell of the map did not converge (what was found is written all
        the same), or 2 where an argument or a file is bad.
    """
    jax.config.update("jax_enable_x64", True)
    compile_quickly()
    cache = os.environ.get("ISOJAX_CACHE")
    if cache:
        jax.config.update("jax_compilation_cache_dir", cache)
    asked = _parser().parse_args(arguments)
    try:
        return asked.run(asked)
    except (ValueError, OSError) as error:
        print(f"isojax: {' '.join(str(error).split())}", file=sys.stderr)
        return 2


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="isojax",
        description="Identify a nonlinear vibration isolator from time histories; name what its model lacks; "
        "map the stability of its periodic response.",
        epilog=f"{_EXIT_CODES} ISOJAX_CACHE names a folder in which compiled code is kept between runs.",
    )
    parser.add_argument("--version", action="version", version=f"isojax {version('isojax')}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    loop = commands.add_parser("close-loop", help="fit, name what is missing, add it, report")
    _campaign(loop)
    loop.add_argument(
        "--out",
        required=True,
        metavar="DIR",
        help="where report.html, result.json and model.json go (no model after a failed fit)",
    )
    _quiet(loop)
    loop.set_defaults(run=lambda asked: _close_loop(asked.campaign, asked.out, asked.quiet))

    single = commands.add_parser("fit", help="fit the declared model and print its report")
    _campaign(single)
    single.add_argument(
        "--out", metavar="DIR", help="where model.json (not after a failed fit) and fit.txt go"
    )
    _quiet(single)
    single.set_defaults(run=lambda asked: _fit(asked.campaign, asked.out, asked.quiet))

    plane = commands.add_parser(
        "map",
        help="find the periodic orbits over drive amplitude and frequency, and whether they are stable",
        description="Find the periodic orbits of a model over a grid of drive amplitude and frequency, and "
        "their Floquet multipliers. Writes map.npz (all arrays, SI units), map.png (largest multiplier), "
        "response.png and, where orbits coexist, folds.png; prints a summary.",
        epilog=_EXIT_CODES,
    )
    plane.add_argument("model", metavar="MODEL.json", help="as close-loop, fit and save_model write it")
    _axis(plane, "amplitudes", "drive amplitudes [N, or m/s^2 for base excitation]")
    _axis(plane, "frequencies", "drive frequencies [Hz]")
    plane.add_argument(
        "--coexisting", action="store_true", help="all orbits of a cell, not only that of the smallest motion"
    )
    plane.add_argument("--out", default="isojax-map", metavar="DIR", help="default: ./isojax-map")
    plane.add_argument(
        "--checkpoint",
        metavar="DIR",
        help="keep finished chunks here; a run that was killed goes on from them",
    )
    _quiet(plane)
    plane.set_defaults(run=_map)

    effects = commands.add_parser("effects", help="list the effects that can be named")
    effects.set_defaults(run=lambda asked: _effects())

    demo = commands.add_parser("demo", help="close-loop on the campaign in the package")
    demo.add_argument("--out", default="isojax-demo", metavar="DIR", help="default: ./isojax-demo")
    _quiet(demo)
    demo.set_defaults(run=lambda asked: _close_loop(campaign_folder(), asked.out, asked.quiet))
    return parser


def _campaign(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("campaign", metavar="CAMPAIGN", help="campaign.toml or its folder")


def _quiet(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--quiet", action="store_true", help="no lines of progress")


def _axis(parser: argparse.ArgumentParser, name: str, words: str) -> None:
    parser.add_argument(
        f"--{name}",
        required=True,
        nargs="+",
        metavar=("START STOP", "COUNT"),
        help=f"{words}; COUNT equal steps apart, {_CELLS} if not told",
    )


def _progress(quiet: bool) -> Callable[[str], None]:
    """Give what shows a line of progress, with the seconds since the start, on stderr."""
    console, begin = Console(stderr=True, highlight=False), time.perf_counter()

    def show(line: str) -> None:
        if not quiet:
            console.print(Text(f"{time.perf_counter() - begin:7.1f} s  {line}", style="dim"))

    return show


def _results() -> Console:
    """Give what shows results; where no terminal tells its width, wide enough for every table."""
    return Console(highlight=False, width=None if sys.stdout.isatty() else _WIDTH)


def _close_loop(campaign: str | Path, out: str, quiet: bool) -> int:
    begin, folder = time.perf_counter(), check_folder(out)
    measured, progress = read_campaign(campaign), _progress(quiet)
    progress(f"{len(measured.records)} records read")
    loop = close_loop(measured, progress=progress)
    progress("writing the report")
    loop.report(folder)
    console = _results()
    console.print(loop_summary(loop.loop))
    console.print(Text(f"{time.perf_counter() - begin:.1f} s with compiling; see {folder / 'report.html'}"))
    return _exit_code(loop.after)


def _fit(campaign: str | Path, out: str | None, quiet: bool) -> int:
    begin = time.perf_counter()
    folder = None if out is None else check_folder(out)
    measured, progress = read_campaign(campaign), _progress(quiet)
    guess = classical_guess(measured)
    progress(f"{len(measured.records)} records read")
    for note in guess.notes:
        progress(note)
    fitted = fit(guess.model, measured, progress=progress)
    report = str(fitted)
    if folder is not None:
        write_texts(folder, {"model.json": model_text(fitted), "fit.txt": report + "\n"})
    print(report)
    print(f"{time.perf_counter() - begin:.1f} s with compiling")
    return _exit_code(fitted)


def _map(asked: argparse.Namespace) -> int:
    folder, model = check_folder(asked.out), load_model(asked.model)
    amplitudes = _values("--amplitudes", asked.amplitudes)
    frequencies = _values("--frequencies", asked.frequencies)
    progress = _progress(asked.quiet)
    seconds, watch = {}, _stopwatch()
    smap = stability_map(
        model,
        amplitudes,
        frequencies,
        coexisting=asked.coexisting,
        checkpoint=asked.checkpoint,
        progress=progress,
    )
    seconds["map"] = watch()
    folds = None
    if np.any(np.asarray(smap.count) > 1):
        progress("following the folds around cells with several orbits")
        folds = folds_around(smap)
        seconds["folds"] = watch()
    progress("drawing")
    written = write_map(smap, folder, folds=folds)
    seconds["pictures"] = watch()
    print(map_summary(smap, folds=folds, seconds=seconds))
    print(f"see {', '.join(str(folder / name) for name in written)}")
    return 0 if np.any(np.asarray(smap.count)) else _NOT_CONVERGED


def _values(option: str, words: Sequence[str]) -> np.ndarray:
    """Give the values along one side of a map."""
    start, stop, count = math.nan, math.nan, 0
    if 2 <= len(words) <= 3:
        with contextlib.suppress(ValueError):
            start, stop, count = float(words[0]), float(words[1]), int((*words, _CELLS)[2])
    if count < 2 or not 0.0 < start < stop < math.inf:
        raise ValueError(
            f"{option} must be START STOP [COUNT], two ascending positive numbers and a count of at least 2, "
            f"but is {' '.join(words)}."
        )
    return np.linspace(start, stop, count)


def _stopwatch() -> Callable[[], tuple[float, float]]:
    """Give what tells the seconds since it was last asked: compiling, and everything else."""
    last = [compile_seconds(), time.perf_counter()]

    def watch() -> tuple[float, float]:
        now = [compile_seconds(), time.perf_counter()]
        compiling, wall = (later - earlier for later, earlier in zip(now, last, strict=True))
        last[:] = now
        return compiling, max(0.0, wall - compiling)

    return watch


def _exit_code(fitted: Fit) -> int:
    return 0 if is_successful(fitted.result) else _NOT_CONVERGED


def _effects() -> int:
    _results().print(catalogue_table())
    return 0
