"""The words of the command line: commands, options, help."""

import argparse
import contextlib
import math
import re
from collections.abc import Callable, Mapping
from importlib.metadata import version

from ._quantities import CONDITIONS
from .demo import campaign_folder

Command = Callable[[argparse.Namespace], int]

MAP_STEPS = 200
"""Values along each side of a map, if omitted."""

_PASSED_ON = ("amplitudes", "frequencies", "coexisting", "checkpoint", *CONDITIONS)
"""Options that go to a function as arguments of the same name."""

_EXIT_CODES = (
    "Exit codes: 0 done; 1 the fit did not converge, or no cell of a map did, which the report says; 2 an "
    "argument or a file is bad, or the records contradict campaign.toml; nothing is written then; 3 the "
    "results could not be written where they were asked for, and the message says which folder has them; 130 "
    "interrupted."
)


def command_line(commands: Mapping[str, Command]) -> argparse.ArgumentParser:
    """Give what reads the words behind `isojax`.

    Args:
        commands: what each command runs, by its name; each takes the arguments that were read as attributes
            and gives the exit code.

    Returns:
        A parser; the command's function is the attribute `run`.
    """
    parser = argparse.ArgumentParser(
        prog="isojax",
        description="Identify a nonlinear vibration isolator from time histories; name what its model lacks; "
        "map the stability of its periodic response.",
        epilog=f"{_EXIT_CODES} Compiled code is kept between runs, in isojax of the user's cache folder or "
        "in the folder that ISOJAX_CACHE names; an empty ISOJAX_CACHE keeps none.",
    )
    parser.add_argument("--version", action="version", version=f"isojax {version('isojax')}")
    known = parser.add_subparsers(required=True, metavar="COMMAND")

    seen = known.add_parser(
        "inspect",
        help="list what is in data files, draft a campaign.toml",
        description="List channels, units, ranges, rates, flaws and the kind of excitation of data files "
        "that no campaign.toml describes yet. Units and quantities come from headings and names.",
        epilog=_EXIT_CODES,
    )
    seen.add_argument("files", nargs="+", metavar="FILE", help="data files, or folders of them")
    seen.add_argument(
        "--rate", type=float, metavar="HZ", help="samples per second, where no file states them"
    )
    seen.add_argument(
        "--picture", metavar="PATH", help="draw drive, response and spectra of each file (.png)"
    )
    seen.add_argument(
        "--draft", metavar="PATH", help="write a campaign.toml there, each guess of it marked `# guessed`"
    )
    _json(seen, "what is in the files")
    _shown(seen)
    seen.set_defaults(run=commands["inspect"])

    loop = known.add_parser("close-loop", help="fit, name what is missing, add it, report")
    _campaign(loop)
    loop.add_argument(
        "--out",
        required=True,
        metavar="DIR",
        help="where report.html, result.json, model.json and fit.json go (the last two not after a failed "
        "fit); what an earlier run of isojax wrote there goes, other files stay",
    )
    _resume(loop)
    _json(loop, "the content of result.json")
    _markdown(loop)
    _shown(loop)
    loop.set_defaults(run=commands["close-loop"])

    single = known.add_parser("fit", help="fit the declared model and print its report")
    _campaign(single)
    single.add_argument(
        "--out", metavar="DIR", help="where model.json and fit.json (not after a failed fit) and fit.txt go"
    )
    _json(single, "the fit as `fit.save` writes it")
    _shown(single)
    single.set_defaults(run=commands["fit"])

    plane = known.add_parser(
        "map",
        help="find the periodic orbits over drive amplitude and frequency, and whether they are stable",
        description="Find the periodic orbits of a model over a grid of drive amplitude and frequency, and "
        "their Floquet multipliers. Writes map.npz (all arrays, SI units), curves.png (response over "
        "frequency, dashed where unstable, with its 95 % band where chances are given), map.png (largest "
        "multiplier), response.png and, with --folds where orbits coexist, folds.png; prints a summary.",
        epilog=_EXIT_CODES,
    )
    plane.add_argument("model", metavar="MODEL.json", help="as close-loop, fit and save_model write it")
    _axis(plane, "amplitudes", "drive amplitudes [N, or m/s^2 for base excitation]")
    _axis(plane, "frequencies", "drive frequencies [Hz]")
    for condition, unit in CONDITIONS.items():
        plane.add_argument(
            f"--{condition}",
            type=float,
            metavar="VALUE",
            help=f"absolute {condition} [{unit}] of the map, where a coefficient of the model follows it",
        )
    plane.add_argument(
        "--coexisting",
        action=argparse.BooleanOptionalAction,
        default=True,
        help="all orbits of a cell, or only that of the smallest motion; default: all",
    )
    plane.add_argument(
        "--folds",
        action="store_true",
        help="follow the curve of folds around cells with several orbits; takes a few times as long",
    )
    plane.add_argument(
        "--chances",
        action=argparse.BooleanOptionalAction,
        default=True,
        help="the chance of each cell to be stable and to hold several orbits, from the errors in the "
        "fit.json that close-loop and fit write beside the model; takes some 13 times as long; default: "
        "where there is one",
    )
    plane.add_argument(
        "--next-record",
        nargs="?",
        const=0.0,
        type=_share,
        metavar="CALIBRATION",
        help="chances of what a further record shows: its own linear stiffness, which deviates as those of "
        "the fitted records do, and a force known to a share of CALIBRATION (0.005 is 0.5 %%); default: of "
        "the mean over all records; the summary says which, and gives the standard errors",
    )
    plane.add_argument("--out", default="isojax-map", metavar="DIR", help="default: ./isojax-map")
    plane.add_argument(
        "--checkpoint",
        metavar="DIR",
        help="keep finished chunks here; a run that was killed goes on from them",
    )
    _json(plane, "grid, count of orbits and largest multiplier of each cell, folds")
    _shown(plane)
    plane.set_defaults(run=commands["map"])

    effects = known.add_parser("effects", help="list the effects that can be named")
    effects.set_defaults(run=commands["effects"], json=False)

    demo = known.add_parser("demo", help="close-loop on the campaign in the package")
    demo.add_argument("--out", default="isojax-demo", metavar="DIR", help="default: ./isojax-demo")
    _resume(demo)
    _json(demo, "the content of result.json")
    _markdown(demo)
    _shown(demo)
    demo.set_defaults(run=commands["close-loop"], campaign=campaign_folder(), anyway=False)
    return parser


