"""One campaign of the blind trial: drawn, diagnosed without its truth, and beside an oracle that knows it."""

import os
import tempfile
import time
import traceback
from pathlib import Path
from typing import Any

import numpy as np

from _trial_campaign import Secret, Sketch, file_campaign, secrets, sketch
from _trial_effects import EFFECTS, element_of, exact_class
from _trial_range import miss, reading_miss
from _trial_wall_time import run_wall_time
from isojax._parameters import own_parameters
from isojax._results import is_successful
from isojax.elements import AbstractElement
from isojax.identification import (
    Fit,
    Loop,
    close_loop,
    fit,
    read_campaign,
    scales,
)
from isojax.records import Campaign
from isojax.rig import Instrument, Law

Row = dict[str, Any]
VISITED = (4.3, 5.0, 5.6)
"""Frequencies at which the force of what was found is compared with the true one [Hz]."""

TRIES = 4
"""Times that the size is halved where the plant runs away."""


def run_one(seed: int, kind: str, task: str, names: tuple[str, ...] | None = None) -> Row:
    """Draw a campaign, do a task on it, and say all that the judge needs.

    Args:
        seed: of the campaign.
        kind: class of the campaign.
        task: "loop" (diagnosed blind), "leave_out" (the true effect is no candidate), "coverage" (the true
            structure fitted, nothing diagnosed) or "wall_time" (a loop by the clock, twice).
        names: what is hidden, drawn if omitted; of "wall_time" the sampling rate [Hz].

    Returns:
        What goes into a line of the output file; "error" where something raised.
    """
    begin = time.perf_counter()
    row: Row = {"seed": seed, "kind": kind, "task": task}
    try:
        if task == "wall_time":
            timed = run_wall_time(seed, float(names[0]) if names else 250.0)
            return row | {"truth": []} | timed | {"total_seconds": time.perf_counter() - begin}
        drawn = sketch(seed, kind, names)
        with tempfile.TemporaryDirectory() as folder:
            hidden, path, size = simulated(drawn, Path(folder), held_out=task != "coverage")
            campaign = read_campaign(path)
        row |= _facts(drawn, hidden, size)
        if task == "loop":
            loop = close_loop(campaign)
            row |= _said_of(loop)
        elif task == "leave_out":
            excluded = exact_class(hidden[0].name)
            loop = close_loop(campaign, excluded=excluded)
            row |= {"excluded": excluded} | _said_of(loop)
        laws = [secret.law for secret in hidden if _is_force(secret.law)]
        if (
            (kind == "outside" or task == "leave_out")
            and row["verdict"] == "found"
            and len(laws) == len(hidden)
        ):
            row["miss"] = miss(loop, drawn.plant.plus(*laws), drawn.levels[:3], VISITED)
        elif task == "leave_out" and row["verdict"] == "found":
            plant = drawn.plant.plus(*(secret.law for secret in hidden))
            with tempfile.TemporaryDirectory() as folder:
                row["reading_miss"] = reading_miss(
                    loop, plant, drawn.bench, drawn.levels[:3], VISITED, Path(folder)
                )
        if kind != "outside" and (task == "coverage" or (kind != "none" and task == "loop")):
            row |= _oracle(drawn, hidden, campaign, with_errors=task == "loop")
    except Exception as problem:  # one campaign that fails is a failure of the trial, not its end
        row["error"] = "".join(traceback.format_exception(problem))[-2000:]
    row["total_seconds"] = round(time.perf_counter() - begin, 2)
    return row


def _is_force(effect: Law | Instrument) -> bool:
    """Say whether an effect is a force of the motion alone, and not of when in the test it is."""
    return isinstance(effect, Law) and type(effect).placed is Law.placed


def simulated(drawn: Sketch, folder: Path, held_out: bool = True) -> tuple[tuple[Secret, ...], Path, float]:
    """File the campaign, with smaller effects where the plant would run away."""
    hidden = secrets(drawn) if drawn.names else ()
    for attempt in range(TRIES):
        share = 0.5**attempt
        smaller = tuple(_shrunk(secret, share) for secret in hidden)
        try:
            return smaller, file_campaign(drawn, smaller, folder / f"blind{attempt}", held_out), share
        except RuntimeError:
            continue
    raise RuntimeError(f"The plant of seed {drawn.seed} runs away at an eighth of the drawn size.")


