"""The small campaign inside the package: a horizontal isolator whose base model lacks its dry friction.

Run `python -m isojax.rig.demo_campaign FOLDER` to write it again.
"""

import sys
from pathlib import Path

import numpy as np

from ._bench import Bench
from ._campaign import write_campaign
from ._friction import CoulombFriction
from ._plant import Plant, base_laws
from ._sine_plans import SteppedSine

SEED = 20240611
"""Seed of the campaign in the package."""


def write_demo_campaign(folder: str | Path, seed: int = SEED) -> Path:
    """Write the demo campaign: three levels up and down in frequency to fit, one level held out.

    Args:
        folder: made if it is not there.
        seed: of noise and drift.

    Returns:
        Path of campaign.toml.
    """
    plant = Plant((*base_laws(1.12e6, -7.1e8, 2.48e11, 1.01e4, -3.6e5, 5.2e6), CoulombFriction(4.0)))
    frequencies = tuple((np.arange(40, 65, 3) / 10).tolist())
    plan = SteppedSine((50.0, 90.0, 140.0), frequencies, cycles=15, holdout_levels=(120.0,))
    bench = Bench(rate=500.0, noise=0.01, drift=0.0005)
    return write_campaign(folder, plant, plan, seed, "isojax demo: stepped sine, horizontal", bench)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: python -m isojax.rig.demo_campaign FOLDER")
    print(write_demo_campaign(sys.argv[1]))