def in_options(words: str, asked: argparse.Namespace) -> str:
    """Give a message about arguments of a function as one about the options that set them.

    Args:
        words: the message.
        asked: the arguments that were read.

    Returns:
        The message; what no option sets keeps its name.
    """

    def option(found: re.Match[str]) -> str:
        return f"--{found[1]}" if found[1] in _PASSED_ON and hasattr(asked, found[1]) else found[0]

    return re.sub(r"Argument `(\w+)`", option, words)


def _share(text: str) -> float:
    """Read a share of 0 or above."""
    with contextlib.suppress(ValueError):
        if 0.0 <= float(text) < math.inf:
            return float(text)
    raise argparse.ArgumentTypeError(f"must be a share of 0 or above, such as 0.005, but is {text}")


def _campaign(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("campaign", metavar="CAMPAIGN", help="campaign.toml or its folder")
    parser.add_argument(
        "--anyway", action="store_true", help="fit even where the records contradict their declaration"
    )


def _resume(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--resume",
        action="store_true",
        help="go on from what an interrupted or killed run into the same folder has finished; the result is "
        "the same, digit for digit",
    )


def _json(parser: argparse.ArgumentParser, words: str) -> None:
    parser.add_argument(
        "--json", action="store_true", help=f"print {words} as JSON on stdout; all words go to stderr"
    )


def _markdown(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--markdown", action="store_true", help="write report.md as well, with its pictures beside it"
    )


def _shown(parser: argparse.ArgumentParser) -> None:
    shown = parser.add_mutually_exclusive_group()
    shown.add_argument(
        "--verbose", action="store_true", help="a line for every step, not only for every stage"
    )
    shown.add_argument("--quiet", action="store_true", help="no lines of progress")


def _axis(parser: argparse.ArgumentParser, name: str, words: str) -> None:
    parser.add_argument(
        f"--{name}",
        required=True,
        nargs="+",
        metavar=("START STOP", "COUNT"),
        help=f"{words}; COUNT equal steps apart, {MAP_STEPS} if omitted",
    )
