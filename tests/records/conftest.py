"""A tiny campaign on disk, of which each test changes one thing."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

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


@pytest.fixture
def channels() -> dict[str, np.ndarray]:
    """The channels of the tiny campaign, for a test to spoil."""
    return tiny_channels()


@pytest.fixture
def tiny(tmp_path: Path) -> Callable[..., Path]:
    """Writes the tiny campaign with a regular expression of its .toml replaced; returns its folder."""

    def write(*changes: tuple[str, str], channels: dict[str, np.ndarray] | None = None) -> Path:
        text = TINY
        for pattern, replacement in changes:
            text, count = re.subn(pattern, replacement, text, count=1, flags=re.M)
            assert count == 1, pattern
        (tmp_path / "campaign.toml").write_text(text, encoding="utf-8")
        if not (tmp_path / "run.csv").exists():
            write_csv(tmp_path / "run.csv", tiny_channels() if channels is None else channels)
        return tmp_path

    return write
