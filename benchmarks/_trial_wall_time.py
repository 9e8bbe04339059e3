"""How long one diagnosis takes: six records of 60 s, compile included, and once more."""

import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from isojax import rig
from isojax.identification import close_loop, diagnose, fit, read_campaign

LEVELS = (60.0, 105.0, 150.0)
FREQUENCIES = tuple(np.linspace(4.0, 7.0, 15).round(3).tolist())
CYCLES = 22
FRICTION = 5.0
PAPER = (1.0805e6, -6.974e8, 2.51667e11, 1.027e4, -3.6880e5, 5.3753e6)


def run_wall_time(seed: int, rate: float) -> dict[str, Any]:
    """Time the loop and the single diagnosis on a campaign that hides dry friction.

    Args:
        seed: of the campaign's noise.
        rate: samples a second [Hz].

    Returns:
        Seconds of the loop in a fresh process and again, of `diagnose` alone with everything compiled, and
        what was found.
    """
    plant = rig.Plant(rig.base_laws(*PAPER)).plus(rig.CoulombFriction(FRICTION))
    plan = rig.SteppedSine(LEVELS, FREQUENCIES, CYCLES, ("forward", "backward"))
    bench = rig.Bench(rate=rate, noise=0.01, drift=0.001)
    with tempfile.TemporaryDirectory() as folder:
        path = rig.write_campaign(Path(folder), plant, (plan,), seed, "wall time", bench)
        campaign = read_campaign(path)
    begin = time.perf_counter()
    close_loop(campaign)
    middle = time.perf_counter()
    loop = close_loop(campaign)
    seconds = middle - begin, time.perf_counter() - middle
    fitted = fit(loop.guess.model, campaign)
    begin = time.perf_counter()
    diagnose(fitted)
    return {
        "rate": rate,
        "first": seconds[0],
        "second": seconds[1],
        "diagnosis": time.perf_counter() - begin,
        "records": [record.output.size / record.rate for record in campaign.records],
        "findings": [{"effect": one.effect, "set": [one.effect]} for one in loop.findings],
        "verdict": loop.verdict,
    }
