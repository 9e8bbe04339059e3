"""The blind trial's table: each criterion, its figure, its count, its Wilson interval, PASS or FAIL."""

from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

import numpy as np

from _trial_effects import exact_class, family, known_by
from _trial_wall_time import PARTS_TIMED

Row = dict[str, Any]
CLEAR = 3.0
"""Detection limits from which an effect must be named."""

GOOD = 1.05
"""chi2/dof up to which a fit needs no explanation."""

WORTH = 0.02
"""Held-out excess, in chi2/dof, that the oracle must remove for a share of it to mean anything."""


class Mark(NamedTuple):
    """One line of the table.

    Attributes:
        criterion: in words, with its pass mark.
        figure: what came out; NaN where there was nothing to judge.
        judged: campaigns, or coefficients, that it rests on.
        interval: 95 % interval of the figure where it is a share, else None.
        passed: None where there was nothing to judge.
        failing: campaigns that speak against it, in words.
    """

    criterion: str
    figure: float
    judged: int
    interval: tuple[float, float] | None
    passed: bool | None
    failing: tuple[str, ...] = ()


def wilson(hits: int, count: int, z: float = 1.959964) -> tuple[float, float]:
    """Give the 95 % interval of a share.

    Source: Wilson 1927, J. Am. Stat. Assoc. 22:209.
    """
    if count == 0:
        return 0.0, 1.0
    share = hits / count
    centre = (share + z**2 / (2 * count)) / (1 + z**2 / count)
    half = z * np.sqrt(share * (1 - share) / count + z**2 / (4 * count**2)) / (1 + z**2 / count)
    return float(max(0.0, centre - half)), float(min(1.0, centre + half))


def _share(
    words: str,
    rows: Iterable[Row],
    holds: Callable[[Row], bool],
    passes: Callable[[float], bool],
    failing_when: bool = False,
) -> Mark:
    """Judge a share of campaigns; those where `holds` is `failing_when` are listed."""
    rows = list(rows)
    judged = [(row, "error" not in row and holds(row)) for row in rows]
    hits = sum(held for _, held in judged)
    figure = hits / len(rows) if rows else float("nan")
    failing = tuple(line(row) for row, held in judged if held == failing_when or "error" in row)
    return Mark(words, figure, len(rows), wilson(hits, len(rows)), passes(figure) if rows else None, failing)


def line(row: Row) -> str:
    """Put a campaign in one line: seed, truth, what was named, chi2/dof before and after, why."""
    if "error" in row:
        return f"seed {row['seed']:4d} {row['kind']}: {row['error'].strip().splitlines()[-1]}"
    truth = " + ".join(
        f"{one['effect']} {one['size']:.3g} ({one['limits']:.1f} limits)"
        if one["limits"] == one["limits"]
        else one["effect"]
        for one in row["truth"]
    )
    named = " + ".join("|".join(one["set"]) for one in row.get("findings", ())) or "nothing"
    text = f"seed {row['seed']:4d} {row.get('layout', row['task']):7s} {truth or 'nothing hidden'}"
    if "verdict" in row:
        text += f" -> {row['verdict']}: {named}"
    if "before" in row:
        chi2 = [row[when][role] for role in ("fit", "holdout") for when in ("before", "after")]
        text += "  chi2/dof fit {:.4g} -> {:.4g}, held out {:.4g} -> {:.4g}".format(*chi2)
    if "oracle" in row:
        text += " (oracle {fit:.4g}, {holdout:.4g})".format(**row["oracle"])
    return text + (f"  [{row['reason']}]" if row.get("reason") else "")


def names_right(row: Row) -> bool:
    """Say whether the first effect named is of the true family."""
    return bool(row["findings"]) and row["findings"][0]["effect"] in family(row["truth"][0]["effect"])


def in_set(row: Row) -> bool:
    """Say whether the true family is in the first reported set."""
    return bool(set(family(row["truth"][0]["effect"])) & set(row["findings"][0]["set"]))


def both_named(row: Row) -> bool:
    """Say whether each of two effects is in a set of its own."""
    first, second = (set(family(one["effect"])) for one in row["truth"])
    sets = [set(one["set"]) for one in row["findings"]]
    return any(
        first & one and second & other for i, one in enumerate(sets) for j, other in enumerate(sets) if i != j
    )


def removed(row: Row) -> float:
    """Give the share of the held-out excess that the oracle removes which the loop removed, too."""
    before, after, best = (row[key]["holdout"] for key in ("before", "after", "oracle"))
    return (before - after) / (before - best)


WITHIN = 2.0
"""Standard errors that the true force may lie outside of the reported range of laws."""


def admits_outside(row: Row) -> bool:
    """Say whether the loop owns up to a law outside the catalogue, or reports a range that holds it."""
    return row["verdict"] in ("unexplained", "partly_explained") or row.get("miss", float("inf")) <= WITHIN


