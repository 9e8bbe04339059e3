"""Time the loop on long records: fourteen of 75 s at 1 kHz, each case in a fresh process that keeps nothing.

Run: python benchmarks/long_loop.py

Prints the wall time and the processor time of a first loop, compile included, and of a second one in the same
process, with the largest resident memory of both; PASS or FAIL against the marks. Ends with code 1 if any
fails. Run it on two quiet cores: beside other work it takes twice as long.
"""

import os
import resource
import subprocess
import sys
import time

import jax
import numpy as np

from _marks import Marks
from _trial_wall_time import FRICTION, simulate_campaign
from isojax import rig
from isojax.identification import close_loop

LEVELS = tuple(np.linspace(40.0, 160.0, 7).round(1).tolist())
CYCLES = 27
RATE = 1000.0

CASES = {"friction": (30.0, 8.0), "nothing": (15.0, 8.0)}
"""What is hidden, with the marks of the first loop and of the second [s]."""

MOST_MEMORY = 2.0
"""Largest resident memory of the process [GB]."""


def run_case(hidden: str) -> None:
    """Run the loop of a case twice in this process; print a line each."""
    jax.config.update("jax_enable_x64", True)
    laws = {"friction": (rig.CoulombFriction(FRICTION),), "nothing": ()}[hidden]
    campaign = simulate_campaign(1, RATE, LEVELS, CYCLES, *laws)
    for _ in range(2):
        begun, worked = time.perf_counter(), time.process_time()
        loop = close_loop(campaign)
        wall, processor = time.perf_counter() - begun, time.process_time() - worked
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
        named = "+".join(finding.effect for finding in loop.findings) or "nothing"
        print(wall, processor, memory, named, flush=True)


def main() -> None:
    """Run each case in a process of its own, and judge it."""
    marks = Marks()
    for hidden, limits in CASES.items():
        own = {name: value for name, value in os.environ.items() if name != "JAX_COMPILATION_CACHE_DIR"}
        done = subprocess.run(
            [sys.executable, __file__, hidden], env=own, stdout=subprocess.PIPE, text=True, check=True
        )
        for when, limit, line in zip(("first", "second"), limits, done.stdout.splitlines(), strict=True):
            wall, processor, memory, named = line.split()
            words = f"{hidden} hidden, {named} named, {when} loop: {float(wall):.0f} s"
            marks.judge(
                f"{words} (at most {limit:.0f}), {float(processor):.0f} s of processors", float(wall) <= limit
            )
            marks.judge(
                f"  memory {float(memory):.1f} GB (at most {MOST_MEMORY:.0f})", float(memory) <= MOST_MEMORY
            )
    marks.leave()


if __name__ == "__main__":
    run_case(sys.argv[1]) if len(sys.argv) > 1 else main()
