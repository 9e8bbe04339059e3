"""How long a loop and the first diagnosis in it take, compile included and again: six records of 60 s."""

import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from isojax import read_campaign, rig
from isojax.identification import Loop, close_loop
from isojax.records import Campaign

LEVELS = (60.0, 105.0, 150.0)
FREQUENCIES = tuple(np.linspace(4.0, 7.0, 15).round(3).tolist())
CYCLES = 22
FRICTION = 5.0
PAPER = (1.0805e6, -6.974e8, 2.51667e11, 1.027e4, -3.6880e5, 5.3753e6)

PARTS_TIMED = (
    "one diagnosis",
    "the classical guess, the fit and one diagnosis",
    "the loop: the guess, the fit, the effect added, and two diagnoses",
)
"""What the clock is read for."""


def run_wall_time(seed: int, rate: float) -> dict[str, Any]:
    """Time the loop, and the first diagnosis in it, on a campaign that hides dry friction.

    Args:
        seed: of the campaign's noise.
        rate: samples a second [Hz].

    Returns:
        Seconds of `PARTS_TIMED` in a fresh process and again in the same, and what was found.
    """
    campaign = simulate_campaign(seed, rate, LEVELS, CYCLES, rig.CoulombFriction(FRICTION))
    (_, first), (loop, second) = _timed(campaign), _timed(campaign)
    return {
        "rate": rate,
        "first": first,
        "second": second,
        "records": [record.output.size / record.rate for record in campaign.records],
        "findings": [{"effect": one.effect, "set": [one.effect]} for one in loop.findings],
        "verdict": loop.verdict,
    }


def simulate_campaign(
    seed: int, rate: float, levels: tuple[float, ...], cycles: int, *hidden: rig.Law
) -> Campaign:
    """Simulate stepped sines up and down on the paper's y direction.

    Args:
        seed: of the noise.
        rate: samples a second [Hz].
        levels: amplitudes of the force [N].
        cycles: of each dwell.
        hidden: laws that the campaign does not declare.

    Returns:
        The campaign, read from its files.
    """
    plant = rig.Plant(rig.base_laws(*PAPER)).plus(*hidden)
    plan = rig.SteppedSine(levels, FREQUENCIES, cycles, ("forward", "backward"))
    bench = rig.Bench(rate=rate, noise=0.01, drift=0.001)
    with tempfile.TemporaryDirectory() as folder:
        return read_campaign(rig.write_campaign(Path(folder), plant, (plan,), seed, "wall time", bench))


def _timed(campaign: Campaign) -> tuple[Loop, tuple[float, ...]]:
    """Run the loop; give the seconds of each of `PARTS_TIMED`."""
    lines: list[tuple[float, str]] = []
    begin = time.perf_counter()
    loop = close_loop(campaign, progress=lambda line: lines.append((time.perf_counter() - begin, line)))
    whole = time.perf_counter() - begin
    reason = loop.extensions[0].verdict.reason if loop.extensions else loop.last.reason
    started = next(instant for instant, line in lines if line.startswith("score test"))
    ended = next(instant for instant, line in lines if line == reason)
    return loop, (ended - started, ended, whole)
