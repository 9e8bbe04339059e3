"""Ask whether effects could be named by the density of data left out, in place of Schwarz's criterion.

Run `python benchmarks/predictive_density.py --seeds 12000:12050 --out density.jsonl`, then `... --report
density.jsonl`. A run can be stopped at any time and goes on where it stopped. About 10 s a campaign and core.

The campaigns are those of the blind trial, and with `--flaws` innocent ones of `innocents.py`. Each is fitted
and diagnosed once. For the fit, and for each refit that nothing speaks against, the log density of every
segment (of every record) is predicted from all others:

    -1/2 r' (I + J C J')^-1 r - 1/2 log det(I + J C J'),

r being its whitened residual at the coefficients without it, J its slopes, C the covariance of those
coefficients: one linear step from the common fit. The gain of an effect is the sum of the differences to the
fit without it; its standard error is that of a sum of independent differences, as they scatter from segment
to segment. A name stands where the gain is above two of them, and another effect is as good where it falls
short of the best by less than two.

The report counts, of campaigns that hide one effect of the catalogue at three times the detection limit and
more: those whose best effect stands, by segments, by records and by what is in use; of others those where
something stands; and how often the sets of the two ways agree.

Source: Vehtari, Gelman & Gabry 2017, Stat. Comput. 27:1413 (leave-one-out density, its standard error).
"""

import argparse
import json
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from _set_up_jax import set_up_jax
from _trial_campaign import kind_of, sketch
from _trial_effects import family
from _trial_run import simulated
from blind_trial import commit, read
from innocents import filed
from isojax._progress import silent
from isojax.identification import Rules, read_campaign
from isojax.identification.diagnosis._candidate_refits import refit_candidates
from isojax.identification.diagnosis._diagnose import case_of, weigh_refits
from isojax.identification.diagnosis._evidence import by_evidence, smallest_inflation
from isojax.identification.diagnosis._refit import bic, least_difference
from isojax.identification.fitting import (
    DEFAULT_SOLVER,
    Estimate,
    fit_by_output,
    one_hot,
    search_of,
    weighted_by_output,
)
from isojax.identification.fitting._elimination import _without_states
from isojax.identification.guess import classical_guess
from isojax.identification.jacobian import Unknowns, information
from isojax.models import as_isolator

Row = dict[str, Any]

KNOWN_BEFORE = 1e-3
"""Standard errors of the coefficients with all data, over those before any: hardly anything is known."""

ENOUGH = 3.0
"""Detection limits from which an effect must be named."""


def predicted(found: Estimate, inflation: float, by_record: bool) -> Float[np.ndarray, " part"]:
    """Give the log density of each segment, or record, as all others predict it.

    Args:
        found: the estimate.
        inflation: factor on the squared noise.
        by_record: whether records are left out, and not segments.

    Returns:
        The log densities, up to what all models share.
    """
    simulator, old = found.simulator, found.point.nuisances
    owner = np.array([segment.record for segment in found.problem.segments])
    carried = len(found.model.elements)
    prepared = simulator.prepared(found.model, carried)
    starts, scales = simulator.starts(found.model, prepared, carried)
    known = np.sqrt(1.0 / np.maximum(np.diag(found.point.reduced.matrix)[:-1], 1e-300))
    directions = one_hot(found.model, found.places, list(known))
    states = starts + scales * np.vstack(
        [old.states.T, np.zeros((len(starts) - old.states.shape[1], len(starts.T)))]
    )
    unknowns = Unknowns(found.model, directions, old.factor(prepared.record), states, scales)
    products = information(unknowns, prepared)[: owner.size]
    products = products / np.array([found.problem.noise[place] ** 2 for place in owner])[:, None, None]
    count, size = len(known), old.states.shape[1]
    scaled = products.shape[1] - count - size - 1
    held = np.zeros(owner.size, dtype=bool)
    parts = _without_states(products, None, count + scaled, old.states[: owner.size], held)[0] / inflation
    # The stiffness of each record stays as it was found.
    parts = np.delete(np.delete(parts, range(count, count + scaled), 1), range(count, count + scaled), 2)
    if by_record:
        groups = [owner == place for place in np.unique(owner)]
        parts = np.array([parts[group].sum(axis=0) for group in groups])
    whole = parts.sum(axis=0) + KNOWN_BEFORE**2 / inflation * np.eye(count + 1)
    densities = []
    for part in parts:
        others = whole - part
        step = np.linalg.solve(others[:count, :count], others[:count, -1])
        slopes = part[:count, :count]
        error = part[:count, -1] - slopes @ step
        square = part[-1, -1] - 2.0 * step @ part[:count, -1] + step @ slopes @ step
        square -= error @ np.linalg.solve(whole[:count, :count], error)
        volume = [np.linalg.slogdet(matrix[:count, :count])[1] for matrix in (whole, others)]
        densities.append(-0.5 * (square + volume[0] - volume[1]))
    return np.array(densities)


def gain(better: Float[np.ndarray, " part"], worse: Float[np.ndarray, " part"]) -> tuple[float, float]:
    """Give the gain in log density and its standard error."""
    difference = better - worse
    return float(difference.sum()), float(np.sqrt(difference.size * np.var(difference, ddof=1)))


