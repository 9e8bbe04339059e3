"""Decays of a linear isolator, whose least squares SciPy can do by itself."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

import isojax as ij

MASS, STIFFNESS, DAMPING = 800.0, 1.2e5, 500.0
RATE = 100.0


class Decay(NamedTuple):
    """A fit to a record: noise, time, reading, and what the fit knows of the start before it looks.

    The measured displacement and velocity of the start, and how far each may be off, are those of the fit.
    """

    fit: ij.Fit
    noise: float
    time: np.ndarray
    reading: np.ndarray
    start: np.ndarray
    spread: np.ndarray

    def chi2(self, damping: float, stiffness: float) -> float:
        """Least squares over the start, in closed form."""
        decay = 0.5 * damping / MASS
        turn = np.sqrt(stiffness / MASS - decay**2)
        cosine, sine = np.cos(turn * self.time), np.sin(turn * self.time) / turn
        columns = np.exp(-decay * self.time)[:, None] * np.stack([cosine + decay * sine, sine], axis=1)
        rows = np.concatenate([columns / self.noise, np.diag(1.0 / self.spread)])
        right = np.concatenate([self.reading / self.noise, self.start / self.spread])
        return float(np.sum((right - rows @ np.linalg.lstsq(rows, right)[0]) ** 2))

    def lowest(self, damping: float) -> float:
        """The same at the best spring."""
        bounds = (0.97 * STIFFNESS, 1.03 * STIFFNESS)
        return float(
            minimize_scalar(
                lambda stiffness: self.chi2(damping, stiffness),
                bounds=bounds,
                method="bounded",
                options={"xatol": 1.0},
            ).fun
        )


def _decay(folder: Path, noise: float) -> Decay:
    """Fit a spring and a damper to 6 s of it."""
    time = np.arange(600) / RATE
    rate = 0.5 * DAMPING / MASS
    motion = 2e-3 * np.exp(-rate * time) * np.cos(np.sqrt(STIFFNESS / MASS - rate**2) * time)
    reading = motion + noise * np.random.default_rng(3).normal(size=time.size)
    np.savez(folder / "decay.npz", force=np.zeros(time.size), displacement=reading)
    (folder / "campaign.toml").write_text(
        f"""
campaign = {{ title = "decay", mass = {MASS} }}
input = {{ quantity = "force", column = "force", unit = "N" }}
output = {{ quantity = "displacement", column = "displacement", unit = "m", noise = {noise} }}
sampling = {{ rate = {RATE} }}
model = {{ stiffness = ["linear"], damping = ["linear"] }}

[[record]]
file = "decay.npz"
role = "fit"
"""
    )
    laws = (ij.LinearStiffness(STIFFNESS), ij.LinearDamping(DAMPING))
    fit = ij.fit(ij.Isolator(MASS, laws), ij.read_campaign(folder))
    simulator = fit.estimate.simulator
    starts = simulator.starts(fit.model, simulator.prepared(fit.model, 2))
    return Decay(fit, noise, time, reading, *(rows[:, 0] for rows in starts))


@pytest.fixture(scope="session")
def decay(tmp_path_factory) -> Decay:
    """Under so much noise that intervals are curved."""
    return _decay(tmp_path_factory.mktemp("decay"), 8e-4)


@pytest.fixture(scope="session")
def sharp_decay(tmp_path_factory) -> Decay:
    """Under so little noise that they are straight."""
    return _decay(tmp_path_factory.mktemp("sharp_decay"), 2e-5)
