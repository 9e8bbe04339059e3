"""The text and the channels of a tiny campaign, of which tests change one thing each."""

from pathlib import Path

import numpy as np

RATE, SAMPLES = 200.0, 2000

TINY = """\
[campaign]
title = "tiny"
mass = 2.0

[input]
quantity = "force"
column = "force"
unit = "N"

[output]
quantity = "acceleration"
column = "acceleration"
unit = "m/s^2"

[sampling]
rate = 200.0

[model]
stiffness = ["linear"]
damping = ["linear"]

[[record]]
file = "run.csv"
role = "fit"
"""


def tiny_channels() -> dict[str, np.ndarray]:
    """Time, force and acceleration of broadband excitation."""
    random = np.random.default_rng(7)
    time = np.arange(SAMPLES) / RATE
    force = np.convolve(random.normal(size=SAMPLES), np.ones(4) / 4, mode="same")
    return {"time": time, "force": force, "acceleration": 0.5 * force + 0.01 * random.normal(size=SAMPLES)}


def write_csv(file: Path, channels: dict[str, np.ndarray]) -> None:
    table = np.column_stack(list(channels.values()))
    np.savetxt(file, table, delimiter=",", header=",".join(channels), comments="", fmt="%.9g")