def stays_unnamed(row: Row) -> bool:
    """Say whether a left-out effect is owned up to, or known by the names that were given."""
    known = known_by(row["truth"][0]["effect"])
    named = [one["effect"] for one in row["findings"]]
    return admits_outside(row) or (bool(named) and all(name in known for name in named))


def stays_within(row: Row) -> bool:
    """Say the same; an effect that is no force may pass as well by a range that holds the true readings."""
    return stays_unnamed(row) or row.get("reading_miss", float("inf")) <= WITHIN


def _readings(left: list[Row]) -> list[Mark]:
    """Judge left-out effects by readings as well; older rows do not have them."""
    if not any("reading_miss" in row for row in left):
        return []
    words = "the same, or the range of models holds the true readings, where the effect is no force"
    return [_share(words, left, stays_within, lambda f: f >= 0.9)]


def table(rows: list[Row]) -> list[Mark]:
    """Judge all campaigns by the criteria of the diagnosis."""
    loops = [row for row in rows if row["task"] == "loop"]
    none = [row for row in loops if row["kind"] == "none"]
    one = [row for row in loops if row["kind"] == "one" and _clear(row)]
    named = [row for row in one if row.get("findings")]
    gains = [row for row in named if len(exact_class(row["truth"][0]["effect"])) > 1 and names_right(row)]
    sizes = [len(row["findings"][0]["set"]) for row in named]
    outside = [row for row in loops if row["kind"] == "outside" and _visible(row)]
    two = [row for row in loops if row["kind"] == "two" and _clear(row) and len(row.get("truth", "xx")) == 2]
    left = [row for row in rows if row["task"] == "leave_out" and _clear(row)]
    worth = [
        row
        for row in (*one, *two)
        if row.get("oracle_converged") and row["before"]["holdout"] - row["oracle"]["holdout"] > WORTH
    ]
    shares = np.array([removed(row) for row in worth])
    wrong_sign = [
        row
        for row in rows
        if any(not f.get("signed", True) and f["strength"] < 0 for f in row.get("findings", ()))
    ]
    seconds = [row["seconds"] for row in loops if "seconds" in row]
    median = float(np.median(sizes)) if sizes else float("nan")
    marks = [
        _share(
            "an effect named where there is none, at most 5 %",
            none,
            lambda r: bool(r["findings"]),
            lambda f: f <= 0.05,
            failing_when=True,
        ),
        _share(
            "right family first, at 3 limits and more, at least 90 %", one, names_right, lambda f: f >= 0.9
        ),
        _share("truth in the first reported set, at least 98 %", named, in_set, lambda f: f >= 0.98),
        Mark("median size of that set, at most 2", median, len(sizes), None, median <= 2 if sizes else None),
        _share(
            "exact classes reported as a set, 100 %",
            gains,
            lambda r: set(exact_class(r["truth"][0]["effect"])) <= set(r["findings"][0]["set"]),
            lambda f: f == 1.0,
        ),
        _share(
            "outside the catalogue: not explained, or the range of laws holds the true force, at least 90 %",
            outside,
            admits_outside,
            lambda f: f >= 0.9,
        ),
        _share(
            "left out of the catalogue: likewise, or a name it is known by, at least 90 %",
            left,
            stays_unnamed,
            lambda f: f >= 0.9,
        ),
        *_readings(left),
        _share("two effects at once, both named, at least 70 %", two, both_named, lambda f: f >= 0.7),
        _quantile(
            "held-out excess removed against the oracle: median at least 0.95", shares, worth, 50, 0.95
        ),
        _quantile("the same: 5th percentile at least 0.8", shares, worth, 5, 0.8),
        *coverage(rows),
        Mark(
            "inadmissible sign reported as a finding, never",
            float(len(wrong_sign)),
            len(rows),
            None,
            not wrong_sign if rows else None,
            tuple(line(row) for row in wrong_sign),
        ),
    ]
    if seconds:
        marks.append(
            Mark(
                "seconds of a loop, 6 records of 32 s: median",
                float(np.median(seconds)),
                len(seconds),
                None,
                None,
            )
        )
    for row in (row for row in rows if row["task"] == "wall_time"):
        if "error" in row:
            marks.append(Mark("seconds of a loop by the clock", float("nan"), 1, None, False, (line(row),)))
            continue
        what = f"{len(row['records'])} records of {np.mean(row['records']):.0f} s at {row['rate']:.0f} Hz"
        for when, most, figures in (
            ("compile included", 60.0, row["first"]),
            ("again in the same process", 10.0, row["second"]),
        ):
            for part, figure in zip(PARTS_TIMED, figures, strict=True):
                words = f"seconds of {part}, {what}, {when}: at most {most:.0f}"
                marks.append(Mark(words, figure, 1, None, figure <= most))
    return marks


