"""Print what each rule of the diagnosis decides: what changes at half and twice its value, and without it.

Run `python benchmarks/rules.py --seeds 3000:3004`, then `... --report`. Each seed is a campaign of the blind
trial, as `blind_trial.py` draws it. Its outcome is the verdict, each finding with its look-alikes, and the
laws that describe what is left. The loop runs once with the default rules, then once more for each rule at
half, at twice its value, and at one where it decides nothing. A rule that the first run never read is not
changed. A computation that reads none of the changed rules is not repeated, so that a seed takes a few times
one loop.

Rules whose meaning is a distance from one (chi2/dof, shares and quantiles near one) have that distance
halved and doubled; counts are rounded down. A line of `results/rules.jsonl` is one rule on one seed; what is
there is skipped, so that a run can be stopped and split by seeds.
"""

import argparse
import dataclasses
import json
import math
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax

from _set_up_jax import set_up_jax
from _trial_campaign import kind_of, sketch
from _trial_run import crowded, simulated
from blind_trial import commit, read
from isojax.elements import Scales
from isojax.identification import Rules, classical_guess, fit, read_campaign, scales
from isojax.identification._close_loop import find_alternatives, overall_verdict, search_effects
from isojax.identification.diagnosis import _candidate_refits, _diagnose, _imitations, findings_in
from isojax.identification.fitting import Search, thinned
from isojax.identification.traces import matching_pursuit, trace_free_laws
from isojax.models import Isolator
from isojax.records import Campaign

KEPT = Path(__file__).parent / "results" / "rules.jsonl"
FROM_ONE = ("good",)
VALUES = ("half", "twice", "without")
DEFAULTS = {field.name: field.default for field in dataclasses.fields(Rules)}
REPEATED = (
    (_diagnose, "score_test"),
    (_diagnose, "trace_free_laws"),
    (_diagnose, "transferred_share"),
    (_diagnose, "refit_to_convergence"),
    (_candidate_refits, "find_balance_start"),
    (_candidate_refits, "refit_candidate"),
    (_candidate_refits, "refit_from"),
    (_candidate_refits, "find_violation"),
    (_imitations, "score_test"),
    (_imitations, "refit_candidate"),
    (_imitations, "refit_from"),
)
"""What a diagnosis spends its time in."""

WITHOUT: dict[str, float] = {
    "good": math.inf,
    "smallest_share": 0.0,
    "smallest_gain": 0.0,
    "smallest_law": 0.0,
    "most_at_once": 100,
    "significance": 1.0,
    "close_bic": 0.0,
    "smallest_visibility": 0.0,
    "survivors": 100,
}
"""Values at which a rule decides nothing any more."""

Outcome = tuple[str, list[str]]
_readers: list[dict[str, Any]] = []
"""Of each computation in progress: the rules that it has read so far, with their values."""


class WatchedRules(Rules):
    """Rules that note who reads them."""

    def __getattribute__(self, name: str) -> Any:
        value = object.__getattribute__(self, name)
        if name in DEFAULTS:
            for reader in _readers:
                reader[name] = value
        return value


def watched(work: Callable[[], Any]) -> tuple[Any, dict[str, Any]]:
    """Do some work; give its result and the rules that it read."""
    reader: dict[str, Any] = {}
    _readers.append(reader)
    try:
        return work(), reader
    finally:
        _readers.pop()


def _key(argument: Any) -> Any:
    """Give what makes two arguments the same."""
    if isinstance(argument, Search):
        return argument.max_steps, argument.tolerance, argument.rival
    if isinstance(argument, Rules | Scales):
        return None
    if isinstance(argument, Isolator):
        return tuple((entry.name, float(entry.value)) for entry in argument.parameters)
    if isinstance(argument, tuple) and argument and hasattr(argument[0], "strength"):
        return tuple(element.name for element in argument)
    if isinstance(argument, tuple) and all(isinstance(one, str) for one in argument):
        return argument
    return argument if isinstance(argument, str | int) else id(argument)


def remembered(function: Callable[..., Any], known: list) -> Callable[..., Any]:
    """Give a function that repeats no work: same arguments, and same values of all rules that it read."""

    def call(*arguments: Any, **named: Any) -> Any:
        everything = (*arguments, *named.values())
        rules = (
            one.rules if isinstance(one, Search) else one
            for one in everything
            if isinstance(one, Search | Rules)
        )
        # What is given no rules reads none.
        values = vars(next(rules, Rules()))
        key = function.__name__, *map(_key, everything)
        entry = next(
            (
                one
                for one in known
                if one[0] == key and all(values[name] == value for name, value in one[1].items())
            ),
            None,
        )
        if entry is None:
            result, read_rules = watched(lambda: function(*arguments, **named))
            # The arguments stay alive, or another could take their identity.
            entry = key, read_rules, result, everything
            known.append(entry)
        for reader in _readers:
            reader.update(entry[1])
        return entry[2]

    return call