def run_one(seed: int, flaw: str) -> Row:
    """Diagnose one campaign once, and weigh its refits in both ways."""
    begin = time.perf_counter()
    row: Row = {"seed": seed, "flaw": flaw, "truth": [], "limits": []}
    rules = Rules()
    with tempfile.TemporaryDirectory() as folder:
        if flaw:
            drawn = sketch(seed, "none")
            campaign = read_campaign(filed(drawn, flaw, Path(folder)))
        else:
            drawn = sketch(seed)
            hidden, path, _ = simulated(drawn, Path(folder))
            campaign = read_campaign(path)
            row["truth"] = [one.name for one in hidden]
            row["limits"] = [abs(one.size) / one.limit for one in hidden]
    row["kind"] = "none" if flaw else kind_of(seed)
    search = search_of(campaign, rules, DEFAULT_SOLVER, silent)
    model = as_isolator(classical_guess(campaign).model, recorded=True)
    fit = weighted_by_output(fit_by_output(model, campaign, search), search)
    case = case_of(search, fit)
    refits = refit_candidates(case)
    usable = by_evidence(refits, rules)
    finding = weigh_refits(case, refits).verdict.finding
    row |= {
        "named": finding.effect if finding else None,
        "set": [finding.effect, *finding.indistinguishable] if finding else [],
        "refits": [],
    }
    inflation = smallest_inflation(usable)
    without = {way: predicted(fit.estimate, inflation, way) for way in (False, True)} if usable else {}
    densities = {
        one.score.element.name: {way: predicted(one.estimate, inflation, way) for way in (False, True)}
        for one in usable
    }
    least = min((bic(one.estimate, inflation) for one in usable), default=0.0)
    for one in usable:
        name = one.score.element.name
        best = max(densities.values(), key=lambda entry: entry[False].sum())
        row["refits"].append(
            {
                "effect": name,
                "by_segment": gain(densities[name][False], without[False]),
                "by_record": gain(densities[name][True], without[True]),
                "behind": gain(best[False], densities[name][False]),
                "schwarz": bic(one.estimate, inflation) - least,
                "tie": least_difference(one.estimate, rules),
            }
        )
    return row | {"seconds": round(time.perf_counter() - begin, 2)}


def best_of(row: Row) -> Row | None:
    """Give the refit of the largest gain by segments."""
    return max(row["refits"], key=lambda one: one["by_segment"][0], default=None)


def stands(gained: list[float]) -> bool:
    """Say whether a gain is above two standard errors."""
    return gained[0] > 2.0 * gained[1]


def report(rows: list[Row]) -> None:
    """Print where the two ways agree, and where one of them fails."""
    clear = [row for row in rows if row["kind"] == "one" and row["limits"][0] >= ENOUGH]
    print(f"one effect of the catalogue at {ENOUGH:g} limits and more: {len(clear)} campaigns")
    right = {
        "Schwarz's criterion and carry-over, in use": lambda row: row["named"],
        "by segments": lambda row: name_if_stands(row, "by_segment"),
        "by records": lambda row: name_if_stands(row, "by_record"),
    }
    for words, name in right.items():
        hits = sum(name(row) in family(row["truth"][0]) for row in clear)
        print(f"  {words:<44} right family first: {hits}")
    others = {
        "nothing hidden, flawed measurements": [row for row in rows if row["flaw"]],
        "nothing hidden": [row for row in rows if row["kind"] == "none" and not row["flaw"]],
        "a law outside the catalogue": [row for row in rows if row["kind"] == "outside"],
    }
    for group, members in others.items():
        print(f"{group}: {len(members)} campaigns")
        for words, name in right.items():
            print(f"  {words:<44} something named: {sum(name(row) is not None for row in members)}")
    both = [row for row in rows if row["named"] and best_of(row)]
    same = sum(
        {one["effect"] for one in row["refits"] if one["behind"][0] <= 2.0 * one["behind"][1]}
        == {one["effect"] for one in row["refits"] if one["schwarz"] <= one["tie"]}
        for row in both
    )
    print(f"equal sets of refits within two standard errors and within the tie: {same} of {len(both)}")
    for row in rows:
        best = best_of(row)
        if best:
            segments, records = ("{:.1f} +- {:.1f}".format(*best[key]) for key in ("by_segment", "by_record"))
            hidden = ", ".join(row["truth"]) or row["flaw"] or "nothing"
            columns = f"{hidden:<34} {best['effect']:<22} {segments:<18} {records:<18}"
            print(f"  {row['seed']} {columns} {row['named']}")


def name_if_stands(row: Row, key: str) -> str | None:
    """Give the name that stands by the density of data left out."""
    best = best_of(row)
    return best["effect"] if best and stands(best[key]) else None


def main() -> None:
    """Run campaigns, or report on rows."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seeds", help="such as 12000:12050")
    parser.add_argument("--flaws", nargs="*", default=[""], help="flaws of `innocents.py`")
    parser.add_argument("--out", type=Path)
    parser.add_argument("--report", type=Path)
    parser.add_argument("--cache", type=Path, help="folder in which compiled code is kept between runs")
    options = parser.parse_args()
    if options.report:
        report(read(options.report))
        return
    set_up_jax(options.cache)
    first, _, stop = options.seeds.partition(":")
    done = {(row["seed"], row["flaw"]) for row in read(options.out)}
    for seed in range(int(first), int(stop)):
        for flaw in options.flaws:
            if (seed, flaw) in done:
                continue
            row = run_one(seed, flaw) | {"commit": commit()}
            with options.out.open("a") as file:
                file.write(json.dumps(row) + "\n")
            print(seed, flaw, row["truth"], row["named"], row["seconds"], flush=True)


if __name__ == "__main__":
    main()
