"""The command line: close-loop, fit, effects, demo."""

import argparse
import os
import sys
import time
from collections.abc import Callable, Sequence
from importlib.metadata import version
from pathlib import Path

import jax
from rich.console import Console
from rich.text import Text

from ._results import is_successful
from .demo import campaign_folder
from .identification import Fit, classical_guess, fit, read_campaign
from .reporting import catalogue_table, check_folder, close_loop, loop_summary, model_text, write_texts

_WIDTH = 120

_NOT_CONVERGED = 1

_EXIT_CODES = (
    "Exit codes: 0 done; 1 the fit did not converge, which its report says; 2 an argument or a file is bad, "
    "and nothing is written."
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        arguments: words after the command's name; those of the process if omitted.

    Returns:
        Exit code: 0, 1 where the fit did not converge (its report is written all the same), or 2 where an
        argument or a file is bad.
    """
    jax.config.update("jax_enable_x64", True)
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
        description="Identify a nonlinear vibration isolator from time histories; name what its model lacks.",
        epilog=f"{_EXIT_CODES} ISOJAX_CACHE names a folder in which compiled code is kept between runs.",
    )
    parser.add_argument("--version", action="version", version=f"isojax {version('isojax')}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    loop = commands.add_parser("close-loop", help="fit, name what is missing, add it, report")
    _campaign(loop)
    loop.add_argument(
        "--out", required=True, metavar="DIR", help="where report.html, result.json and model.json go"
    )
    _quiet(loop)
    loop.set_defaults(run=lambda asked: _close_loop(asked.campaign, asked.out, asked.quiet))

    single = commands.add_parser("fit", help="fit the declared model and print its report")
    _campaign(single)
    single.add_argument("--out", metavar="DIR", help="where model.json and fit.txt go")
    _quiet(single)
    single.set_defaults(run=lambda asked: _fit(asked.campaign, asked.out, asked.quiet))

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
        write_texts(folder, {"model.json": model_text(fitted.model), "fit.txt": report + "\n"})
    print(report)
    print(f"{time.perf_counter() - begin:.1f} s with compiling")
    return _exit_code(fitted)


def _exit_code(fitted: Fit) -> int:
    return 0 if is_successful(fitted.result) else _NOT_CONVERGED


def _effects() -> int:
    _results().print(catalogue_table())
    return 0
