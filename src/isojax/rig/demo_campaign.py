"""The small campaign inside the package: a horizontal isolator whose declared model lacks its dry friction.

Run `python -m isojax.rig.demo_campaign FOLDER` to write it again.
"""

import sys
from pathlib import Path

import numpy as np

from ._bench import Bench
from ._dampers import LinearDamping
from ._friction import CoulombFriction
from ._plant import Plant
from ._sine_plans import SteppedSine
from ._springs import CubicStiffness, LinearStiffness
from ._write_campaign import write_campaign

SEED = 20240611
"""Seed of the campaign in the package."""


def write_demo_campaign(folder: str | Path, seed: int = SEED) -> Path:
    """Write the demo campaign: two levels up and down in frequency to fit, one level between them held out.

    The friction of 30 N is large beside the drive of 60 to 150 N. A viscous damper cannot follow it, so the
    declared model misses the held-out motion by a fifth of its rms; with the friction noise alone remains.

    Args:
        folder: made if it is not there.
        seed: of noise and drift.

    Returns:
        Path of campaign.toml.
    """
    spring, damper = (LinearStiffness(1.12e6), CubicStiffness(1.5e11)), LinearDamping(4e3)
    frequencies = tuple((np.arange(46, 71, 3) / 10).tolist())
    return write_campaign(
        folder,
        Plant((*spring, damper, CoulombFriction(30.0))),
        SteppedSine((60.0, 150.0), frequencies, cycles=15, holdout_levels=(100.0,)),
        seed,
        "isojax demo: stepped sine, horizontal",
        Bench(rate=500.0, noise=0.01, drift=0.0005),
        declared=("linear_stiffness", "cubic_stiffness", "linear_damping"),
    )


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: python -m isojax.rig.demo_campaign FOLDER")
    print(write_demo_campaign(sys.argv[1]))