def _shrunk(secret: Secret, share: float) -> Secret:
    if share == 1.0 or not np.isfinite(secret.size):
        return secret
    size = share * secret.size
    law = EFFECTS[secret.name].law(size, secret.shape)
    return Secret(secret.name, size, secret.limit, secret.shape, law)


def _facts(drawn: Sketch, hidden: tuple[Secret, ...], share: float) -> Row:
    """Give the truth."""
    return {
        "layout": drawn.layout,
        "levels": drawn.levels,
        "noise": drawn.bench.noise,
        "drift": drawn.bench.drift,
        "base": drawn.base,
        "shrunk": share,
        "truth": [
            {
                "effect": secret.name,
                "size": secret.size,
                "limits": abs(secret.size) / secret.limit,
                "shape": secret.shape
                or {key: np.asarray(number).tolist() for key, number in vars(secret.law).items()},
            }
            for secret in hidden
        ],
    }


def _errors(held: Fit) -> Row:
    """Give chi2/dof with every segment restarted, of both roles."""
    return {role: None if errors is None else errors.chi2_per_dof for role, errors in held.errors.items()}


def _said_of(loop: Loop) -> Row:
    """Give what the closed loop says."""
    findings = []
    for finding in loop.findings:
        entry: Row = {
            "effect": finding.effect,
            "set": [finding.effect, *finding.indistinguishable],
            "p_value": finding.p_value,
            "explained": finding.excess_explained,
            "transfer": finding.transfer,
        }
        element = loop.after.model.element(finding.effect)
        if element is not None:
            name = f"{finding.effect}.{element.strength}"
            entry |= {
                "strength": float(loop.after.model[name]),
                "error": loop.after.standard_errors.get(name, float("nan")),
                "signed": element.signed,
            }
        findings.append(entry)
    return {
        "verdict": loop.verdict,
        "findings": findings,
        "before": _errors(loop.before),
        "after": _errors(loop.after),
        "scatter": loop.before.stats.stiffness_scatter,
        "reason": loop.last.reason,
        "alternatives": [
            {
                "effects": one.effects,
                "laws": [[law.formula, round(law.delta_chi2, 2)] for law in one.laws[:6]],
            }
            for one in loop.alternatives
        ],
        "ranking": [
            [entry.effect, round(entry.z, 2), entry.p_value, entry.admissible]
            for entry in (loop.extensions[0].verdict if loop.extensions else loop.last).ranking[:6]
        ],
        "seconds": round(loop.seconds, 2),
    }


def _oracle(drawn: Sketch, hidden: tuple[Secret, ...], campaign: Campaign, with_errors: bool) -> Row:
    """Fit the true structure from the true numbers: what the best diagnosis could reach."""
    magnitudes = scales(campaign)
    truth = drawn.model.with_elements(
        *(element_of(secret.name, secret.shape, magnitudes, secret.size) for secret in hidden)
    )
    start = drawn.model.with_elements(*(_off_its_bounds(one) for one in truth.elements[len(drawn.base) :]))
    found = fit(start, campaign)
    off = {
        name: (float(found.model[name]) - float(truth[name])) / error
        for name, error in found.standard_errors.items()
    }
    return ({"oracle": _errors(found)} if with_errors else {}) | {
        "oracle_converged": bool(is_successful(found.result)),
        "off": {name: (value if np.isfinite(value) else None) for name, value in off.items()},
    }


def _off_its_bounds(element: AbstractElement) -> AbstractElement:
    """Give an element whose fitted numbers may move: at the very bound of an interval nothing would."""
    numbers = dict(vars(element))
    for name, spec in own_parameters(element):
        if spec.fitted and np.isfinite(spec.upper - spec.lower):
            margin = 0.02 * (spec.upper - spec.lower)
            numbers[name] = float(np.clip(numbers[name], spec.lower + margin, spec.upper - margin))
    return type(element)(**numbers)


def crowded(most: int = 30_000) -> bool:
    """Say whether compiled code crowds the address space, which Linux limits to 65530 mappings."""
    mappings = Path("/proc/self/maps")
    return os.path.exists(mappings) and len(mappings.read_bytes().splitlines()) > most