def changed(name: str, factor: float) -> Any:
    """Give a rule's value, or its distance from one, times a factor."""
    value = DEFAULTS[name]
    if name in FROM_ONE:
        return 1.0 + factor * (value - 1.0) if value > 1.0 else 1.0 - (1.0 - value) / factor
    if isinstance(value, tuple):
        return tuple(factor * one if isinstance(one, float) else max(1, int(factor * one)) for one in value)
    return max(1, int(factor * value)) if isinstance(value, int) else factor * value


class Trial:
    """One campaign, diagnosed again and again."""

    def __init__(self, seed: int):
        """Draw the campaign; nothing is diagnosed yet."""
        drawn = sketch(seed, kind_of(seed))
        with tempfile.TemporaryDirectory() as folder:
            self.campaign: Campaign = read_campaign(simulated(drawn, Path(folder))[1])
        self.scales = scales(self.campaign)
        self.guess = classical_guess(self.campaign)
        self.known: list = []

    def outcome(self, rules: Rules) -> Outcome:
        """Give the verdict and the names of what is found."""
        originals = [(module, name, getattr(module, name)) for module, name in REPEATED]
        try:
            for module, name, function in originals:
                setattr(module, name, remembered(function, self.known))
            guess = self.guess
            before = remembered(fit, self.known)(guess.model, self.campaign, rules=rules)
            search = Search(self.scales, rules)
            extensions, (last, beside) = search_effects(before, search, 3)
            after = extensions[-1].after if extensions else before
            found = findings_in(after.model, extensions)
            names = tuple(finding.effect for finding in found)
            beside = beside or remembered(trace_free_laws, self.known)(*thinned(after.estimate, search))
            others = find_alternatives(beside, names, rules) if names else ()
            verdict = overall_verdict(before, after, len(names), last, rules, others)
            words = [" or ".join(sorted((one.effect, *one.indistinguishable))) for one in found]
            if verdict in ("unexplained", "partly_explained"):
                left = matching_pursuit(beside, rules)
                words += [f"remainder {law.formula}" for law in left.laws]
            return verdict, words
        finally:
            for module, name, function in originals:
                setattr(module, name, function)


def run(options: argparse.Namespace) -> None:
    """Run what is not there yet."""
    first, _, stop = options.seeds.partition(":")
    version = commit()
    for seed in range(int(first), int(stop) if stop else int(first) + 1):
        done = {row["rule"] for row in read(options.out) if row["seed"] == seed}
        if done >= set(DEFAULTS):
            continue
        trial = Trial(seed)
        default, consulted = watched(lambda trial=trial: trial.outcome(WatchedRules()))
        for name in DEFAULTS:
            if name in done:
                continue
            row = {"seed": seed, "kind": kind_of(seed), "rule": name, "default": default}
            if name in consulted:
                values = {"half": changed(name, 0.5), "twice": changed(name, 2.0)}
                values |= {"without": WITHOUT[name]} if name in WITHOUT else {}
                row |= {
                    word: trial.outcome(WatchedRules(**{name: value}))
                    for word, value in values.items()
                    if word in options.values
                }
            with options.out.open("a") as file:
                file.write(json.dumps(row | {"commit": version}) + "\n")
            print(json.dumps(row), flush=True)
        if crowded():
            jax.clear_caches()


def report(rows: list[dict]) -> None:
    """Print the table."""
    heads = "".join(f"{word:>10}" for word in VALUES)
    print(f"{'rule':<24}{'half':>12}{'value':>12}{'twice':>12}{'consulted':>11}   changed at:{heads}")
    for name, value in DEFAULTS.items():
        mine = [row for row in rows if row["rule"] == name]
        consulted = [row for row in mine if len(row) > 5]
        values = "".join(f"{_brief(one):>12}" for one in (changed(name, 0.5), value, changed(name, 2.0)))
        counts = "".join(f"{_changes(consulted, word):>10}" for word in VALUES)
        print(f"{name:<24}{values}{f'{len(consulted)} of {len(mine)}':>11}{'':14}{counts}")


def _changes(rows: list[dict], word: str) -> str:
    """Count the campaigns whose outcome changed."""
    tried = [row for row in rows if word in row]
    return f"{sum(row[word] != row['default'] for row in tried)} of {len(tried)}" if tried else "-"


def _brief(value: Any) -> str:
    return ",".join(map(str, value)) if isinstance(value, tuple) else f"{value:.5g}"


def main() -> None:
    """Run, or report."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seeds", default="3000:3004", help="first:stop")
    parser.add_argument("--out", type=Path, default=KEPT, help="one line a rule and seed")
    parser.add_argument("--cache", type=Path, help="folder in which compiled code is kept between runs")
    parser.add_argument("--values", nargs="+", default=VALUES, choices=VALUES, help="which to try")
    parser.add_argument("--report", action="store_true", help="print the table of the lines that are there")
    options = parser.parse_args()
    if options.report:
        report(read(options.out))
        return
    set_up_jax(options.cache)
    run(options)


if __name__ == "__main__":
    main()