def _clear(row: Row) -> bool:
    return "error" in row or all(one["limits"] >= CLEAR for one in row["truth"])


def _visible(row: Row) -> bool:
    """Say whether an effect outside the catalogue leaves anything to explain, or was named all the same."""
    return "error" in row or row["before"]["fit"] > GOOD or bool(row["findings"])


def _quantile(words: str, shares: np.ndarray, rows: list[Row], percent: float, least: float) -> Mark:
    figure = float(np.percentile(shares, percent)) if shares.size else float("nan")
    failing = tuple(
        f"{share:.3f} {line(row)}" for share, row in zip(shares, rows, strict=True) if share < least
    )
    return Mark(words, figure, shares.size, None, figure >= least if shares.size else None, failing)


class Covered(NamedTuple):
    """How often the 95 % intervals of one effect's coefficients held the truth.

    Attributes:
        whose: the effect, or the declared coefficients beside all effects.
        inside: intervals that hold the truth.
        judged: intervals in all.
        undetermined: coefficients that got no interval, because the data do not tell them.
        scatter: rms error in standard errors.
    """

    whose: str
    inside: int
    judged: int
    undetermined: int
    scatter: float

    @property
    def mark(self) -> Mark:
        """One line of the table."""
        figure, interval = self.inside / self.judged, wilson(self.inside, self.judged)
        words = f"95 % intervals of {self.whose} cover the truth, 90-98 %"
        if self.undetermined:
            words += f" ({self.undetermined} undetermined)"
        # Few repeats cannot tell 98 from 100 %: too wide an interval shows in the interval of the share.
        passed = interval[0] <= 0.98 and interval[1] >= 0.90 and (figure >= 0.90 or self.judged < 30)
        return Mark(f"{words}; rms {self.scatter:.2f} se", figure, self.judged, interval, passed)


def covered(rows: list[Row]) -> list[Covered]:
    """Count the 95 % intervals of the true structure's coefficients, each effect's strength by itself."""
    off: dict[str, list[float]] = {}
    lost: dict[str, int] = {}
    for row in rows:
        if "off" not in row or not row["oracle_converged"]:
            continue
        hidden = {one["effect"] for one in row["truth"]}
        if not all(one["limits"] >= CLEAR for one in row["truth"]):
            continue
        for name, value in row["off"].items():
            whose = name.partition(".")[0]
            whose = whose if whose in hidden else "the six declared coefficients"
            if value is None:
                lost[whose] = lost.get(whose, 0) + 1
            else:
                off.setdefault(whose, []).append(value)
    return [
        Covered(
            whose,
            sum(abs(value) <= 1.96 for value in values),
            len(values),
            lost.get(whose, 0),
            float(np.sqrt(np.mean(np.square(values)))),
        )
        for whose, values in sorted(off.items())
    ]


def coverage(rows: list[Row]) -> list[Mark]:
    """Judge how often the intervals held the truth."""
    return [one.mark for one in covered(rows)]


def coverage_markdown(rows: list[Row]) -> list[str]:
    """Give the coverage as docs/validation.md shows it, a line an effect."""
    lines = [
        "| 95 % intervals of | cover the truth (90-98 %) | coefficients | 95 % interval | rms error, se |",
        "|---|---|---|---|---|",
    ]
    for one in covered(rows):
        low, high = wilson(one.inside, one.judged)
        figure = one.inside / one.judged
        lines.append(
            f"| {one.whose} | {figure:.3f} | {one.judged} | {low:.2f}-{high:.2f} | {one.scatter:.2f} |"
        )
    return lines


def markdown(rows: list[Row]) -> list[str]:
    """Give the table as docs/validation.md shows it, a line a criterion."""
    words = {True: "met", False: "**missed**", None: ""}
    lines = ["| criterion | figure | of | 95 % interval | |", "|---|---|---|---|---|"]
    for mark in table(rows):
        spread = "" if mark.interval is None else f"{mark.interval[0]:.2f}-{mark.interval[1]:.2f}"
        lines.append(
            f"| {mark.criterion} | {mark.figure:.3g} | {mark.judged} | {spread} | {words[mark.passed]} |"
        )
    return lines


def print_table(rows: list[Row], verbose: bool) -> bool:
    """Print the table; say whether nothing failed."""
    marks = table(rows)
    for mark in marks:
        word = {True: "PASS", False: "FAIL", None: "    "}[mark.passed]
        spread = "" if mark.interval is None else f"[{mark.interval[0]:.3f}, {mark.interval[1]:.3f}]"
        print(f"{word}  {mark.figure:8.3f}  {mark.judged:5d}  {spread:16s}  {mark.criterion}")
    if verbose:
        for mark in marks:
            if mark.failing:
                print(f"\n{mark.criterion}:")
                for text in mark.failing:
                    print(f"  {text}")
    return all(mark.passed is not False for mark in marks)
